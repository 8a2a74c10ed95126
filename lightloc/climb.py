"""The climb: one light more where it gains most, then those dropped that are not worth it."""

from __future__ import annotations

import numpy as np

from lightloc.candidates import Left
from lightloc.ladder import Ladder
from lightloc.levenberg import FIRST_DAMPING, Descents
from lightloc.lights import PointLights
from lightloc.moves import distinct, lights_of, start_at
from lightloc.polish import one_fewer, pruned, sharpened, spread_of
from lightloc.solve import fit_of, intensities
from lightloc.view import Stage

STAGE = (0.02, 0.005)
"""Errors, of B, and the width of shadows' edges, of the longest side, while lights are missing."""

NEAR = 4.0
"""Loss a residual, in these errors, from which the own ones are tried."""

CANDIDATES, FRONT = 4, 3
"""Places for a further light that are tried; hypotheses that are refined to their end."""

PATIENCE, ROUNDS = 2, 4
"""Lights that may be added in vain, beyond those of the best so far; rounds of adding and
dropping."""

QUICK, THOROUGH = 12, 30
"""Evaluations to judge a hypothesis, and to refine it."""


def climbed(ladder: Ladder) -> Ladder:
    """Add and drop lights for as long as that helps."""
    stage = ladder.view.through(*STAGE)
    for _ in range(ROUNDS):
        before = ladder.best
        ladder = grown(stage, ladder)
        if ladder.ended or not len(ladder.best):
            break
        fit = pruned(ladder.view.tight, ladder.best, ladder.view.criterion)
        if len(fit) < len(ladder.best):
            ladder = ladder.with_("drop", fit)
        if ladder.best is before:
            break
    return stepped_down(ladder)


def stepped_down(ladder: Ladder) -> Ladder:
    """Where lights only adapt to an error of the model: no more than explain.

    Nothing was added but in vain, so less of that tells than while lights are found. No rung below
    those that explain is left out: the step to them tells how many do.
    """
    view = ladder.view
    if view.criterion.is_clean(view.tight, ladder.best):
        return ladder
    ladder = ladder.judged(PATIENCE)
    while ladder.most == len(ladder.best) > 1 and ladder.rung(ladder.most - 1) is None:
        fit = one_fewer(view.tight, ladder.best, view.criterion)
        if fit is None:
            break
        ladder = ladder.with_("drop", fit, PATIENCE)
    return ladder


def grown(stage: Stage, ladder: Ladder) -> Ladder:
    """Add lights to the best, one by one, while there is a gain."""
    one, idle = start_at(ladder.best.lights), 0
    while one.positions.shape[1] < stage.most_lights and idle < PATIENCE and not ladder.ended:
        z = stage.residuals(one)
        loss = spread_of(z, stage.criterion.likelihood.scale)
        left = Left.robust(stage.problem, one.positions[0], z, loss)
        places = stage.dictionary.tops(stage.problem, left, CANDIDATES)
        if not len(places):
            break
        front = refined(stage, with_one(stage, one, places), loss)
        before, one = ladder.best, front.rows(np.array([0]))
        ladder = noted(stage, front, "add", ladder)
        idle = 0 if ladder.best is not before else idle + 1
    return ladder


def with_one(stage: Stage, one: Descents, places: np.ndarray) -> Descents:
    """One hypothesis with a light at each of the places, one a row; intensities solved linearly."""
    positions = np.stack([np.concatenate([one.positions[0], p[None]]) for p in places])
    lit = np.stack([intensities(stage.problem, p) for p in positions])
    return Descents.of(positions, lit)


def refined(stage: Stage, starts: Descents, loss: float) -> Descents:
    """The best of the starts, refined; the best first."""
    apart = float(np.linalg.norm(stage.dictionary.grid.step)) / 2
    tried = stage.descended(starts, FIRST_DAMPING, QUICK, loss)
    kept = distinct(tried, FRONT, apart)
    return distinct(stage.descended(kept, FIRST_DAMPING, THOROUGH, loss), FRONT, apart)


def noted(stage: Stage, front: Descents, action: str, ladder: Ladder) -> Ladder:
    """Judge hypotheses by the observations' own errors, and keep the best.

    Only where the wider errors are met already is it worth refining with the own ones.
    """
    tight, criterion, fits = ladder.view.tight, ladder.view.criterion, []
    for one in front.each():
        if one.chi2[0] < NEAR * stage.problem.rows:
            fits.append(sharpened(tight, one, criterion, deep=False, patient=False))
        else:
            fits.append(fit_of(tight, lights_of(one), criterion.likelihood.scale))
    return ladder.with_(action, criterion.best(fits))


def resumed(ladder: Ladder, lights: PointLights) -> Ladder:
    """Go on from lights: where they explain what is seen, they are not questioned further."""
    view = ladder.view
    fit = sharpened(view.tight, start_at(lights), view.criterion)
    if view.criterion.is_explained(view.tight, fit):
        return ladder.with_("start", fit)
    stage = view.through(*STAGE)
    return noted(
        stage, refined(stage, start_at(lights), stage.criterion.likelihood.scale), "start", ladder
    )
