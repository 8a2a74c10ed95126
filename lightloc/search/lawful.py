"""Where nobody knows the noise: search on by the law of what is left, until that settles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.deadline import is_over
from lightloc.fit import Criterion, Descents, Fit, Problem, fit_of
from lightloc.search.climb import climbed
from lightloc.search.ladder import Ladder
from lightloc.search.polish import sharpened

TURNS = 5
"""Times that law and lights are found in turns."""

SETTLED = 0.05
"""Change of the logarithm of standard errors, in the median, that ends them."""


def by_law(ladder: Ladder) -> Ladder:
    """The ladder by standard errors that its likeliest fit leaves, and what they show on top."""
    for _ in range(TURNS):
        view, criterion = ladder.view, ladder.view.criterion
        level = np.broadcast_to(criterion.errors(ladder.fits).level, view.tight.sigma.shape)
        if np.median(np.abs(np.log(level))) < SETTLED or is_over():
            break
        tight = replace(view.tight, sigma=view.tight.sigma * level)
        view = replace(view, tight=tight, criterion=criterion.knowing())
        start = Ladder.on(view)
        fits = [by_own(fit, tight, criterion, len(ladder.best)) for fit in ladder.fits if len(fit)]
        ladder = replace(
            start, fits=(*start.fits, *fits), history=ladder.history, enough=False
        ).judged()
        if not ladder.enough:
            ladder = climbed(ladder)
    return ladder


def by_own(fit: Fit, tight: Problem, criterion: Criterion, best: int) -> Fit:
    """The fit by other standard errors: refined if its count is the best or next to it."""
    if abs(len(fit) - best) > 1:
        return fit_of(tight, fit.lights, criterion.likelihood.scale)
    return sharpened(
        tight, Descents.at(fit.lights), criterion, deep=len(fit) == best, patient=False
    )


def posed_by(fit: Fit, whole: Problem) -> Problem:
    """All observations with standard errors by the law of a fit to some of them."""
    there = fit_of(whole, fit.lights, np.inf)
    return replace(whole, sigma=whole.errors_by(fit.law, there.model))
