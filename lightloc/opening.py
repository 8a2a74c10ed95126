"""The opening: several lights at once, more than needed and then fewer, as errors tighten.

Each stage widens the observations' errors and the edges of shadows, so that what one light does
is seen from afar. In it lights are born where the residual's gain peaks, several at once; all are
refined together; and then as many are dropped or joined as the stage's errors can't tell. After
each such round what was found is refined with the observations' own errors: it is enough as soon
as these are met.
"""

from __future__ import annotations

import numpy as np

from lightloc.births import born
from lightloc.ladder import Ladder
from lightloc.levenberg import FIRST_DAMPING, NEARBY, Descents
from lightloc.moves import without_one
from lightloc.polish import pruned, sharpened
from lightloc.view import Stage

STAGES = ((0.2, 0.01), (0.05, 0.005))
"""Errors, of B, and the width of shadows' edges, of the longest side. Edges three times as wide
hide a light 5 cm beside a surface of an 11 m room; hard ones hold lights where they were born."""

BIRTHS, MORE = 6, 4
"""Lights born at once, and how many more after a round in vain."""

VAIN, ROUNDS = 2, 12
"""Rounds of births in vain that end a stage; rounds at most."""

STEPS, SHORT = 30, 10
"""Evaluations of a refinement, and of a look at it."""

STIFF = 0.1
"""First damping after a light is gone: the others are to fill its place."""


def opened(ladder: Ladder) -> Ladder:
    """Open a search: through all stages, or until what is found is enough."""
    view = ladder.view
    if view.criterion.is_likely(view.tight, view.darkness):
        return ladder
    one = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, view.tight.radiance.shape[1])))
    rng = np.random.default_rng(0)
    for level, blur in STAGES:
        one, ladder = through(view.through(level, blur), one, rng, ladder)
        if ladder.ended or not one.positions.shape[1]:
            break
    return ladder


def told(ladder: Ladder, one: Descents) -> Ladder:
    """Refine a stage's hypothesis with the observations' own errors."""
    view = ladder.view
    fit = sharpened(view.tight, one, view.criterion, deep=False, patient=False)
    if view.criterion.is_explained(view.tight, fit):
        fit = pruned(view.tight, fit, view.criterion)
    return ladder.with_("open", fit)


def through(
    stage: Stage, one: Descents, rng: np.random.Generator, ladder: Ladder
) -> tuple[Descents, Ladder]:
    """One stage: the hypothesis that it comes to, and what its lights come to."""
    if one.positions.shape[1]:
        one = stage.descended(one, NEARBY, STEPS)
        ladder = told(ladder, one)
    vain = 0
    for _ in range(ROUNDS):
        full = one.positions.shape[1] >= stage.most_lights
        if ladder.ended or vain == VAIN or full or stage.explains(one):
            break
        loss = None if one.positions.shape[1] else np.inf  # at first all is a light's
        more = born(stage, one, loss, BIRTHS + MORE * vain, rng if vain else None)
        if more is None:
            break
        tried = stage.descended(more, FIRST_DAMPING, STEPS, loss)
        tried = fewer(stage, stage.descended(tried, NEARBY, STEPS // 2))
        if one.chi2[0] - tried.chi2[0] > stage.price(tried) / 2:
            one, vain = tried, 0
            ladder = told(ladder, one)
        else:
            vain += 1
    return one, ladder


def fewer(stage: Stage, one: Descents) -> Descents:
    """Drop or join lights while there are too many, or it costs less than a light must gain."""
    loss = stage.criterion.likelihood.scale
    while one.positions.shape[1] > 1:
        starts = without_one(stage.problem, one, loss, stage.blur)
        tried = stage.descended(starts, STIFF, SHORT)
        best = tried.rows(np.array([int(np.argmin(tried.chi2))]))
        few = one.positions.shape[1] <= stage.most_lights
        most = one.chi2[0] + stage.price(one) if few else np.inf
        if best.chi2[0] > most:
            best = stage.descended(best, NEARBY, STEPS)
        if best.chi2[0] > most:
            return one
        one = best
    return one
