"""What a user would do instead: each rival takes the same data and returns lights.

None sees the truth but for the count, which ours and the grid do without; a rival that starts from
many places judges them by its own loss. What there was to choose for a rival was tried on five
rooms with two to four lights, other than those of the study, and the best was kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.optimize import nnls

import lightloc
from lightloc import Grid, Observations, Paper, PointLights, shading
from lightloc.fit import Descents, Problem, Unknown, descend, intensities
from render import Room, optimize

SEED = 2018
DARK = 0.3  # of the median standard error: none counts as smaller, for any rival
SAMPLE = 2048  # observations that the random starts look at, as many as Adam's
STARTS, AT_ONCE, STEPS = 100, 20, 100  # of Levenberg-Marquardt: as in section 6.1 of the paper
CELLS = 16**3  # of the fixed grid; 20^3 take three times as long
GRID_SAMPLE = 1024  # 2048 observations take three times as long and were not more often right
FAINT = 0.01  # of all cells together: a cluster below it is no light
DIM = 0.001  # of all cells together: a cell below it joins nothing; .003 and more split lights


@dataclass(frozen=True)
class Rival:
    """A way to find lights: (what is seen, the room's surfaces, how many lights) -> lights.

    ``counts`` is whether it needs to be told how many.
    """

    name: str
    title: str
    counts: bool
    solve: Callable[[Observations, Room, int], PointLights]


def ours(q: Observations, room: Room, count: int) -> PointLights:
    """`lightloc.localize` with its defaults."""
    return lightloc.localize(q, room.geometry).lights


def random_starts(q: Observations, room: Room, count: int) -> PointLights:
    """Levenberg-Marquardt from random places, the count known; the least chi-square wins.

    Places are uniform in the room's box, and first intensities the best for them. The descents
    share a sample of the observations, and the winner is polished on all. The solver is the
    published method's: lights stay in the box, and intensities are of either sign.
    """
    whole = _problem(q, room)
    some = _sampled(whole, SAMPLE)
    rng, (low, high) = np.random.default_rng([SEED, count]), room.bounds
    found: list[tuple[float, NDArray, NDArray]] = []
    for _ in range(STARTS // AT_ONCE):
        places = rng.uniform(low, high, (AT_ONCE, count, 3))
        first = np.stack([intensities(some, p) for p in places])
        there = descend(
            some,
            Descents.of(places, first),
            steps=STEPS,
            unknown=Unknown.FREE,
            damping=Paper.damping,
        )
        real = (there.intensities >= 0).all(axis=(1, 2)) & np.isfinite(there.chi2)
        chi2 = np.where(real, there.chi2, np.inf)  # a negative light is no answer
        found += zip(chi2, there.positions, there.intensities, strict=True)
    _, p, I = min(found, key=lambda start: start[0])
    there = descend(
        whole,
        Descents.of(p[None], I[None]),
        steps=STEPS,
        unknown=Unknown.FREE,
        damping=Paper.damping,
    )
    return PointLights(there.positions[0], np.maximum(there.intensities[0], 0.0))


def fixed_grid(q: Observations, room: Room, count: int) -> PointLights:
    """Non-negative least squares over a light in each cell of a grid, read as clusters of cells.

    A light lies at its cluster's centroid; intensities are solved for again from there, which
    was more often right than the sum over the cells.
    """
    problem = _problem(q, room)
    some = _sampled(problem, GRID_SAMPLE)
    grid = Grid.over(room.bounds, CELLS)
    S = shading(some.surfels, grid.points, room.geometry)
    channels = [
        nnls(
            S[:, :, min(c, S.shape[2] - 1)] / some.sigma[:, c, None],
            some.radiance[:, c] / some.sigma[:, c],
        )[0]
        for c in range(q.channels)
    ]
    places = clusters(grid, np.stack(channels, axis=1)).positions
    return PointLights(places, intensities(problem, places))


def clusters(grid: Grid, I: NDArray[np.float64]) -> PointLights:
    """The lights that (g, c) intensities of a grid's cells stand for.

    Cells that touch, if by a corner, are one light.

    Examples
    --------
    >>> grid = Grid([0, 0, 0], [4, 1, 1], (4, 1, 1))
    >>> clusters(grid, np.array([[0.0], [1.0], [3.0], [0.0]])).positions.tolist()
    [[2.25, 0.5, 0.5]]
    """
    bright = I.mean(axis=1)
    named, number = label((bright > DIM * bright.sum()).reshape(grid.shape), np.ones((3, 3, 3)))
    rows = [named.ravel() == i for i in range(1, number + 1)]
    rows = [cells for cells in rows if bright[cells].sum() >= FAINT * bright.sum()]
    return PointLights(
        np.array([bright[cells] @ grid.points[cells] / bright[cells].sum() for cells in rows]),
        np.array([I[cells].sum(axis=0) for cells in rows]).reshape(len(rows), I.shape[1]),
    )


def mitsuba_adam(q: Observations, room: Room, count: int) -> PointLights:
    """`render.descent.optimize`: Mitsuba's differentiable rendering and Adam, random starts."""
    return optimize(room, q, count).lights


RIVALS = (
    Rival("ours", "lightloc", False, ours),
    Rival("random", "Random starts, LM", True, random_starts),
    Rival("grid", "NNLS on a grid", False, fixed_grid),
    Rival("adam", "Mitsuba and Adam", True, mitsuba_adam),
)


def _problem(q: Observations, room: Room) -> Problem:
    """The least squares that the rivals minimize, weighted by the observations' own errors."""
    sigma = np.maximum(q.known_sigma, DARK * np.median(q.known_sigma, axis=0))
    if not sigma.all():  # exact: any weight will do
        sigma = np.broadcast_to(np.maximum(q.radiance.mean(axis=0), 1e-30), sigma.shape)
    return Problem.of(q, sigma, room.geometry, room.bounds)


def _sampled(problem: Problem, most: int) -> Problem:
    order = np.random.default_rng(SEED).permutation(len(problem.radiance))
    return problem.rows_of(np.sort(order[:most]))
