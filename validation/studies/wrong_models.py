"""Scenes whose model is wrong: what is observed and what is believed of the room differ.

Each maker returns the observations that the search is given: the radiance is of the true room,
points, normals and BRDF are what is believed of it. All carry noise of 1 %, and say so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc import Conductor, Observations, Options, Plastic, PointLights, radiance
from lightloc.fit import Criterion, Descents, Problem, working_sigma
from lightloc.search import sharpened
from validation.judge import compare
from validation.rooms import INTENSITIES, shot_noise
from validation.studies.scenes import FEW, ONE_PERCENT, parts, room_list
from validation.studies.trial import DIAGONAL, Trial, trial

ALBEDO = 0.1  # root mean square of its relative error
TILT = np.radians(5.0)  # of a normal
ALPHA, ALPHA_OFF = 0.3, 0.2  # roughness, and its relative error
REPLACED = 0.05  # of the observations, by outliers
DIAMETER, POINTS = 0.05, 16  # of a small area light: of the side, and points it is made of
WAVES = 3  # in a smooth error along a wall, each half a period longer than the one before
BOX_POINTS = 1500  # on the walls of a 3D box
VIEWER = np.array([0.45, 0.4, 0.55])  # where the box is seen from: no place of symmetry
BOX_CLEARANCE = 0.15  # of the side: a glossy wall has a narrow highlight of a light close to it
SEED = 2018

Rng = np.random.Generator
Scene = tuple[Observations, PointLights]


def believed_right(number: int, rng: Rng) -> Scene:
    """The control: nothing is wrong."""
    q, lights = _square(number)
    return _noisy(q, q.radiance, rng), lights


def albedo_by_wall(number: int, rng: Rng) -> Scene:
    """The true albedo varies smoothly along each wall; a constant is believed."""
    q, lights = _square(number)
    factor = np.ones(len(q))
    for wall in np.unique(q.normals.round(6), axis=0):
        on = np.flatnonzero(np.abs(q.normals - wall).max(axis=1) < 1e-5)
        factor[on] += ALBEDO * _smooth(len(on), rng)
    return _noisy(q, q.radiance * factor[:, None], rng), lights


def albedo_by_point(number: int, rng: Rng) -> Scene:
    """The true albedo differs from point to point; a constant is believed."""
    q, lights = _square(number)
    factor = np.maximum(1 + ALBEDO * rng.normal(size=q.radiance.shape), 0.0)
    return _noisy(q, q.radiance * factor, rng), lights


def normals_by_wall(number: int, rng: Rng) -> Scene:
    """The normals of each wall are believed to be 5 degrees off, to either side."""
    q, lights = _square(number)
    walls = np.unique(q.normals.round(6), axis=0, return_inverse=True)[1]
    angle = TILT * rng.choice([-1.0, 1.0], size=walls.max() + 1)[walls]
    return _noisy(_turned(q, angle), q.radiance, rng), lights


def normals_by_point(number: int, rng: Rng) -> Scene:
    """Each normal is believed to be off by a Gaussian of 5 degrees."""
    q, lights = _square(number)
    return _noisy(_turned(q, TILT * rng.normal(size=len(q))), q.radiance, rng), lights


def outliers(number: int, rng: Rng) -> Scene:
    """One observation in twenty has a radiance of anything up to the brightest."""
    q, lights = _square(number)
    q = _noisy(q, q.radiance, rng)
    B = q.radiance.copy()
    some = rng.permutation(len(q))[: round(REPLACED * len(q))]
    B[some] = rng.uniform(0, B.max(), B[some].shape)
    return q.with_radiance(B, _sigma(B, ONE_PERCENT)), lights


def area(number: int, rng: Rng) -> Scene:
    """Each light is a short segment of any direction; a point is believed."""
    q, lights = _square(number)
    angle = rng.uniform(0, np.pi, len(lights))
    along = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    at = DIAMETER * ((np.arange(POINTS) + 0.5) / POINTS - 0.5)
    spread = lights.positions[:, None] + at[:, None] * along[:, None]
    parts_of = np.repeat(lights.intensities / POINTS, POINTS, axis=0)
    B = radiance(q, PointLights(spread.reshape(-1, 3), parts_of))
    return _noisy(q, B, rng), lights


def alpha(number: int, rng: Rng) -> Scene:
    """A box of metal or plastic, whose roughness is believed to be 20 % more or less than it is."""
    believed = ALPHA * (1 + ALPHA_OFF * rng.choice([-1.0, 1.0]))
    materials = [
        Conductor(alpha=a) if number % 2 else Plastic(alpha=a, diffuse=0.5)
        for a in (ALPHA, believed)
    ]
    true, wrong = (_box(material, np.random.default_rng([SEED, number])) for material in materials)
    lights = _box_lights(FEW[number // 2 % len(FEW)], rng)
    return _noisy(wrong, radiance(true, lights), rng), lights


MODELS: Mapping[str, Callable[[int, Rng], Scene]] = {
    "right": believed_right,
    "albedo_by_wall": albedo_by_wall,
    "albedo_by_point": albedo_by_point,
    "normals_by_wall": normals_by_wall,
    "normals_by_point": normals_by_point,
    "alpha": alpha,
    "outliers": outliers,
    "area": area,
}


@dataclass(frozen=True)
class WrongTrial(Trial):
    """A trial whose model is wrong.

    ``displaced``: ghosts among the true lights after the search's own robust polish: what the
    wrong model moves out of the judge's radius even where the number is told.
    """

    displaced: int


def wrong(name: str) -> WrongTrial:
    """One scene of a wrong model: ``normals_by_wall-017``."""
    (model,), number = parts(name)
    rng = np.random.default_rng([SEED, number, list(MODELS).index(model)])
    q, lights = MODELS[model](number, rng)
    return WrongTrial(**vars(trial(name, q, lights)), displaced=displaced(q, lights))


def displaced(q: Observations, lights: PointLights) -> int:
    """How many of the true lights a fit that starts at them makes ghosts of."""
    o = Options()
    problem = Problem.of(q, working_sigma(q, o), None, q.bounds)
    there = sharpened(problem, Descents.at(lights), Criterion.of(o)).lights
    return len(compare(there, lights, DIAGONAL).ghosts)


def _square(number: int) -> Scene:
    """A room of section 6.1 without noise: two lights and three in turn."""
    room = room_list(0, FEW[number % len(FEW)])[number]
    return room.observe(), room.lights


def _noisy(q: Observations, B: NDArray[np.float64], rng: Rng) -> Observations:
    """q with the radiance B of another model, and noise of 1 %."""
    seen = np.maximum(B + ONE_PERCENT * np.sqrt(B * B.mean()) * rng.normal(size=B.shape), 0.0)
    return q.with_radiance(seen, _sigma(seen, ONE_PERCENT))


def _sigma(B: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """The standard error that the data state, from what is seen, as `PlaneRoom.observe` floors."""
    return shot_noise(B, share * float(np.sqrt(B.mean())))


def _smooth(n: int, rng: Rng) -> NDArray[np.float64]:
    """(n,) a smooth random curve of mean square 1 along n points."""
    s = (np.arange(n) + 0.5) / n
    waves = np.cos(np.pi * np.outer(s, np.arange(1, WAVES + 1)))
    curve = waves @ rng.normal(size=WAVES)
    return curve / np.sqrt(np.square(curve).mean())


def _turned(q: Observations, angle: NDArray[np.float64]) -> Observations:
    """The same observations with normals (and facets) turned in the plane by angles (n,)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = q.normals.T
    normals = np.stack([c * x - s * y, s * x + c * y, z], axis=1)
    return replace(q, normals=normals, facets=normals)


def _box(material: Conductor | Plastic, rng: Rng) -> Observations:
    """Random points on the walls of the unit cube, seen from within; dark."""
    x = rng.uniform(size=(BOX_POINTS, 3))
    axis, side = rng.integers(0, 3, BOX_POINTS), rng.integers(0, 2, BOX_POINTS)
    each = np.arange(BOX_POINTS)
    x[each, axis] = side
    normals = np.zeros_like(x)
    normals[each, axis] = 1.0 - 2.0 * side
    return Observations(
        positions=x,
        normals=normals,
        directions=VIEWER - x,
        radiance=np.zeros(BOX_POINTS),
        material=material,
    )


def _box_lights(count: int, rng: Rng) -> PointLights:
    """Lights in the unit cube, as in section 6.1, but further from walls and one another."""
    while True:
        p = rng.uniform(BOX_CLEARANCE, 1 - BOX_CLEARANCE, (count, 3))
        apart = np.linalg.norm(p[:, None] - p, axis=2) + np.eye(count)
        if apart.min() >= BOX_CLEARANCE:
            return PointLights(p, rng.uniform(*INTENSITIES, count))
