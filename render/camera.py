"""Photograph a room through its own sensor: the second source of observations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.film import borrow, likeness, smooth
from render.material import material_at
from render.room import Room
from render.surfaces import scatters, transmits, two_sided
from render.transport import LANES, Transport, direct, indirect, known_light
from render.view import NOTHING, View, appearance

GRID = 4  # rays squared over a pixel's footprint, its corners among them: no straight edge escapes
_ENDS = np.where(np.arange(GRID) % (GRID - 1) == 0, 0.5, 1.0) / (GRID - 1)
WEIGHTS = np.outer(_ENDS, _ENDS).ravel()  # of the trapezoidal rule, for the pixel's average
SMOOTH = 0.1  # rad: a smooth footprint bends by less, and is seen at more than this angle
SAME_BRDF = 0.02  # within one footprint the BRDF may vary by this share
TINY = 1e-6  # share of the diagonal that is lost in rounding


def photograph(
    room: Room,
    *,
    sensor: int = 0,
    width: int | None = None,
    height: int | None = None,
    spp: int = 64,
    seed: int = 0,
    transport: Transport = "full",
) -> View:
    """Photograph a room through its own camera, layer by layer.

    The radiance of a pixel is B at the point that the ray through the pixel's centre hits, so that
    it belongs to the position, normal and BRDF beside it, and with direct light is exact up to a
    shadow's edge. ``film`` is the average over the pixel, as a film records it, with the noise of
    its indirect light smoothed along surfaces.

    Parameters
    ----------
    room : Room
        The room, lit by its own lights.
    sensor : int
        Which of the scene's sensors, those left out that this Mitsuba does not have; it must be a
        ``perspective`` one (a pinhole).
    width, height : int, optional
        Pixels; the sensor's own where None. Pixels stay as wide as they are high: one of the two
        keeps the picture's proportions, and both keep its horizontal field of view.
    spp : int
        Path samples per pixel for the indirect part (``transport="full"``), at least 2.
    seed : int
        Seed of everything random here; same seed, same bytes, for any number of threads.
    transport : {"full", "direct"}
        "direct" is exact, light by light; "full" adds all interreflection.

    Returns
    -------
    View
        The layers, radiance in W sr^-1 m^-2 and positions in the room's unit of length.

    Raises
    ------
    ValueError
        If an argument is out of range, or the sensor does not exist or is no pinhole.

    Examples
    --------
    What a camera sees of direct light is B = sum I S of Eq. 4:

    >>> import numpy as np
    >>> from lightloc import radiance
    >>> from render import load, observe_view, photograph
    >>> room = load("box_one")
    >>> q = observe_view(photograph(room, width=16, transport="direct"), room)
    >>> bool(np.allclose(radiance(q, room.lights, room.geometry), q.radiance, rtol=1e-4))
    True
    """
    if spp < 2 or transport not in ("direct", "full"):
        raise ValueError(
            "photograph expects spp >= 2 and transport 'direct' or 'full'; "
            f"got {spp}, '{transport}'"
        )
    pixels = _pixels(room, sensor, width, height)
    si = room.scene.ray_intersect(pixels.rays(dr.arange(mi.UInt32, pixels.count)))
    dr.eval(si)
    shape = shape_index(room, si)
    hit = shape != NOTHING

    def layer(values: NDArray) -> NDArray:
        """As rows and columns, and 0 where nothing is hit."""
        there = hit.reshape(-1, *[1] * (values.ndim - 1))
        return np.where(there, values, 0).reshape(pixels.height, pixels.width, *values.shape[1:])

    albedo, roughness = np.zeros((pixels.count, 3)), np.zeros(pixels.count)
    if hit.any():
        seen = dr.gather(mi.SurfaceInteraction3f, si, mi.UInt32(np.flatnonzero(hit)))
        albedo[hit], roughness[hit] = appearance(material_at(seen), int(hit.sum()))
    surface = {
        "shape": shape.reshape(pixels.height, pixels.width),
        "normal": layer(_numpy(towards(si.sh_frame.n, si))),
        "albedo": layer(albedo),
        "roughness": layer(roughness),
    }
    position, B, variance = (
        layer(_numpy(si.p)),
        layer(direct(room.scene, si)),
        np.zeros((*shape.shape, 3)),
    )
    pure, film = np.zeros(pixels.count, bool), np.zeros((pixels.count, 3))
    for block in pixels.blocks(np.arange(pixels.count)):
        pure[block], film[block] = _footprint(room, pixels, block, si)
    if transport == "full":
        more, sigma = indirect(room.scene, si, spp, seed)
        B, variance = B + layer(more), sigma**2
        steady = smooth(layer(more), **surface)
        film += steady.reshape(-1, 3)
        own = likeness(position, surface["normal"], surface["shape"], room.diagonal)
        for block in pixels.blocks(np.flatnonzero(~pure)):
            wanted = _likeness_of_rays(room, pixels, block)
            film[block] += (
                borrow(steady, own, block, wanted, WEIGHTS) - steady.reshape(-1, 3)[block]
            )
    if room.known is not None:
        more, sigma = np.zeros((2, pixels.count, 3))
        if hit.any():
            x, w = _numpy(seen.p), _numpy(seen.to_world(seen.wi))
            more[hit], sigma[hit] = known_light(room.known, x, w, spp, seed, transport)
        B, variance = B + layer(more), variance + sigma**2
        emitting, sky = _emitted(room, si)
        pure &= ~emitting
        film += np.where(hit[:, None], more, sky)
    return View(
        radiance=B,
        variance=layer(variance),
        position=position,
        facet=layer(_numpy(towards(si.n, si))),
        pure=layer(pure),
        film=np.maximum(film, 0).reshape(pixels.height, pixels.width, 3),
        camera=pixels.pinhole,
        interreflected=transport == "full",
        unit=room.unit,
        **surface,
    )


@dataclass(frozen=True)
class Pixels:
    """The pixels of a sensor, counted row by row from the top left."""

    sensor: Any
    width: int
    height: int
    rows_per_column: float  # heights of the film, as a share, to one pixel of its width

    @property
    def count(self) -> int:
        return self.width * self.height

    @property
    def pinhole(self) -> NDArray:
        return np.array(self.sensor.world_transform().translation(), float).ravel()

    def blocks(self, chosen: NDArray) -> Iterator[NDArray]:
        """Some pixels, in parts whose footprints fit into one wavefront."""
        if len(chosen):
            yield from np.array_split(chosen, -(-len(chosen) * GRID**2 // LANES))

    def rays(self, pixel: Any, across: Any = 0.5, down: Any = 0.5) -> Any:
        """Rays through a place in each pixel, (0.5, 0.5) being its centre."""
        row = pixel // self.width
        column = pixel - row * self.width
        u = (mi.Float(column) + across) / self.width
        v = 0.5 + (mi.Float(row) + down - 0.5 * self.height) * self.rows_per_column
        ray, _ = self.sensor.sample_ray(0.0, 0.0, mi.Point2f(u, v), mi.Point2f(0.5))
        return ray

    def footprints(self, block: NDArray) -> tuple[Any, Any]:
        """GRID x GRID rays spread over each of some pixels, and the pixel of each ray."""
        lane = dr.arange(mi.UInt32, len(block) * GRID**2)
        pixel = dr.gather(mi.UInt32, mi.UInt32(block), lane // GRID**2)
        cell = lane % GRID**2
        across, down = mi.Float(cell % GRID), mi.Float(cell // GRID)
        return self.rays(pixel, across / (GRID - 1), down / (GRID - 1)), pixel


def pinhole(room: Room, sensor: int) -> Any:
    """One of the scene's sensors; raises ValueError where there is none or it is no pinhole."""
    sensors = room.scene.sensors()
    if not 0 <= sensor < len(sensors):
        raise ValueError(f"{room.path}: has no sensor {sensor} (it has {len(sensors)})")
    chosen = sensors[sensor]
    if chosen.class_name() != "PerspectiveCamera":
        raise ValueError(
            f"{room.path}: sensor {sensor} is a {chosen.class_name()}; expected a perspective one"
        )
    return chosen


