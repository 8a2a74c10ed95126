"""The published method, as published: sections 4.3 and 5 on one page.

A yardstick: no improvement of ours goes into it. Every parameter that the paper states has the
paper's value; where it is silent, the description in `Paper` says so and what was chosen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Reason
from lightloc.checks import number
from lightloc.fields import Field, Grid
from lightloc.fit import Descents, Problem, Unknown, descend, intensities
from lightloc.given import PointLights
from lightloc.optics import shading
from lightloc.paper.surface import Surface
from lightloc.paper.voting import DISCONTINUITY, LOWERING, MERGE, Votes, vote


@dataclass(frozen=True)
class Paper:
    """Parameters of the published method (sections 4 to 6).

    Where the paper is silent on a value, that is said here. The scene's radius is half the diagonal
    of the observations' bounding box.

    Parameters
    ----------
    cells : int
        Cells along the longest side in 2D (section 4.1).
    cells_3d : int
        The same in 3D, where the paper takes 512 (section 4.4), an hour a field.
    threshold : float
        T, as a share of the scene's radius (section 4.2).
    radius : int, optional
        Radius of the voting circle, cells; where None, 1 without noise and 15 with it (section
        6.1).
    height : float
        H, as a share of the number of observations (section 4.3).
    merge : float
        Share of the scene's radius within which peaks are one (section 4.3).
    increment : float
        How much brighter the hypotheses become in an iteration, W/sr (section 6.1). The paper's is
        for rooms of a metre or so: lengths in another unit need its square times as much.
    low_error : float, optional
        Mean squared error of B, (W sr^-1 m^-2)^2, at which the lights explain it. Where None,
        0.0025 without noise, and with it 105 % of what sigma leads one to expect of the true lights
        (section 6.1).
    lowering : float, optional
        Factor on H while there is no peak; silent. Where None, 0.5 without noise, and 0.9 with it,
        where too low an H lets spurious peaks in.
    association : float
        Share of the scene's radius: a candidate further from all hypotheses is a new one; silent.
    stray : float
        Share of the scene's radius that a light may move before the optimization is stopped early;
        silent on how far.
    steps : int
        Evaluations of Levenberg-Marquardt, at most; silent.
    damping : float
        Its first damping; silent. Random starts then succeed nearly as often as in the paper.
    most_lights : int
        Number of hypotheses at which the method gives up; silent.

    Raises
    ------
    ValueError
        If a value is none that the field can have.

    Examples
    --------
    >>> from lightloc import Paper
    >>> Paper().increment, Paper().height, Paper().threshold  # the paper's own
    (0.025, 0.1, 0.05)
    """

    cells: int = 256
    cells_3d: int = 64
    threshold: float = DISCONTINUITY
    radius: int | None = None
    height: float = 0.1
    merge: float = MERGE
    increment: float = 0.025
    low_error: float | None = None
    lowering: float | None = None
    association: float = 0.03
    stray: float = np.inf
    steps: int = 300
    damping: float = 1e-3
    most_lights: int = 30

    def __post_init__(self) -> None:
        for name in ("cells", "cells_3d", "steps", "most_lights"):
            number(f"Paper.{name}", getattr(self, name), 1, whole=True)
        shares = ("threshold", "height", "merge", "increment", "association", "stray")
        for name in (*shares, "damping"):
            number(f"Paper.{name}", getattr(self, name), above=True)
        for name in ("radius", "low_error", "lowering"):
            if getattr(self, name) is not None:
                number(f"Paper.{name}", getattr(self, name), above=True, whole=name == "radius")


RADIUS_OF_NOISE = (1, 15)  # pixels, without and with noise (section 6.1)
LOWERING_OF_NOISE = (0.5, LOWERING)
LOW_ERROR, OF_THE_TRUTH = 0.0025, 1.05  # section 6.1


@dataclass(frozen=True, eq=False)
class State:
    """What a step of the algorithm has come to: an optimization, or an iteration without one.

    Parameters
    ----------
    iteration
        Counts from 0; each brightens the hypotheses by one increment.
    hypotheses
        Where they are and how bright they have grown so far.
    unexplained : (n,) array
        B' of section 5.1.
    votes
        V(p) of B'.
    candidates : (m, 3) array
        Its peaks, in the unit of length.
    tried
        The lights of the optimization that a new candidate triggered; None without one.
    mse
        Mean squared error of B that ``tried`` leave.
    reason
        Why the algorithm ends here; None while it goes on.
    """

    iteration: int
    hypotheses: PointLights
    unexplained: NDArray[np.float64]
    votes: Votes | None
    candidates: NDArray[np.float64]
    tried: PointLights | None
    mse: float
    reason: Reason | None


def iterate(
    problem: Problem, surface: Surface, scene_radius: float, low_error: float, o: Paper
) -> Iterator[State]:
    """Section 5: discover, optimize, brighten, refine; until the lights explain B, or it fails.

    Parameters
    ----------
    problem
        B(q) of one channel, with the weights of the optimization.
    surface
        Distances between its observations, for the votes.
    scene_radius
        The scene's, in the unit of length.
    low_error
        The mean squared error of B at which the lights explain it.
    o
        The method's parameters.

    Yields
    ------
    State
        After each optimization, and after each iteration without one.
    """
    grid = grid_over(problem.bounds, o)
    field = Field.over(problem.surfels, grid, problem.geometry)
    B = np.maximum(problem.radiance[:, 0], 0)  # noise below zero is no light at all
    p, I = np.zeros((0, 3)), np.zeros(0)
    for iteration in range(MOST_ITERATIONS):
        left = B - rendered(problem, p) @ I
        if (left < 0).any():
            yield State(iteration, _lights(p, I), left, None, p[:0], None, np.inf, Reason.DARKER)
            return
        votes = votes_of(field, grid, left[:, None], surface, scene_radius, o)[0]
        candidates = peaks_of(votes, len(B), scene_radius, o)
        known = associate(candidates, p, o.association * scene_radius)
        seen = np.unique(known[known >= 0])
        here = State(iteration, _lights(p, I), left, votes, candidates, None, np.inf, None)
        if not len(candidates):
            yield replace(here, reason=Reason.NO_VOTES)
            return
        if (known >= 0).all():
            yield here
        for new in candidates[known < 0]:
            seen = np.append(seen, len(p))
            p, I = np.concatenate([p, new[None]]), np.append(I, 0.0)
            tried, mse = optimize(problem, p, grid, scene_radius, o)
            reason = Reason.CONVERGED if mse < low_error else None
            if reason is None and len(p) >= o.most_lights:
                reason = Reason.MOST_LIGHTS
            yield replace(here, hypotheses=_lights(p, I), tried=tried, mse=mse, reason=reason)
            if reason:
                return
        I[seen] += o.increment
        p = refined(problem, p, I, field, grid, surface, scene_radius, o)


MOST_ITERATIONS = 10_000
"""More increments than any light of section 6.1 is bright: B' has turned negative long before."""


