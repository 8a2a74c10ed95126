"""A picture's pixels as observations, by its scene or by its own layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import binary_dilation

from lightloc import Lambert, Observations
from lightloc.checks import array, number
from lightloc.given import clipped_in
from render.camera import SMOOTH, Pixels, lamps, pinhole, purity, shape_index, towards
from render.exr import light_of_view
from render.material import is_grey, material_at, regions_at
from render.neighbours import BOX, Filter, at_centres, noise_of, smooth
from render.picture import Picture, read_picture
from render.room import Room
from render.transport import Transport, to_numpy
from render.view import NOTHING

UNIT = 0.01  # a normal's length may be off by this; half floats, averages over a smooth pixel


def observe_picture(
    picture: Picture | str | Path | Sequence[str | Path],
    room: Room | None = None,
    *,
    sensor: int = 0,
    camera: ArrayLike | None = None,
    transport: Transport | None = None,
    max_depth: int | None = None,
    unit: str = "unit",
) -> Observations:
    """Take the observations from a picture that another program wrote: each pure pixel is a q.

    With its scene, positions, normals and BRDFs are those where rays through the pixels' centres
    hit. Without, the picture's layers must say them; all surfaces are then Lambert.

    Parameters
    ----------
    picture : Picture, str, Path or sequence of these
        From `read_picture`, or the paths of its files.
    room : Room, optional
        The scene that it shows, whose camera took it.
    sensor : int
        Which of the scene's sensors took it, a pinhole. The picture may be scaled.
    camera : (3,) array_like, optional
        Where it was taken from, where there is no scene: the position in the scene's unit of
        length. Where None, that of the file's ``worldToCamera``.
    transport : {"full", "direct"}, optional
        "full" where the picture holds interreflected light, as most do; "direct" where it does not.
        Where None, "direct" where ``max_depth`` says so, else "full".
    max_depth : int, optional
        Length of the longest paths in a picture, as Mitsuba counts: 2 is direct light, and -1 that
        they go on until they carry nothing. Where None, as the scene's own integrator has it; -1
        where there is none, and of a view of ours.
    unit : str
        The unit of length where there is no scene, a word for prints and files.

    Returns
    -------
    Observations
        Those of the pixels that show one smooth surface, as do their neighbours, so that no filter
        of the film brings in another, and whose noise is their own: of a film whose filter is wider
        than a pixel, as Mitsuba's by default, every second row and column, or fewer. They stand row
        by row. With a scene, in linear Rec. 709; without, in the picture's own colours, in which a
        renderer multiplies light by albedo. ``saturated`` where the picture's brightest value is
        met too often to be one. One channel where picture and BRDFs are grey. ``sigma``, right but
        for a factor, is that of the picture's own layer or else of how far each pixel is from its
        neighbours.

    Raises
    ------
    ValueError
        In one sentence that names the file: if it can't be read (see `read_picture`), there is
        neither a scene nor layers of position, normal and albedo with a camera, it has another
        shape than the sensor's film, ``max_depth`` is neither -1 nor at least 2, it is
        grey where the scene has colours, or no pixel can be used.

    Examples
    --------
    A view is a picture too, whose layers are enough in a diffuse room:

    >>> import tempfile
    >>> from render import load, observe_picture, photograph, write_exr
    >>> room = load("box_one")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_exr(photograph(room, width=32, transport="direct"), f"{folder}/a.exr")
    ...     q = observe_picture(f"{folder}/a.exr", room, transport="direct")
    >>> q.channels, q.relative_sigma, q.interreflected
    (1, True, False)
    """
    if transport not in ("direct", "full", None):
        raise ValueError(f"observe_picture expects transport 'direct' or 'full'; got '{transport}'")
    if not isinstance(picture, Picture):
        paths = [picture] if isinstance(picture, str | Path) else list(picture)
        picture = read_picture(*paths)
    if room is not None and camera is not None:
        raise ValueError("observe_picture takes a room, whose sensor is the camera, or a camera")
    ends = _path_end(picture, room, max_depth)
    both = transport != "direct" if ends != 2 else transport == "full" and max_depth is None
    ends = ends if both and ends != 2 else None
    if room is not None:
        return replace(_by_room(picture, room, sensor, both), max_depth=ends)
    return replace(_by_layers(picture, camera, both), unit=unit, max_depth=ends)


def _path_end(picture: Picture, room: Room | None, asked: int | None) -> int | None:
    """Length of the longest paths in a picture; None where they have no end."""
    if asked is not None and asked != -1:
        number("max_depth", asked, 2, whole=True)
        return asked
    if asked == -1:
        return None
    if held := light_of_view(picture.name):
        return 2 if held == "direct" else None
    return room.max_depth if room else None


def _by_room(picture: Picture, room: Room, sensor: int, interreflected: bool) -> Observations:
    pixels = _Window.of(picture, room, sensor)
    si = room.scene.ray_intersect(pixels.rays(dr.arange(mi.UInt32, pixels.count)))
    dr.eval(si)
    size = picture.inside.shape
    pure = np.zeros(pixels.count, bool)
    for block in pixels.blocks(np.flatnonzero(picture.known & picture.inside)):
        pure[block], _ = purity(room, pixels, block, si)
    shape = shape_index(room, si).reshape(size)
    normal = to_numpy(towards(si.sh_frame.n, si)).reshape(*size, 3)
    pure = (pure & ~lamps(room, si)).reshape(size) & (shape != NOTHING)
    used = pure & smooth(to_numpy(si.p).reshape(*size, 3), normal, pure, shape)
    _some(picture, used)
    seen = dr.gather(mi.SurfaceInteraction3f, si, mi.UInt32(np.flatnonzero(used)))
    material = material_at(seen)
    radius = pixels.sensor.film().rfilter().radius()
    if not radius > 0:
        raise ValueError(f"{room.path}: the film's filter has radius {radius:g}; expected above 0")
    film, B, sigma = Filter.of(pixels.sensor), picture.radiance, picture.sigma
    if B.shape[2] == 1 and material.channels == 3:
        raise ValueError(f"{picture.name}: is grey, but the surfaces of {room.path} have colours")
    if B.shape[2] == 3:
        B = B @ picture.to_rec_709.T
        sigma = None if sigma is None else np.sqrt(sigma**2 @ (picture.to_rec_709**2).T)
    c = _channels(B[used], material.channels)
    regions, names = regions_at(seen)
    rows = _apart(used, film)
    q = Observations(
        positions=to_numpy(seen.p),
        normals=normal[used],
        facets=to_numpy(towards(seen.n, seen)),
        directions=to_numpy(seen.to_world(seen.wi)),
        radiance=at_centres(B, used, film)[:, :c],
        sigma=noise_of(B, used, film, sigma)[:, :c],
        relative_sigma=True,
        material=material,
        saturated=_clipped(picture, used),
        interreflected=interreflected,
        regions=regions,
        region_names=names,
        unit=room.unit,
        intensity_unit=room.lights.intensity_unit,
    )
    return q if rows.all() else q.at(rows)


def _by_layers(picture: Picture, camera: ArrayLike | None, interreflected: bool) -> Observations:
    x, n, albedo = picture.position, picture.normal, picture.albedo
    if x is None or n is None or albedo is None:
        missing = [m for m in ("position", "normal", "albedo") if getattr(picture, m) is None]
        raise ValueError(
            f"{picture.name}: does not say what its pixels show (no {', '.join(missing)}); give "
            "the scene with its camera, such layers, or a view of `lightloc render --view`"
        )
    place = picture.camera if camera is None else array("camera", camera, (3,))
    if place is None:
        raise ValueError(
            f"{picture.name}: does not say where it was taken from (no worldToCamera); give the "
            "camera's position, which tells the sides of surfaces that are seen"
        )
    w = place - x
    length = np.linalg.norm(n, axis=2)
    with np.errstate(invalid="ignore"):
        n = n * np.where((n * w).sum(axis=2) < 0, -1.0, 1.0)[..., None]
        slant = (n * w).sum(axis=2) / np.maximum(np.linalg.norm(w, axis=2), 1e-300)
        there = picture.known & (np.abs(length - 1) < UNIT) & np.isfinite(x).all(axis=2)
        there &= (albedo >= 0).all(axis=2) & (albedo <= 1).all(axis=2) & (albedo > 0).any(axis=2)
        there &= slant > SMOOTH
    used = smooth(x, n, there)
    _some(picture, used)
    B, a = picture.radiance, albedo[used]
    a = a[:, : _channels(a, 1)]
    if B.shape[2] == 1 and a.shape[1] == 3:
        raise ValueError(f"{picture.name}: is grey, but its albedo has colours")
    c = _channels(B[used], a.shape[1])
    return Observations(
        positions=at_centres(x, used, BOX),
        normals=n[used],
        directions=w[used],
        radiance=at_centres(B, used, BOX)[:, :c],
        sigma=noise_of(B, used, BOX, picture.sigma)[:, :c],
        relative_sigma=True,
        material=Lambert(albedo=a),
        saturated=_clipped(picture, used),
        interreflected=interreflected,
    )


def _some(picture: Picture, used: NDArray[np.bool_]) -> None:
    if not used.any():
        raise ValueError(
            f"{picture.name}: no pixel shows one smooth surface together with its neighbours; "
            "expected at least one"
        )


def _apart(used: NDArray[np.bool_], film: Filter) -> NDArray[np.bool_]:
    """Which of the used pixels have noise of their own: where a filter is wide, not all have."""
    row, column = np.nonzero(used)
    lattice = row % film.stride * film.stride + column % film.stride
    return np.asarray(lattice == np.bincount(lattice).argmax())


def _clipped(picture: Picture, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of the used pixels the picture's range has clipped, or neighbours of theirs, by which
    they are told at their centres."""
    values = picture.radiance[used]
    at = np.zeros(used.shape, bool)
    at[used] = clipped_in(values)
    return np.asarray(binary_dilation(at, np.ones((3, 3)))[used])


