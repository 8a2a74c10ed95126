"""Observe a room by probes: points on its surfaces, and B(q) at each with its standard error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lightloc import Mixed, Observations
from lightloc.brdf import SceneMaterial
from render.material import material_at, regions_at
from render.room import Room
from render.sampling import viewed_points
from render.transport import direct, indirect, probe, to_numpy

Transport = Literal["direct", "full"]


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
    """Sample the room's surfaces by area and measure B(q) at each point.

    Parameters
    ----------
    points : int
        How many observations.
    spp : int
        Path samples per point for the indirect part (``transport="full"``).
    seed : int
        Of everything random here; same seed, same bytes, for any number of threads.
    transport : Transport
        "direct" is exact, light by light; "full" adds all interreflection.
    noise : float
        K of section 6.1: Gaussian noise of k sqrt(B mean(B)) on top (with mean(B) the
        unit, so that it does not depend on the unit of radiance).
    shapes : Sequence[str] | None
        Ids of the shapes to sample; all of them where None.
    watch : Callable[[float], None]
        Is told the share that is done, while paths are traced.

    Raises
    ------
    ValueError
        An argument is out of range, a shape is unknown, or no point can be seen.
    """
    if points < 1 or spp < 2 or not 0 <= noise < 1 or transport not in ("direct", "full"):
        raise ValueError(
            "observe expects points >= 1, spp >= 2, 0 <= noise < 1 and transport 'direct' or "
            f"'full'; got {points}, {spp}, {noise:g}, '{transport}'"
        )
    x, w = viewed_points(room, points, np.random.default_rng(seed), shapes)
    si = probe(room.scene, x, w)
    B, sigma = direct(room.scene, si), np.zeros((points, 3))
    if transport == "full":
        more, sigma = indirect(room.scene, si, spp, seed, watch)
        B = B + more
    q = observations(si, B, sigma, room, interreflected=transport == "full")
    return add_noise(q, noise, seed) if noise else q


def remeasure(room: Room, q: Observations, *, spp: int = 256, seed: int = 0) -> Observations:
    """B at the points and directions of ``q`` in a room that is lit otherwise, without noise.

    Raises ValueError where the lights have colours and ``q`` is grey.
    """
    if room.lights.channels > q.channels:
        raise ValueError("grey observations can't be measured again under coloured lights")
    si = probe(room.scene, q.positions, q.directions)
    B, sigma = direct(room.scene, si), np.zeros((len(q), 3))
    if q.interreflected:
        more, sigma = indirect(room.scene, si, spp, seed)
        B = B + more
    return q.with_radiance(B[:, : q.channels], sigma[:, : q.channels])


def observations(
    si: Any, B: NDArray, sigma: NDArray, room: Room, interreflected: bool = False
) -> Observations:
    """Observations at surface interactions, grey where lights and materials are."""
    material = material_at(si)
    regions, names = regions_at(si)
    if room.lights.channels == 1 and material.channels == 1:
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
    """Give observations read from a file the BSDFs that only their scene has."""
    parts = q.material.brdfs if isinstance(q.material, Mixed) else (q.material,)
    if not any(isinstance(part, SceneMaterial) for part in parts):
        return q
    return replace(q, material=material_at(probe(room.scene, q.positions, q.directions)))
