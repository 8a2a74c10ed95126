"""Observe a room by probes: points on its surfaces, and B(q) at each with its standard error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc import Mixed, Observations
from lightloc.brdf import SceneMaterial
from render.material import is_grey, material_at, regions_at
from render.room import Room, check_same_unit
from render.sampling import viewed_points
from render.sides import lit_from_behind
from render.transport import Transport, direct, indirect, known_light, probe, to_numpy


def observe(
    room: Room,
    *,
    points: int = 4096,
    spp: int = 256,
    seed: int = 0,
    transport: Transport = "full",
    noise: float = 0.0,
    shapes: Sequence[str] | None = None,
    watch: Callable[[float], None] = lambda share: None,
) -> Observations:
    """Sample points of the room's surfaces by area, and measure B(q) at each.

    Parameters
    ----------
    room : Room
        The room, lit by its own lights.
    points : int
        Number of observations.
    spp : int
        Path samples per point for the indirect part (``transport="full"``), at least 2.
    seed : int
        Seed of everything random here; same seed, same bytes, for any number of threads.
    transport : {"full", "direct"}
        "direct" is exact, light by light; "full" adds all interreflection.
    noise : float
        The k of section 6.1, at least 0 and below 1: Gaussian noise of standard deviation
        k sqrt(B mean(B)) is added. The paper has k sqrt(B); with the mean, what k means does not
        depend on the unit of radiance.
    shapes : sequence of str, optional
        Ids of the shapes to sample; all of them where None.
    watch : callable, optional
        Called with the share that is done, 0 to 1, while paths are traced.

    Returns
    -------
    Observations
        The n = ``points`` observations, with one channel where lights and BRDFs are grey; radiance
        and its standard error in W sr^-1 m^-2, positions in the scene's unit of length.

    Raises
    ------
    ValueError
        If an argument is out of range, a shape is unknown, too few points can be seen, or light
        falls on nothing but surfaces from behind, where they do not reflect.

    Examples
    --------
    What is seen of direct light is B = sum I S of Eq. 4:

    >>> import numpy as np
    >>> from lightloc import radiance
    >>> from render import load, observe
    >>> room = load("box_one")
    >>> q = observe(room, points=16, transport="direct")
    >>> bool(np.allclose(radiance(q, room.lights, room.geometry), q.radiance, rtol=1e-4))
    True
    """
    if points < 1 or spp < 2 or not 0 <= noise < 1 or transport not in ("direct", "full"):
        raise ValueError(
            "observe expects points >= 1, spp >= 2, 0 <= noise < 1 and transport 'direct' or "
            f"'full'; got {points}, {spp}, {noise:g}, '{transport}'"
        )
    x, w = viewed_points(room, points, np.random.default_rng(seed), shapes)
    si = probe(room.scene, x, w)
    B, sigma = _measured(room, si, x, w, spp, seed, transport, watch)
    q = observations(si, B, sigma, room, interreflected=transport == "full")
    if not B.any() and lit_from_behind(room, x, q.facets, np.random.default_rng(seed)):
        raise ValueError(
            f"{room.path}: light falls on surfaces from behind, where it reflects nothing, and "
            "nowhere else; turn their normals, or give them a twosided BSDF"
        )
    return add_noise(q, noise, seed) if noise else q


def remeasure(room: Room, q: Observations, *, spp: int = 256, seed: int = 0) -> Observations:
    """Measure B again, at the points and directions of ``q``, in a room that is lit otherwise.

    Parameters
    ----------
    room : Room
        The room, lit by its own lights.
    q : Observations
        Observations of the same surfaces.
    spp : int
        Path samples per point for the indirect part, where ``q`` holds interreflected light.
    seed : int
        Seed of those paths.

    Returns
    -------
    Observations
        The points of ``q`` with new radiance and its standard error, W sr^-1 m^-2. No noise is
        added, whatever ``q`` had.

    Raises
    ------
    ValueError
        If the lights have colours and ``q`` is grey, or ``q`` is in another unit of length.

    Examples
    --------
    Twice the light leaves twice the radiance:

    >>> import numpy as np
    >>> from lightloc import PointLights
    >>> from render import load, observe, relight, remeasure
    >>> room = load("box_one")
    >>> q = observe(room, points=16, transport="direct")
    >>> lights = PointLights(room.lights.positions, 2 * room.lights.intensities)
    >>> bool(np.allclose(remeasure(relight(room, lights), q).radiance, 2 * q.radiance))
    True
    """
    check_same_unit(room, q.unit, "these observations")
    x, w = q.positions, q.directions
    transport: Transport = "full" if q.interreflected else "direct"
    si = probe(room.scene, x, w)
    B, sigma = _measured(room, si, x, w, spp, seed, transport, max_depth=q.max_depth)
    if q.channels < 3 and not is_grey(B):
        raise ValueError("grey observations can't be measured again under coloured lights")
    measured = q.with_radiance(B[:, : q.channels], sigma[:, : q.channels])
    return replace(measured, saturated=np.zeros(len(q), bool), step=0.0)


def _measured(
    room: Room,
    si: Any,
    x: NDArray,
    w: NDArray,
    spp: int,
    seed: int,
    transport: Transport,
    watch: Callable[[float], None] = lambda share: None,
    max_depth: int | None = None,
) -> tuple[NDArray, NDArray]:
    """(n, 3) radiance of points x along w, by all light of a room, and its standard error."""
    B, sigma = direct(room.scene, si), np.zeros((len(x), 3))
    if transport == "full":
        more, sigma = indirect(room.scene, si, spp, seed, watch, max_depth)
        B = B + more
    if room.known is not None:
        more, error = known_light(room.known, x, w, spp, seed, transport, watch, max_depth)
        B, sigma = B + more, np.hypot(sigma, error)
    return B, sigma


def observations(
    si: Any, B: NDArray, sigma: NDArray, room: Room, interreflected: bool = False
) -> Observations:
    """Observations at n surface interactions, grey where lights and materials are.

    ``B`` and ``sigma`` are (n, 3), W sr^-1 m^-2.
    """
    if not np.array(si.is_valid()).all():
        raise ValueError(
            f"{room.path}: a ray misses the point that it was aimed at; the scene is too large "
            f"for its parts, {room.diagonal:.3g} across"
        )
    try:
        return _observations(si, B, sigma, room, interreflected)
    except ValueError as error:  # a value that Mitsuba takes, and makes others of
        raise ValueError(f"{room.path}: {error}") from None


def _observations(
    si: Any, B: NDArray, sigma: NDArray, room: Room, interreflected: bool
) -> Observations:
    material = material_at(si)
    regions, names = regions_at(si)
    if room.lights.channels == 1 and material.channels == 1 and (room.known is None or is_grey(B)):
        B, sigma = B[:, :1], sigma[:, :1]
    w = to_numpy(si.to_world(si.wi))

    def seen(n: NDArray) -> NDArray:
        return n * np.where((n * w).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)

    return Observations(
        positions=to_numpy(si.p),
        normals=seen(to_numpy(si.sh_frame.n)),
        facets=seen(to_numpy(si.n)),
        directions=w,
        radiance=B,
        sigma=sigma,
        material=material,
        interreflected=interreflected,
        regions=regions,
        region_names=names,
        unit=room.unit,
        intensity_unit=room.lights.intensity_unit,
    )


def add_noise(q: Observations, k: float, seed: int) -> Observations:
    """Gaussian shot noise with standard deviation k sqrt(B mean(B)), added to ``sigma``.

    A B that is below zero already gets none more.
    """
    B = np.maximum(q.radiance, 0)
    extra = k * np.sqrt(B * B.mean(axis=0))
    jitter = np.random.default_rng([seed, 1]).normal(size=q.radiance.shape)
    return q.with_radiance(q.radiance + extra * jitter, np.hypot(q.known_sigma, extra))


def attach(q: Observations, room: Room) -> Observations:
    """Give observations that were read from a file the BSDFs that only their scene has.

    Parameters
    ----------
    q : Observations
        From `lightloc.Observations.load`.
    room : Room
        The room that they were observed in.

    Returns
    -------
    Observations
        The same with the room's BRDFs, or as they are where their file had them all.

    Raises
    ------
    ValueError
        If they are known to be in another unit of length than the room.

    Examples
    --------
    A diffuse room's file has all of them:

    >>> from render import attach, load, observe
    >>> room = load("box_one")
    >>> q = observe(room, points=16, transport="direct")
    >>> attach(q, room) is q
    True
    """
    check_same_unit(room, q.unit, "these observations")
    parts = q.material.brdfs if isinstance(q.material, Mixed) else (q.material,)
    if not any(isinstance(part, SceneMaterial) for part in parts):
        return q
    return replace(q, material=material_at(probe(room.scene, q.positions, q.directions)))
