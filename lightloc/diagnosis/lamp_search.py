"""Lamps looked for where points do not explain: one more where it gains most, all then refined.

A narrow lamp looks like many points, none of them where it is; so the search begins anew, over a
grid of positions, axes and exponents.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.diagnosis.lamps import (
    EXPONENTS,
    Freedom,
    LampFit,
    Lamps,
    refined,
    seen_from,
    sharpened,
)
from lightloc.fit import Criterion, Problem, robust
from lightloc.optics import shading

SAMPLE = 400
"""Observations that a search looks at; what it found is refined over all."""

CELLS = 8
"""Positions of the grid along each axis."""

STARTS = (0.0, 1.0, 4.0, 15.0)
"""Exponents that are tried, 0 being a point's."""

ROUGH = 0.1, 0.4
"""Errors while lamps are missing: a share of B and of its mean."""

TRIED, KEPT = (1, 2), 2
"""Places for a further point and for a lamp of each exponent that are tried, and how many of all
are refined to their end."""

ALIKE = (1.0, 4.0)
"""Exponents that all lamps of a room are begun with together: mostly they are one product."""

UNKNOWN, PRICE = 5.0, 40.0
"""Chi-square that an axis or an exponent must gain, and a lamp, where all is explained then."""

LUCK = 2.0
"""Standard deviations of chi-square above its mean at which no better fit is looked for."""

MOST_LAMPS, VAIN = 4, 2
"""More are not told apart from an error of another kind; so many in a row that explain too little
end a search."""

LITTLE = 0.45
"""Share of the loss that each further lamp must not leave: less only feeds another error."""

QUICK, NARROWING = 8, (8, 8, 8, 8, 24)
"""Evaluations to judge a start, and to refine it at each width of the loss."""


def searched(problem: Problem, criterion: Criterion) -> LampFit:
    """The lamps that explain most, over all observations."""
    some = spread_over(problem, SAMPLE)
    small = problem if len(some) == len(problem.radiance) else problem.rows_of(some)
    scale = criterion.likelihood.scale
    enough = most_of(small, criterion)
    grid = Atoms.of(small)
    best = last = dark(small, scale)
    while len(last.lamps) < min(MOST_LAMPS, len(best.lamps) + VAIN) and last.cost >= enough:
        more = one_more(small, last, grid, scale, enough)
        if more is None:
            break
        last, added = more, len(more.lamps) - len(best.lamps)
        explains = added == 1 and last.cost < min(enough, best.cost - PRICE)
        if explains or last.cost < best.cost * LITTLE**added:
            best = last
    if len(best.lamps) > 1:
        tied = refit(small, all_of(best.lamps, float(np.median(best.lamps.exponents))), scale, True)
        best = min(best, tied, key=lambda one: one.cost + UNKNOWN * unknowns_of(one.lamps))
    if small is problem or not len(best.lamps):
        return best if small is problem else dark(problem, scale)
    return refit(problem, best.lamps, scale)


def most_of(problem: Problem, criterion: Criterion) -> float:
    """The loss that noise mostly leaves, at most."""
    typical = criterion.likelihood.typical + LUCK * np.sqrt(2 / problem.rows)
    return float(typical * problem.rows)


def spread_over(problem: Problem, most: int) -> NDArray[np.intp]:
    """So many of the observations, evenly by their index."""
    n = len(problem.radiance)
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(int))


def dark(problem: Problem, scale: float) -> LampFit:
    """No lamps."""
    z = problem.without_ambient(problem.radiance / problem.sigma)
    none = Lamps(np.zeros((0, 3)), problem.radiance[:0], np.zeros((0, 3)), np.zeros(0))
    return LampFit(none, z, robust(z, scale))