def _channels(colours: NDArray, least: int) -> int:
    """1 where (n, c) colours are grey and nothing else has more, else c."""
    return 1 if least == 1 and is_grey(colours) else colours.shape[1]


@dataclass(frozen=True)
class _Window(Pixels):
    """The pixels of a picture on a sensor's film."""

    start: tuple[float, float]  # of the picture's left top corner, in sizes of the sensor's crop
    share: tuple[float, float]  # of the crop that the picture covers, along u and v

    @staticmethod
    def of(picture: Picture, room: Room, sensor: int) -> _Window:
        chosen = pinhole(room, sensor)
        film = chosen.film()
        height, width = picture.inside.shape
        whole, crop, offset = (
            [int(side) for side in values]
            for values in (film.size(), film.crop_size(), film.crop_offset())
        )
        if [width, height] == crop or not _alike(whole, width, height):
            start, share = (0.0, 0.0), (1.0, 1.0)
            if not _alike(crop, width, height):
                raise ValueError(
                    f"{picture.name}: has {width} x {height} pixels; expected the shape of sensor "
                    f"{sensor} of {room.path}, {whole[0]} x {whole[1]}"
                )
        else:
            start = (-offset[0] / crop[0], -offset[1] / crop[1])
            share = (whole[0] / crop[0], whole[1] / crop[1])
        return _Window(chosen, width, height, 1 / height, start, share)

    def rays(self, pixel: Any, across: Any = 0.5, down: Any = 0.5) -> Any:
        row = pixel // self.width
        column = pixel - row * self.width
        u = self.start[0] + (mi.Float(column) + across) * (self.share[0] / self.width)
        v = self.start[1] + (mi.Float(row) + down) * (self.share[1] / self.height)
        ray, _ = self.sensor.sample_ray(0.0, 0.0, mi.Point2f(u, v), mi.Point2f(0.5))
        return ray


def _alike(size: Sequence[int], width: int, height: int) -> bool:
    """Whether width x height is a size scaled, to the nearest pixel."""
    return round(width * size[1] / size[0]) == height or round(height * size[0] / size[1]) == width
