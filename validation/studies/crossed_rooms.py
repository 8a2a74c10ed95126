"""Rooms whose every factor is drawn by itself: none is multiplied with another, all are crossed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc import (
    BRDF,
    Conductor,
    Geometry,
    Lambert,
    Mixed,
    Observations,
    Plastic,
    PointLights,
)
from lightloc.backend import types
from validation.rooms import block_room, rooms, rooms_with_discs, under

SEED = 71_105
FLAT, SOLID = 600, 1500  # observations in two and in three dimensions
OFF_WALL = 1e-4  # of a 2D room's side: from where a point looks
LOBES: dict[str, BRDF] = {
    "diffuse": Lambert(albedo=0.5),
    "satin": Plastic(alpha=0.4, diffuse=0.5),
    "glossy": Plastic(alpha=0.15, diffuse=0.4),
    "metal": Conductor(alpha=0.3, specular=0.8),
}
FACTORS: dict[str, tuple[Any, ...]] = {
    "dimensions": (2, 3),
    "surface": tuple(LOBES),
    "occluders": (0, 1, 2, 3),
    "lights": (1, 2, 3, 4, 5, 6),
    "share": (0.0, 0.01, 0.02, 0.05, 0.1),
    "kind": ("random", "edges", "moved"),
}

Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Clean:
    """A room's observations without noise, its lights, and what occludes."""

    q: Observations
    lights: PointLights
    geometry: Geometry | None
    size: float  # the judge's: a 2D room's side, the diagonal in three dimensions


def drawn(number: int) -> dict[str, Any]:
    """The level of each factor of the room of that number.

    So many rooms in a row as a factor has levels hold each of them once, in a random order.

    Examples
    --------
    >>> sorted(drawn(number)["lights"] for number in range(6, 12))
    [1, 2, 3, 4, 5, 6]
    """
    levels = {}
    for i, (name, values) in enumerate(FACTORS.items()):
        turn, at = divmod(number, len(values))
        order = np.random.default_rng([SEED, i, turn]).permutation(len(values))
        levels[name] = values[order[at]]
    return levels


def clean(levels: dict[str, Any], rng: Rng) -> Clean:
    """A room of those levels."""
    make = flat if levels["dimensions"] == 2 else solid
    return make(levels["surface"], levels["occluders"], levels["lights"], rng)


def flat(surface: str, discs: int, lights: int, rng: Rng) -> Clean:
    """A 2D room with discs, seen from a place in it."""
    seed = int(rng.integers(2**31))
    (room,) = rooms_with_discs(discs, lights, 1, seed) if discs else rooms(lights, 1, seed)
    x, normals = room.outline.sample(FLAT)
    viewer = _viewer(room.outline, rng)
    f = types()
    ends = [f.Array3f(*(f.Float(a) for a in p.T)) for p in (x + OFF_WALL * normals, viewer[None])]
    seen = np.broadcast_to(np.array(room.outline.visible(*ends)), len(x))
    x, normals = x[seen], normals[seen]
    metal = (normals[:, 1] > 0.5).astype(int)  # the floor, and what of discs looks up
    lobe = LOBES[surface]
    material = Mixed((LOBES["diffuse"], lobe), metal) if surface == "metal" else lobe
    q = Observations(
        positions=x,
        normals=normals,
        directions=viewer - x,
        radiance=np.zeros(len(x)),
        sigma=0.0,
        material=material,
    )
    return Clean(under(q, room.lights, room.geometry), room.lights, room.geometry, 1.0)


def solid(surface: str, blocks: int, lights: int, rng: Rng) -> Clean:
    """A box with blocks in it; its floor and the blocks are of that surface."""
    room = block_room(blocks, lights, rng)
    lobe = LOBES[surface]
    q = room.seen(SOLID, (lobe, Lambert(0.7), Lambert(0.5), lobe), rng)
    if surface == "diffuse":  # one material with an albedo a point: kernels are fast
        albedo = np.array([0.5, 0.7, 0.5, 0.5])[q.regions][:, None]
        q = replace(q, material=Lambert(albedo))
    return Clean(q, room.lights, room.geometry, room.diagonal)


def _viewer(outline: Any, rng: Rng) -> NDArray[np.float64]:
    while True:
        p = np.append(rng.uniform(0.1, 0.9, 2), 0.0)
        if outline.inside(p[None])[0] and outline.clearance(p[None])[0] > 0.05:
            return p
