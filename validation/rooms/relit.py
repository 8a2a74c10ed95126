"""Standard rooms in three dimensions with random lights of their own."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import render
from lightloc import PointLights, shading

ROOMS: dict[str, tuple[str, dict[str, Any]]] = {
    "diffuse": ("box_three", {}),
    "occluders": ("box_occluder", {}),
    "furnished": ("furnished", {}),
    "mixed": ("box_mixed", {"alpha": 0.3}),
    "plastic_a1": ("box_plastic", {"alpha": 0.1}),
    "plastic_a3": ("box_plastic", {"alpha": 0.3}),
    "plastic_a6": ("box_plastic", {"alpha": 0.6}),
    "metal_a1": ("box_conductor", {"alpha": 0.1}),
    "metal_a3": ("box_conductor", {"alpha": 0.3}),
    "metal_a6": ("box_conductor", {"alpha": 0.6}),
}
MOST = 8  # lights, where a scene's number says how many, one after the other
BRIGHT = (8.0, 24.0)  # W/sr, as in the standard rooms
CLEARANCE = 0.1  # of the room's longest side, from surfaces and from each other
REACHED = 0.1  # share of some probes that a light must reach: none inside furniture does
SURFACE, PROBES = 60_000, 512  # points on all surfaces, 4 cm apart; probes
SEED = 2018


@cache
def lit(kind: str, number: int, count: int | None = None) -> render.Room:
    """A standard room with random lights of its own: ``count``, or as many as its number says.

    They keep `CLEARANCE` from all surfaces and each other, and none is inside anything.

    Examples
    --------
    >>> len(lit("diffuse", 1).lights), len(lit("diffuse", 1, count=3).lights)
    (2, 3)
    """
    name, parameters = ROOMS[kind]
    room = render.load(name, **parameters)
    count = count or number % MOST + 1
    rng = np.random.default_rng([SEED, list(ROOMS).index(kind), number])
    low, high = room.bounds
    apart = CLEARANCE * float((high - low).max())
    surface = cKDTree(_surface(room))
    probes = render.observe(room, points=PROBES, seed=SEED, transport="direct")
    places = np.zeros((0, 3))
    while len(places) < count:
        p = rng.uniform(low, high)
        if surface.query(p)[0] < apart or (np.linalg.norm(places - p, axis=1) < apart).any():
            continue
        if (shading(probes, p[None], room.geometry) > 0).mean() > REACHED:
            places = np.append(places, p[None], axis=0)
    return render.relight(room, PointLights(places, rng.uniform(*BRIGHT, count)))


def _surface(room: render.Room) -> NDArray[np.float64]:
    """Points on all surfaces by area, and all vertices."""
    vertices, faces = render.triangles(room)
    a, b, c = vertices[faces].swapaxes(0, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(SEED)
    which = rng.choice(len(faces), SURFACE, p=area / area.sum())
    u, v = rng.random((2, SURFACE, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    inside = a[which] + u * (b - a)[which] + v * (c - a)[which]
    return np.concatenate([vertices, inside])
