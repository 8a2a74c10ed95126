"""Refine lights together: loosely while some are missing, then by the observations' own errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.deadline import is_over
from lightloc.fit import (
    AT_HAND,
    POLISH_FALL,
    Criterion,
    Descents,
    Fit,
    Problem,
    Unknown,
    descend,
    fit_of,
    residuals,
    robust,
)
from lightloc.search.moves import are_needed, without_one

QUICK = 12
"""Evaluations to judge a candidate."""

THOROUGH = (30, 60)
"""Evaluations to polish a hypothesis; the same in 64 bits, where 15 lights need it (measured)."""

DEEP, DEEP_FALL = 400, 1e-9
"""The same for the last polish: an exact answer's valleys are narrow."""

WORTH_DEPTH = 100.0
"""Losses so many times as wide as the narrowest are too far off for the last, deep descent."""

SHARPENINGS = 6
"""Times that the loss is narrowed, each time at least by half."""

HOPELESS = 4.0
"""Losses so many times as wide as the narrowest, that a descent did not halve: no outliers but
lights that are missing."""

TYPICAL = 0.8
"""Share of the residuals that the loss takes as they are while lights are missing."""

FRONT, NEAR_MISS = 3, 20.0
"""Hypotheses with a light less that are refined further; least gains that they may be behind."""


def polished(
    problem: Problem, starts: Descents, loss: float, steps: int, fall: float | None = None
) -> Descents:
    """Refine all starts at once, each nearly there: intensities are unknowns themselves."""
    return descend(
        problem,
        starts,
        steps=steps,
        loss=loss,
        fall=fall or POLISH_FALL[problem.surfels.double],
        unknown=Unknown.POSITIVE,
        damping=AT_HAND,
    )


def sharpened(
    problem: Problem,
    start: Descents,
    criterion: Criterion,
    deep: bool = True,
    patient: bool = True,
) -> Fit:
    """Refine one start with true shadows and a loss that flattens ever nearer; ``deep`` to the end.

    Shadows' edges leave a few observations on the wrong side: a loss wider than they are off
    would be led by them, one that is narrow from the start would be led by nothing. Who is not
    ``patient`` gives up where more than edges are wrong.
    """
    least, loss = criterion.likelihood.scale, np.inf
    steps = THOROUGH[problem.surfels.double]
    wide = spread_of(residuals(problem, start.lights), least)
    for _ in range(SHARPENINGS):
        if is_over():
            deep = False
            break
        loss = max(least, min(loss / 2, wide))
        start = polished(problem, start, loss, steps)
        if loss <= least or np.isinf(loss):
            break
        wide = spread_of(residuals(problem, start.lights), least)
        if not patient and wide > max(HOPELESS * least, loss / 2):
            deep = False
            break
    if deep and (loss < WORTH_DEPTH * least or np.isinf(loss)):
        start = polished(problem, start, least, DEEP, DEEP_FALL)
    return fit_of(problem, start.lights, least)


def pruned(problem: Problem, fit: Fit, criterion: Criterion) -> Fit:
    """Drop or join lights where that leaves the fit not significantly worse, the best first.

    Only hypotheses that a quick look brings near are refined further.
    """
    loss = criterion.likelihood.scale
    while len(fit) > 1 and not is_over():
        errors = criterion.errors([fit])
        own, now = replace(problem, sigma=problem.sigma * errors.level), Descents.at(fit.lights)
        if are_needed(own, now, loss):
            break
        near = robust(fit.residual / errors.level, loss) + NEAR_MISS * criterion.price(problem)
        tried = polished(own, without_one(own, now, loss), loss, QUICK)
        best = np.argsort(tried.chi2, kind="stable")[:FRONT]
        some = tried.rows(best[tried.chi2[best] < near])
        if not len(some):
            break
        fewer = criterion.best([sharpened(problem, one, criterion) for one in some.each()])
        if criterion.is_worth(problem, fewer, fit, errors):
            break
        fit = fewer
    return fit


def spread_of(z: NDArray[np.float64], least: float) -> float:
    """Where the loss begins to flatten while lights are missing: most residuals lie below it."""
    return max(least, float(np.quantile(np.abs(z), TYPICAL)))