class Atoms:
    """Lamps of a grid of positions, axes and exponents, over a sample with rough errors."""

    def __init__(
        self, problem: Problem, positions: NDArray[np.float64], S: NDArray[np.float64]
    ) -> None:
        self.problem = problem
        self.positions, self.S = positions, S  # (p, 3), (n, p) over all channels' mean
        self.axes = directions(problem.axes)
        self.ways = np.asarray(seen_from(problem, positions)[0], np.float32)

    @staticmethod
    def of(problem: Problem) -> Atoms:
        low, high = problem.bounds
        sides = [
            low[a] + (high[a] - low[a]) * (np.arange(CELLS) + 0.5) / CELLS
            if a in problem.axes
            else low[a : a + 1]
            for a in range(3)
        ]
        places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
        S = shading(problem.surfels, places, problem.geometry).mean(axis=2)
        lit = S.any(axis=0)
        return Atoms(problem, places[lit], S[:, lit].astype(np.float32))

    def gains(
        self, left: NDArray[np.float64], sigma: NDArray[np.float64]
    ) -> Iterator[tuple[float, NDArray[np.float64], NDArray[np.float64]]]:
        """Gain, amount of each (p,) position with one axis and exponent, in turn."""
        S = self.S / sigma[:, None].astype(np.float32)
        z = (left / sigma).astype(np.float32)
        for axis in self.axes:
            t = np.maximum(self.ways @ axis.astype(np.float32), 0)
            g = t
            for m in STARTS:
                if m == 0:
                    s = S
                elif m == 1:
                    s = S * t
                else:
                    g = (t * t) ** 2 if m == 4 else g**4 / np.maximum(t, 1e-3)
                    s = S * g
                a, b = z @ s, np.einsum("np,np->p", s, s) + np.float32(1e-30)
                amount = np.maximum(a, 0) / b
                yield m, axis, np.stack([a * amount, amount])


def directions(axes: NDArray[np.intp]) -> NDArray[np.float64]:
    """The 26 directions to the neighbours in a cubic grid; 8 in the plane."""
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    held = [a for a in range(3) if a not in axes]
    steps = steps[steps.any(axis=1) & ~steps[:, held].any(axis=1)]
    return steps / np.linalg.norm(steps, axis=1, keepdims=True)


def one_more(
    problem: Problem, fit: LampFit, grid: Atoms, scale: float, enough: float
) -> LampFit | None:
    """The best with one lamp more, refined; the first that leaves no more than ``enough``.

    None where no lamp gains anything, or none would reach any observation.
    """
    B = np.maximum(problem.radiance, 0).mean(axis=1)
    if not len(grid.positions) or not B.any():
        return None
    sigma = ROUGH[0] * (B + ROUGH[1] * B.mean())
    left = (fit.residual * problem.sigma).mean(axis=1)
    tops = []
    for m, axis, (gain, amount) in grid.gains(left, sigma):
        best = int(np.argmax(gain))
        tops.append((float(gain[best]), m, axis, grid.positions[best], float(amount[best])))
    ranked = [top for top in sorted(tops, key=lambda top: -top[0]) if top[0] > 0]
    tops = [top for m in STARTS for top in [top for top in ranked if top[1] == m][: TRIED[m > 0]]]
    if not tops:
        return None
    tried = []
    for _, m, axis, place, amount in tops:
        lit = np.full((1, problem.radiance.shape[1]), amount)
        start = Lamps(
            np.concatenate([fit.lamps.positions, place[None]]),
            np.concatenate([fit.lamps.intensities, lit]),
            np.concatenate([fit.lamps.axes, axis[None]]),
            np.append(fit.lamps.exponents, m),
        )
        freedom = Freedom.of(start, len(problem.axes))
        wide = float(np.quantile(np.abs(fit.residual), 0.95))
        tried.append(refined(problem, start, freedom, max(scale, wide / 2), QUICK))
    tried = sorted(tried, key=lambda one: robust(one.residual, max(scale, 5.0)))[:KEPT]
    ends = []
    starts = [(one.lamps, False) for one in tried]
    if len(fit.lamps):
        starts += [(all_of(tried[0].lamps, m), True) for m in ALIKE]
    for start, alike in starts:
        ends.append(refit(problem, start, scale, alike))
        if ends[-1].cost < enough:
            break
    return min(ends, key=lambda one: one.cost + UNKNOWN * unknowns_of(one.lamps))


def refit(problem: Problem, start: Lamps, scale: float, alike: bool = False) -> LampFit:
    """A start, refined to its end; first with one exponent for all where they are ``alike``."""
    d = len(problem.axes)
    if alike:
        start = sharpened(problem, start, Freedom.of(start, d, alike=True), scale, NARROWING).lamps
    return sharpened(problem, start, Freedom.of(start, d), scale, NARROWING)


def all_of(lamps: Lamps, exponent: float) -> Lamps:
    """The same with one exponent for all."""
    return replace(lamps, exponents=np.full(len(lamps), max(exponent, EXPONENTS[0])))


def unknowns_of(lamps: Lamps) -> int:
    """Of their axes and exponents, in 3D."""
    return 3 * int((lamps.exponents > 0).sum())