def grid_over(bounds: NDArray[np.float64], o: Paper) -> Grid:
    """Square cells over (2, 3) bounds, `Paper.cells` of them along the longest side."""
    size = bounds[1] - bounds[0]
    cells = o.cells_3d if (size > 0).all() else o.cells
    shape = np.maximum(1, np.rint(cells * size / size.max())).astype(int)
    return Grid(bounds[0], bounds[1], (shape[0], shape[1], shape[2]))


def rendered(problem: Problem, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """S(q, p) at (k, 3) positions in the unit of length: (n, k), m^-2 sr^-1.

    All that "Render" of section 5 needs to know of the positions.
    """
    if not len(positions):
        return np.zeros((problem.radiance.size, 0))
    return shading(problem.surfels, positions, problem.geometry)[:, :, 0]


def votes_of(
    field: Field,
    grid: Grid,
    B: NDArray[np.float64],
    surface: Surface,
    scene_radius: float,
    o: Paper,
) -> list[Votes]:
    """V(p) of each of k radiances (n, k), which share S."""
    _, L = field.limits(np.maximum(B, 0))
    T = o.threshold * scene_radius
    return [vote(grid, limiters, surface, T, o.radius or 1) for limiters in L.T]


def peaks_of(votes: Votes, n: int, scene_radius: float, o: Paper) -> NDArray[np.float64]:
    """(m, 3) peaks of the votes of n observations, with H of that number (section 4.3)."""
    return votes.peaks(o.height * n, scene_radius, merge=o.merge, lowering=o.lowering or LOWERING)


def associate(
    candidates: NDArray[np.float64], hypotheses: NDArray[np.float64], reach: float
) -> NDArray[np.intp]:
    """(m,) the nearest hypothesis of each candidate, -1 where none lies within reach (5.1)."""
    if not len(hypotheses):
        return np.full(len(candidates), -1)
    apart = np.linalg.norm(candidates[:, None] - hypotheses, axis=2)
    return np.where(apart.min(axis=1) < reach, apart.argmin(axis=1), -1)


def optimize(
    problem: Problem, positions: NDArray[np.float64], grid: Grid, scene_radius: float, o: Paper
) -> tuple[PointLights, float]:
    """Section 5.2: intensities alone, which is linear, then Levenberg-Marquardt; with its MSE.

    From (k, 3) positions in the unit of length. Lights stay in the room, and intensities are of
    either sign. What comes out is read as lights: hypotheses that came together are one, and those
    of less than one increment are none; then the rest is optimized once more. The MSE is infinite
    where a light strayed, or none is left.
    """
    I = intensities(problem, positions)
    lit = I[:, 0] > 0
    if not lit.any():
        return _lights(positions[:0], I[:0, 0]), np.inf
    there = descend(
        problem,
        Descents.of(positions[None, lit], I[None, lit]),
        stray=o.stray * scene_radius,
        steps=o.steps,
        unknown=Unknown.FREE,
        damping=o.damping,
    )
    p, I, strayed = there.positions[0], there.intensities[0], bool(there.strayed[0])
    read_p, read_I = _read(p, I, grid, o)
    if len(read_p) < len(p) and len(read_p):
        there = descend(
            problem,
            Descents.of(read_p[None], read_I[None]),
            steps=o.steps,
            unknown=Unknown.FREE,
            damping=o.damping,
        )
        read_p, read_I = _read(there.positions[0], there.intensities[0], grid, o)
    if strayed or not len(read_p):
        return _lights(read_p, read_I[:, 0]), np.inf
    error = problem.radiance[:, 0] - rendered(problem, read_p) @ read_I[:, 0]
    return _lights(read_p, read_I[:, 0]), float(np.square(error).mean())


def _read(
    p: NDArray[np.float64], I: NDArray[np.float64], grid: Grid, o: Paper
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    bright = I[:, 0] > o.increment
    p, I = p[bright], I[bright]
    one = 2 * grid.step.max()
    kept_p, kept_I = np.zeros((0, 3)), np.zeros((0, 1))
    for light in np.argsort(-I[:, 0], kind="stable"):
        apart = np.linalg.norm(kept_p - p[light], axis=1)
        if len(apart) and apart.min() < one:
            kept_I[apart.argmin()] += I[light]
        else:
            kept_p = np.concatenate([kept_p, p[light, None]])
            kept_I = np.concatenate([kept_I, I[light, None]])
    return kept_p, kept_I


def refined(
    problem: Problem,
    p: NDArray[np.float64],
    I: NDArray[np.float64],
    field: Field,
    grid: Grid,
    surface: Surface,
    scene_radius: float,
    o: Paper,
) -> NDArray[np.float64]:
    """Section 5.3: each hypothesis moves to its candidate in the votes of B^i."""
    S = rendered(problem, p)
    alone = problem.radiance - (S @ I)[:, None] + S * I  # (n, k), B^i
    moved = p.copy()
    for i, votes in enumerate(votes_of(field, grid, alone, surface, scene_radius, o)):
        candidates = peaks_of(votes, len(S), scene_radius, o)
        apart = np.linalg.norm(candidates - p[i], axis=1)
        if len(apart) and apart.min() < o.association * scene_radius:
            moved[i] = candidates[apart.argmin()]
    return moved


def _lights(p: NDArray[np.float64], I: NDArray[np.float64]) -> PointLights:
    return PointLights(p, np.maximum(I, 0)[:, None])
