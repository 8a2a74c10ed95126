"""From a set of lights to others: one more, one less, one elsewhere, two for one, one for two.

Each move gives starts for a refinement, many at once, as a `Descents` that has not moved yet.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary, Left, atoms_at, caps, gains_of
from lightloc.certainty import covariance
from lightloc.grid import Grid
from lightloc.levenberg import Descents
from lightloc.lights import PointLights
from lightloc.solve import Problem, intensities, residuals, whitened

SPLIT = 0.03
"""Of the longest side: how far from a light its two halves start, along each axis."""

ZOOMS, ZOOM = 2, 5
"""Finer grids about a peak, so that a shadow's edge starts on its right side, and their cells along
each axis."""

MERGE = 0.2
"""Of the longest side: pairs nearer than this may be one light."""


def births(
    problem: Problem, dictionary: Dictionary, front: Descents, loss: float, most: int
) -> Descents:
    """Each hypothesis with one more light, at each of the ``most`` places where it gains most.

    Args:
        dictionary: over ``problem``.
        loss: standard errors beyond which residuals count less (Cauchy's).
    """
    starts = []
    for one in front.each():
        p, z = one.positions[0], residuals(problem, lights_of(one))
        left = Left.beside(whitened(problem, p), z, 1 / (1 + np.square(z / loss)))
        gains = dictionary.gains(left)
        for peak in dictionary.peaks(gains, most):
            at, reach = dictionary.points[peak], dictionary.grid.step
            at, _ = zoomed(problem, at, reach, left)
            starts.append(np.concatenate([p, at[None]]))
    return _lit(problem, starts, front)


def zoomed(
    problem: Problem,
    p: NDArray,
    reach: NDArray,
    left: Left,
) -> tuple[NDArray, float]:
    """The position of largest gain within ``reach`` of p, on grids that grow finer; its gain."""
    best = 0.0
    for _ in range(ZOOMS):
        points = Grid.around(p, reach, problem.bounds, ZOOM).points
        atoms = atoms_at(problem, points)
        gains = gains_of(atoms, np.square(atoms), caps(problem, atoms), left)
        p, reach, best = points[np.argmax(gains)], reach * 2 / ZOOM, float(gains.max())
    return p, best


def deaths(one: Descents) -> Descents:
    """One hypothesis without its first light, without its second, ..."""
    p, I = one.positions[0], one.intensities[0]
    rest = [np.delete(np.arange(len(p)), i) for i in range(len(p))]
    return Descents.of(p[rest], I[rest])


def merges(problem: Problem, one: Descents) -> Descents:
    """One hypothesis with two lights that are near each other as one, where they balance."""
    p, I = one.positions[0], one.intensities[0]
    power = I.mean(axis=1) + np.finfo(float).tiny
    starts = []
    for a in range(len(p)):
        for b in range(a + 1, len(p)):
            if np.linalg.norm(p[a] - p[b]) < MERGE * problem.size:
                middle = (power[a] * p[a] + power[b] * p[b]) / (power[a] + power[b])
                starts.append(np.concatenate([np.delete(p, [a, b], axis=0), middle[None]]))
    return _lit(problem, starts, one, -1)


def splits(problem: Problem, one: Descents) -> Descents:
    """One hypothesis with one light as two, side by side along each axis."""
    p = one.positions[0]
    starts = []
    for i in range(len(p)):
        for axis in problem.axes:
            step = np.zeros(3)
            step[axis] = SPLIT * problem.size
            pair = np.clip([p[i] - step, p[i] + step], *problem.bounds)
            starts.append(np.concatenate([np.delete(p, i, axis=0), pair]))
    return _lit(problem, starts, one)


def asides(
    problem: Problem, one: Descents, each: int, reach: tuple[float, float], rng: np.random.Generator
) -> Descents:
    """One hypothesis with one light aside, each light ``each`` times, within ``reach`` metres."""
    p, I = one.positions[0], one.intensities[0]
    m, axes = len(p) * each, problem.axes
    way = rng.normal(size=(m, len(axes)))
    least, most = np.log(reach)
    far = np.exp(rng.uniform(least, most, m))
    positions = np.tile(p, (m, 1, 1))
    light = np.repeat(np.arange(len(p)), each)
    step = way * (far / np.linalg.norm(way, axis=1))[:, None]
    positions[np.arange(m)[:, None], light[:, None], axes] += step
    return Descents.of(np.clip(positions, *problem.bounds), np.tile(I, (m, 1, 1)))


def along_errors(
    problem: Problem, lights: PointLights, most: int, times: float, rng: np.random.Generator
) -> Descents:
    """Lights moved together as their errors go together, by ``times`` the standard errors."""
    spread = covariance(problem, lights)
    if not np.isfinite(spread).all():
        return Descents.of(np.zeros((0, len(lights), 3)), np.zeros((0, *lights.intensities.shape)))
    values, ways = np.linalg.eigh(spread)
    steps = rng.normal(size=(most, len(values))) * np.sqrt(np.maximum(values, 0)) @ ways.T * times
    k, d = len(lights), len(problem.axes)
    positions = np.tile(lights.positions, (most, 1, 1))
    positions[:, :, problem.axes] += steps[:, : k * d].reshape(most, k, d)
    brighter = lights.intensities + steps[:, k * d :].reshape(most, k, -1)
    return Descents.of(np.clip(positions, *problem.bounds), np.maximum(brighter, 0))


def lights_of(one: Descents) -> PointLights:
    """The first hypothesis as lights."""
    return PointLights(one.positions[0], np.maximum(one.intensities[0], 0))


def start_at(lights: PointLights) -> Descents:
    """Lights as a hypothesis."""
    return Descents.of(lights.positions[None], lights.intensities[None])


def distinct(tried: Descents, most: int, apart: float) -> Descents:
    """The ``most`` best hypotheses, leaving out those that are the same lights again."""
    kept: list[int] = []
    for j in np.argsort(tried.chi2, kind="stable"):
        p = tried.positions[j]
        if all(_furthest(p, tried.positions[i]) > apart for i in kept):
            kept.append(int(j))
        if len(kept) == most:
            break
    return tried.rows(np.array(kept, int))


def _furthest(p: NDArray, other: NDArray) -> float:
    apart = np.linalg.norm(p[:, None] - other, axis=2)
    return float(apart.min(axis=1, initial=np.inf).max(initial=0.0))


def _lit(problem: Problem, starts: Sequence[NDArray], of: Descents, more: int = 1) -> Descents:
    """Starts with intensities solved linearly."""
    k, c = of.positions.shape[1] + more, problem.radiance.shape[1]
    lit = [intensities(problem, p) for p in starts]
    return Descents.of(np.reshape(starts, (-1, k, 3)), np.reshape(lit, (-1, k, c)))
