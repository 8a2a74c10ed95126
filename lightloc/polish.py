"""Refine lights together: loosely while some are missing, then by the observations' own errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from lightloc.levenberg import Descents, Unknown, descend
from lightloc.moves import along_errors, asides, deaths, lights_of, merges, start_at
from lightloc.noise import level_of
from lightloc.options import Options
from lightloc.solve import Fit, Problem, cauchy, fit_of, residuals, robust


def polished(
    problem: Problem, starts: Descents, loss: float, steps: int, blurs: Sequence[float], o: Options, near=False
) -> Descents:
    """Refine all starts at once, through edges of shadows that grow sharper."""
    for blur in blurs:
        starts = descend(
            problem,
            starts.positions,
            starts.intensities,
            steps=steps,
            loss=loss,
            blur=blur,
            fall=o.settled,
            unknown=Unknown.POSITIVE if near else Unknown.LOGARITHM, damping=1e-3 if near else 1.,
        )
    return starts


def sharpened(problem: Problem, start: Descents, o: Options, deep: bool = True, patient: bool = True) -> Fit:
    """Refine one start with true shadows and a loss that flattens ever nearer; ``deep`` to the end.

    Shadows' edges leave a few observations on the wrong side: a loss wider than they are off
    would be led by them, one that is narrow from the start would be led by nothing.
    """
    loss = np.inf
    for _ in range(o.sharpenings):
        z = residuals(problem, lights_of(start))
        loss = max(o.outlier, min(loss / 2, spread_of(z, o)))
        start = polished(problem, start, loss, o.thorough, (0.0,), o, True)
        if loss <= o.outlier or np.isinf(loss):
            break
        if not patient and spread_of(residuals(problem, lights_of(start)), o) > max(HOPELESS * o.outlier, loss / 2):
            return unmoved(problem, start, o)
    if deep and (loss < WORTH_DEPTH * o.outlier or np.isinf(loss)):
        start = descend(
            problem,
            start.positions,
            start.intensities,
            steps=o.deep,
            loss=o.outlier,
            fall=o.settled_deep,
            unknown=Unknown.POSITIVE, damping=1e-3,
        )
    return fit_of(problem, lights_of(start), o.outlier)


def unmoved(problem: Problem, start: Descents, o: Options) -> Fit:
    """A start as it is."""
    return fit_of(problem, lights_of(start), o.outlier)


def over_edges(problem: Problem, fit: Fit, o: Options) -> Fit:
    """Refine on from small steps aside, of one light at a time, while any of them leads lower.

    With true shadows chi-square jumps wherever an observation enters or leaves one, and a
    descent stops at the edge; a start beyond it may not.
    """
    rng = np.random.default_rng(0)
    reach = (o.asides[0] * problem.size, o.asides[1] * problem.size)
    vain = 0
    while len(fit) and vain < o.tries:
        here = start_at(fit.lights)
        starts = asides(problem, here, o.each_aside, reach, rng)
        together = along_errors(problem, fit.lights, 2 * o.each_aside, o.errors_aside, rng)
        starts = starts.with_(together)
        tried = polished(problem, starts, o.outlier, o.quick, (0.0,), o)
        lights = lights_of(tried.rows(np.array([int(np.argmin(tried.chi2))])))
        there = fit_of(problem, lights, o.outlier)
        gain, fit = fit.cost - there.cost, min(fit, there, key=lambda f: f.cost)
        vain = 0 if gain > o.worthwhile * max(1.0, fit.cost / problem.rows) else vain + 1
    return fit


HOPELESS = 4.0
WORTH_DEPTH = 100.0
"""Losses so many times as wide as the narrowest are too far off for the last, deep descent."""


def spread_of(z: NDArray, o: Options) -> float:
    """Where the loss begins to flatten while lights are missing: most residuals lie below it."""
    return max(o.outlier, float(np.quantile(np.abs(z), o.typical)))


def best_of(fits: Iterable[Fit], o: Options) -> Fit:
    """The fit of least cost at the level of noise that the best leaves."""
    fits = list(fits)
    level = noise_level(fits, o)
    return min(fits, key=lambda fit: cost_at(level, fit, o))


def noise_level(fits: Iterable[Fit], o: Options) -> float:
    """The least residuals of any fit, in standard errors, taken for noise; 1 where less."""
    least = min(level_of(fit.residual) for fit in fits)
    return max(1.0, least) if o.noise == "given" else max(np.finfo(float).tiny, least)


def cost_at(level: float, fit: Fit, o: Options) -> float:
    """Robust chi-square, standard errors being ``level`` times as large."""
    return robust(fit.residual / level, o.outlier)


def is_worth(problem: Problem, fewer: Fit, more: Fit, level: float, o: Options) -> bool:
    """Whether further lights gain what they must, and not on a handful of observations alone.

    A light can always explain as many observations as it has unknowns. Without those that gain
    most, half of the least gain must be left; so that no outlier is taken for a light.
    """
    lights = len(more) - len(fewer)
    price = lights * least_gain(problem, o)
    before, after = (cauchy(fit.residual / level, o.outlier) for fit in (fewer, more))
    gains = np.sort((before - after).ravel())
    unknowns = lights * (len(problem.axes) + problem.radiance.shape[1])
    return gains.sum() > price and gains[: max(0, len(gains) - unknowns)].sum() > price / 2


def chosen(problem: Problem, fits: Iterable[Fit], o: Options) -> Fit:
    """The fit whose lights are each worth their parameters."""
    fits = sorted(fits, key=len)
    level, best = noise_level(fits, o), fits[0]
    for fit in fits[1:]:
        if is_worth(problem, best, fit, level, o):
            best = fit
    return best


def least_gain(problem: Problem, o: Options) -> float:
    """Chi-square that a further light must gain, in units of the noise."""
    parameters = len(problem.axes) + problem.radiance.shape[1]
    return max(o.significant * parameters, o.shared * problem.rows)


def prune(problem: Problem, fit: Fit, o: Options) -> Fit:
    """Drop or join lights where that leaves the fit not significantly worse, the best first."""
    while len(fit) > 1:
        level, price = noise_level([fit], o), least_gain(problem, o)
        here = start_at(fit.lights)
        start = deaths(here).with_(merges(problem, here))
        tried = polished(problem, start, o.outlier * level, o.quick, (0.0,), o)
        best = np.argsort(tried.chi2, kind="stable")[: o.beam]
        near = tried.chi2[best] / level**2 < cost_at(level, fit, o) + o.promising * price
        fits = [sharpened(problem, one, o) for one in tried.rows(best[near]).each()]
        if not fits:
            return fit
        without = best_of(fits, o)
        if is_worth(problem, without, fit, level, o):
            return fit
        fit = without
    return fit


def is_explained(fit: Fit, problem: Problem, o: Options) -> bool:
    """Whether the residual is no more than noise: chi-square is about what that leads to expect."""
    spread = np.sqrt(2 / problem.rows)
    return core_cost(fit, o) < (o.slack + o.unlikely * spread) * problem.rows


def core_cost(fit: Fit, o: Options) -> float:
    """The robust chi-square without the few residuals that no noise explains.

    Where a shadow's edge is not quite where a ray test says it is, an observation on its wrong
    side is off by all of a light; one in two hundred is, in rooms that another renderer made.
    """
    z = np.sort(np.abs(fit.residual).ravel())[::-1]
    few = z[: round(FEW * z.size)]
    wild = few[few > o.outlier]
    return fit.cost - robust(wild, o.outlier)


FEW = 0.02
"""Of the residuals: so many may lie anywhere."""
