"""Refine lights together: loosely while some are missing, then by the observations' own errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from lightloc.levenberg import Descents, descend
from lightloc.moves import deaths, lights_of, start_at
from lightloc.noise import level_of
from lightloc.options import Options
from lightloc.solve import Fit, Problem, fit_of, residuals, robust


def polished(
    problem: Problem, starts: Descents, loss: float, steps: int, blurs: Sequence[float], o: Options
) -> Descents:
    """Refine all starts at once, through edges of shadows that grow sharper."""
    for blur in blurs:
        starts = descend(
            problem,
            starts.positions,
            starts.intensities,
            steps=steps,
            loss=loss,
            inside=True,
            blur=blur,
            fall=o.settled,
        )
    return starts


def sharpened(problem: Problem, start: Descents, o: Options) -> Fit:
    """Refine one start with true shadows and a loss that flattens ever nearer.

    Shadows' edges leave a few observations on the wrong side: a loss wider than they are off
    would be led by them, one that is narrow from the start would be led by nothing.
    """
    loss = np.inf
    for _ in range(o.sharpenings):
        z = residuals(problem, lights_of(start))
        loss = max(o.outlier, min(loss / 2, spread_of(z, o)))
        start = polished(problem, start, loss, o.thorough, (0.0,), o)
        if loss <= o.outlier or np.isinf(loss):
            break
    if loss < WORTH_DEPTH * o.outlier or np.isinf(loss):
        start = descend(
            problem,
            start.positions,
            start.intensities,
            steps=o.deep,
            loss=o.outlier,
            inside=True,
            fall=o.settled_deep,
        )
    return fit_of(problem, lights_of(start), o.outlier)


WORTH_DEPTH = 100.0
"""Losses so many times as wide as the narrowest are too far off for the last, deep descent."""


def spread_of(z: NDArray, o: Options) -> float:
    """Where the loss begins to flatten while lights are missing: most residuals lie below it."""
    return max(o.outlier, float(np.quantile(np.abs(z), o.typical)))


def best_of(fits: Iterable[Fit], o: Options, price: float = 0.0) -> Fit:
    """The fit of least cost at the level of noise that the best leaves, ``price`` a light."""
    fits = list(fits)
    level = noise_level(fits, o)
    return min(fits, key=lambda fit: cost_at(level, fit, o) + price * len(fit))


def noise_level(fits: Iterable[Fit], o: Options) -> float:
    """The least residuals of any fit, in standard errors, taken for noise; 1 where less."""
    least = min(level_of(fit.residual) for fit in fits)
    return max(1.0, least) if o.noise == "given" else max(np.finfo(float).tiny, least)


def cost_at(level: float, fit: Fit, o: Options) -> float:
    """Robust chi-square, standard errors being ``level`` times as large."""
    return robust(fit.residual / level, o.outlier)


def least_gain(problem: Problem, o: Options) -> float:
    """Chi-square that a further light must gain, in units of the noise."""
    parameters = len(problem.axes) + problem.radiance.shape[1]
    return max(o.significant * parameters, o.shared * problem.rows)


def prune(problem: Problem, fit: Fit, o: Options) -> Fit:
    """Drop lights without which the fit is not significantly worse, the least missed first."""
    while len(fit) > 1:
        level, price = noise_level([fit], o), least_gain(problem, o)
        most = cost_at(level, fit, o) + price
        start = deaths(start_at(fit.lights))
        tried = polished(problem, start, o.outlier * level, o.quick, (0.0,), o)
        near = tried.chi2 / level**2 < most + o.promising * price
        fits = [sharpened(problem, one, o) for one in tried.rows(np.flatnonzero(near)).each()]
        if not fits:
            return fit
        without = best_of(fits, o)
        if cost_at(level, without, o) > most:
            return fit
        fit = without
    return fit


def is_explained(fit: Fit, problem: Problem, o: Options) -> bool:
    """Whether the residual is no more than noise: chi-square is about what that leads to expect."""
    spread = np.sqrt(2 / problem.rows)
    return fit.cost < (o.slack + o.unlikely * spread) * problem.rows
