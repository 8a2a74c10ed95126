"""The climb: one light more where it gains most, for as long as that helps.

Errors and the edges of shadows are wide while lights are missing, so that what one light does is
seen from afar. What is found is then refined with the observations' own errors: it is enough as
soon as these are met and there is no place for another light.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.deadline import is_over
from lightloc.fit import FIRST_DAMPING, Descents, fit_of, intensities
from lightloc.given import PointLights
from lightloc.search.births import places
from lightloc.search.ladder import Ladder
from lightloc.search.moves import distinct
from lightloc.search.polish import sharpened, spread_of
from lightloc.search.view import Stage

STAGE = (0.02, 0.005)
"""Least errors (share of B), and width of shadows' edges (share of the longest side), while lights
are missing."""

NARROWED = 0.25
"""Share of a stage's errors that is left once they are met."""

NEAR = 4.0
"""Loss per residual, in these errors, from which the own ones are tried."""

CANDIDATES, FRONT = 4, 3
"""Places for a further light that are tried; hypotheses that are refined to their end."""

PATIENCE = (2, 4)
"""Lights that may be added in vain, beyond those of the best so far; the same in 64 bits, where
twenty lights need it (measured)."""

VAIN = 2
"""So many lights in vain show an error of the model, once a search has ended."""

MANY = 4
"""Lights with which it is asked whether they only adapt to an error of the model."""

QUICK, THOROUGH = 12, 30
"""Evaluations to judge a hypothesis, and to refine it."""


def climbed(ladder: Ladder) -> Ladder:
    """Add lights to the best, one by one, while there is a gain."""
    view = ladder.view
    level, stage = STAGE[0], view.through(*STAGE)
    one, idle = Descents.at(ladder.best.lights), 0
    patience = PATIENCE[view.tight.surfels.double]
    while one.positions.shape[1] < view.most_lights and idle < patience and not ladder.ended:
        if is_over():
            return ladder
        z = stage.residuals(one)
        loss = spread_of(z, view.criterion.likelihood.scale)
        found = places(stage, one, z, loss, CANDIDATES)
        if not len(found):
            break
        front = refined(stage, with_one(stage, one, found), loss)
        before, one = ladder.best, front.rows(np.array([0]))
        ladder = noted(stage, front, ladder)
        if one.chi2[0] < stage.problem.rows:
            level *= NARROWED
            stage = view.through(level, STAGE[1])
        idle = 0 if ladder.best is not before else idle + 1
        if len(before) < MANY <= len(ladder.best):
            ladder = replace(ladder, astray=view.astray(ladder.fits, ladder.best))
    return ladder if view.criterion.is_clean(view.tight, ladder.best) else ladder.judged(VAIN)


def with_one(stage: Stage, one: Descents, found: np.ndarray) -> Descents:
    """One hypothesis with a light at each of the places, a row each; intensities are linear."""
    positions = np.stack([np.concatenate([one.positions[0], p[None]]) for p in found])
    lit = np.stack([intensities(stage.problem, p) for p in positions])
    return Descents.of(positions, lit)


def refined(stage: Stage, starts: Descents, loss: float) -> Descents:
    """The best of the starts, refined; the best first."""
    apart = float(np.linalg.norm(stage.dictionary.grid.step)) / 2
    tried = stage.descended(starts, FIRST_DAMPING, QUICK, loss)
    kept = distinct(tried, FRONT, apart)
    return distinct(stage.descended(kept, FIRST_DAMPING, THOROUGH, loss), FRONT, apart)


def noted(stage: Stage, front: Descents, ladder: Ladder) -> Ladder:
    """Judge hypotheses by the observations' own errors, until one explains; keep the best.

    Only where the wider errors are met already is it worth refining with the own ones.
    """
    tight, criterion, fits = ladder.view.tight, ladder.view.criterion, []
    for one in front.each():
        if one.chi2[0] < NEAR * stage.problem.rows:
            fits.append(sharpened(tight, one, criterion, deep=False, patient=False))
        else:
            fits.append(fit_of(tight, one.lights, criterion.likelihood.scale))
        if criterion.is_explained(tight, fits[-1]):
            break
    return ladder.with_("add", criterion.best(fits))


def resumed(ladder: Ladder, lights: PointLights) -> Ladder:
    """Go on from lights: where they explain what is seen, they are not questioned further.

    Unless there is a place for another light: outliers may be what it lights.
    """
    view = ladder.view
    fit = sharpened(view.tight, Descents.at(lights), view.criterion)
    ladder = ladder.with_("start", fit)
    tight, criterion = view.tight, view.criterion
    if not criterion.is_explained(tight, ladder.best):
        return climbed(ladder)
    peak, _ = view.certificate(tight, ladder.best)
    return ladder if peak**2 < criterion.price(tight) else climbed(ladder)
