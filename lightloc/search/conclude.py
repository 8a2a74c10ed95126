"""The search's answer: how sure the lights are, what cannot be told, and why the search stopped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.answer import (
    Count,
    Kind,
    Localization,
    Reason,
    hidden,
    judged,
    localization,
    mirrored,
    spread_out,
    too_few,
    uncounted,
    unexplained,
)
from lightloc.deadline import is_over
from lightloc.fit import Fit, Problem, errors_at, fit_of, level_of, resolution, robust
from lightloc.given import Observations, Options, PointLights
from lightloc.search.ladder import Ladder
from lightloc.search.wide import Extended, extended


def concluded(
    q: Observations, problem: Problem, fit: Fit, o: Options, ladder: Ladder
) -> Localization:
    """What a ladder's best, polished over all observations, says of the lights."""
    view, count = ladder.view, len(fit)
    criterion = view.criterion
    brief = view.rough or is_over()
    wide = None if brief else extended(problem, fit, criterion, o.cluster)
    left = replace(wide.fit, lights=wide.points) if wide else fit
    peak = np.nan if brief else view.certificate(problem, left)[0]
    if wide is None:
        fit = replace(fit, lights=fit.lights.brightest_first())
        width = np.zeros(len(fit))
        errors = errors_at(criterion.trusted(problem, fit), fit.lights)
        wide = Extended(fit, width, errors, fit.lights)
    fit, lights = wide.fit, wide.fit.lights
    level = max(1.0, level_of(fit.residual)) if len(lights) else 1.0
    verdicts = [
        *too_few(problem, lights),
        *(() if is_over() else mirrored(problem, lights, level, criterion, o)),
        *hidden(view.dictionary.grid, view.dictionary.unseen, problem.geometry, problem.axes),
        *spread_out(wide.width, problem.unit),
    ]
    counts = tried(ladder, wide.points, count)
    few = any(verdict.kind is Kind.TOO_FEW for verdict in verdicts)
    if not len(lights) and few:
        reason = Reason.UNDECIDED
    elif not criterion.is_explained(problem, fit):
        reason = Reason.MOST_LIGHTS if count >= o.most_lights else Reason.NO_GAIN
        verdicts.insert(0, unexplained(fit, problem, tried=len(ladder.fits[-1])))
    elif not len(lights):
        reason = Reason.DARK
    else:
        reason = Reason.EXTENDED if wide.width.any() else Reason.CONVERGED
        verdicts += uncounted([len(one.lights) for one in counts if one.allowed])
    found = localization(
        q,
        problem,
        fit,
        o,
        reason,
        ladder.history,
        errors=wide.errors,
        points=wide.points,
        resolution=np.where(wide.width > 0, np.nan, resolution(problem, lights)),
        width=wide.width,
        certificate=peak,
        verdicts=tuple(verdicts),
        counts=counts,
    )
    return judged(found, problem, o)


def tried(ladder: Ladder, points: PointLights, claimed: int) -> tuple[Count, ...]:
    """The best of each count of point lights, with the answer's own points in their place.

    Not of counts whose last lights only fed an error of the model.
    """
    problem, criterion = ladder.view.tight, ladder.view.criterion
    own = fit_of(problem, points, criterion.likelihood.scale)
    others = [one for one in ladder.fits if len(one) != len(own)]
    same = [one for one in ladder.fits if len(one) == len(own)]
    every = sorted([*others, criterion.best([*same, own])], key=len)
    fits = [one for one in every if ladder.most is None or len(one) <= ladder.most]
    errors = criterion.errors(fits)
    level = 1.0 if criterion.likelihood.known else errors.level
    scale = criterion.likelihood.scale
    chi2 = [robust(one.residual / level, scale) / problem.rows for one in fits]
    lights = [points if len(one) == len(points) else one.lights for one in fits]
    likely = criterion.likely(problem, fits)
    possible = criterion.allowed(problem, fits, claimed)
    allowed = [len(one) in possible for one in fits]
    return tuple(Count(*each) for each in zip(lights, chi2, likely, allowed, strict=True))