def _pixels(room: Room, sensor: int, width: int | None, height: int | None) -> Pixels:
    chosen = pinhole(room, sensor)
    columns, rows = (int(side) for side in chosen.film().crop_size())
    for name, side in (("width", width), ("height", height)):
        if side is not None and side < 1:
            raise ValueError(f"photograph expects a {name} of at least 1 pixel; got {side}")
    if width is None:
        width = columns if height is None else max(1, round(height * columns / rows))
    if height is None:
        height = max(1, round(width * rows / columns))
    return Pixels(chosen, width, height, columns / (rows * width))


def _footprint(room: Room, pixels: Pixels, block: NDArray, centre: Any) -> tuple[Any, Any]:
    """Of some pixels: whether each is pure (n,), and its mean direct radiance (n, 3)."""
    pure, si = purity(room, pixels, block, centre)
    B = np.where(np.array(si.is_valid())[:, None], direct(room.scene, si), 0)
    return pure, WEIGHTS @ B.reshape(-1, GRID**2, 3)


def purity(room: Room, pixels: Pixels, block: NDArray, centre: Any) -> tuple[Any, Any]:
    """Of some pixels: whether each is pure (n,), and what its GRID x GRID rays hit."""
    ray, pixel = pixels.footprints(block)
    si = room.scene.ray_intersect(ray)
    dr.eval(si)
    c = dr.gather(mi.SurfaceInteraction3f, centre, pixel)
    n, away = towards(c.sh_frame.n, c), si.p - c.p
    bend = dr.norm(towards(si.sh_frame.n, si) - n)
    leave = dr.abs(dr.dot(c.n, away)) - SMOOTH * dr.norm(away)
    same = si.is_valid() & c.is_valid() & (si.shape == c.shape) & (si.instance == c.instance)
    same &= (bend < SMOOTH) & (leave < TINY * room.diagonal)
    same &= dr.dot(n, c.to_world(c.wi)) > SMOOTH  # else the footprint is long and thin
    f, g = _fingerprint(si), _fingerprint(c)
    same &= dr.max(dr.abs(f - g)) <= SAME_BRDF * dr.max(g)
    flags = c.bsdf().flags()
    same &= (mi.Frame3f.cos_theta(c.wi) > 0) | two_sided(flags)
    same &= scatters(flags) & ~transmits(flags)
    return np.array(same).reshape(-1, GRID**2).all(axis=1), si


