"""Standard rooms in three dimensions with random lights of their own, and what there is to know."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import render
from lightloc import Observations, Options, PointLights, shading
from lightloc.all_light import Split, newton, straight
from lightloc.noise import working_sigma
from lightloc.rounds import Indirect
from lightloc.solve import Problem
from validation.studies.ceiling import within
from validation.studies.trial import Tolerance

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
MOST = 8  # lights: a scene's number says how many, one after the other
BRIGHT = (8.0, 24.0)  # W/sr, as in the standard rooms
CLEARANCE = 0.1  # of the room's longest side, from surfaces and from each other
REACHED = 0.1  # share of some probes that a light must reach: none inside furniture does
SURFACE, PROBES = 60_000, 512  # points on all surfaces, 4 cm apart; probes
SEED = 2018


@cache
def lit(kind: str, number: int) -> render.Room:
    """A standard room with random lights of its own.

    They keep `CLEARANCE` from all surfaces and each other, and none is inside anything.
    """
    name, parameters = ROOMS[kind]
    room = render.load(name, **parameters)
    count = number % MOST + 1
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


def most(seen: Observations, room: render.Room, indirect: Indirect, off: Tolerance) -> float:
    """The probability of being solved for errors at the bound, with the rendering as it is.

    Both kinds of light tell, B has its error, and so has what is rendered at the true lights.
    """
    q = seen.with_radiance(seen.radiance, working_sigma(seen, Options()))
    problem = Problem.of(q, q.sigma, room.geometry, q.bounds)
    columns = indirect(room.lights.positions)
    split = Split(q, straight(problem, room.lights), *columns, Options().outlier)
    _, bound = newton(split, room.lights, problem)
    share = off.intensity / 100 * room.lights.intensities[:, 0]
    return within(bound.covariance, off.position * room.diagonal, share)