def lamps(room: Room, si: Any) -> NDArray[np.bool_]:
    """(n,) bool: which interactions are with a surface that emits known light."""
    shapes = room.known.shapes() if room.known else []
    emitting = [place for place, shape in enumerate(shapes) if shape.is_emitter()]
    return np.isin(shape_index(room, si), emitting)


def _emitted(room: Room, si: Any) -> tuple[NDArray, NDArray]:
    """Of n pixels: which show a lamp, (n,), and the radiance of the sky there, (n, 3)."""
    behind = room.known.environment()
    sky = np.zeros(3) if behind is None else _numpy(behind.eval(si))
    return lamps(room, si), np.broadcast_to(sky, (dr.width(si), 3))


def _likeness_of_rays(room: Room, pixels: Pixels, block: NDArray) -> NDArray[np.float64]:
    """(n, GRID^2, f) features of what the rays of some pixels hit; see `likeness`."""
    ray, _ = pixels.footprints(block)
    si = room.scene.ray_intersect(ray)
    dr.eval(si)
    found = likeness(
        _numpy(si.p), _numpy(towards(si.sh_frame.n, si)), shape_index(room, si), room.diagonal
    )
    return found.reshape(len(block), GRID**2, -1)


def _fingerprint(si: Any) -> Any:
    """The BRDF seen and lit from straight above: it tells materials and textures apart."""
    above = mi.SurfaceInteraction3f(si)
    above.wi = mi.Vector3f(0, 0, 1)
    return si.bsdf().eval(mi.BSDFContext(), above, above.wi)


def towards(n: Any, si: Any) -> Any:
    """The normal on the side that is seen."""
    return dr.select(dr.dot(n, si.to_world(si.wi)) < 0, -n, n)


def shape_index(room: Room, si: Any) -> NDArray[np.int32]:
    """The place in the scene's list of each shape that was hit, `NOTHING` where none was."""
    within = np.array(dr.reinterpret_array(mi.UInt32, si.instance))
    number = np.where(within, within, np.array(dr.reinterpret_array(mi.UInt32, si.shape)))
    index = np.full(len(number), NOTHING, np.int32)
    for place, shape in enumerate(room.scene.shapes()):
        own = dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))
        index[number == int(own[0])] = place
    index[~np.array(si.is_valid())] = NOTHING
    return index


def _numpy(v: Any) -> NDArray[np.float64]:
    return np.array(v, dtype=np.float64).T
