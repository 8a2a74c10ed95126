"""The end of a search through exact data: lights that leave nothing at all.

Twenty wrong lights can leave a ten millionth of B, which no assumed error tells from the right
ones; but without errors the right ones leave nothing. So lights are exchanged, one more and then
one fewer, for as long as what is left falls by a factor, until it is the arithmetic's own. What
never comes there changes nothing: B may have been computed in 32 bits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.deadline import is_over
from lightloc.fit import (
    NEARBY,
    Descents,
    Problem,
    descend,
    fit_of,
    level_of,
    residuals,
    robust,
)
from lightloc.search.births import places
from lightloc.search.dictionary import Dictionary
from lightloc.search.ladder import Ladder
from lightloc.search.moves import HOPELESS, are_needed
from lightloc.search.polish import DEEP_FALL, spread_of
from lightloc.search.view import Stage, View

NOTHING = 1e-5
"""Of the assumed errors, that half of the residuals lie below; right lights come to 1e-7."""

PLACES, TRIED = 4, 4
"""Places for a further light, and lights to be dropped, that are refined to their end."""

FALL = 0.5
"""Share of chi-square that an exchange leaves at most, and a light more."""

STARTS = 4
"""Counts of lights from which exchanges begin, those that leave least first, until one succeeds."""

FAINT = 0.01
"""Of the lights' mean: how bright a further one begins."""

LOOK, STEPS = 40, 200
"""Evaluations of a look at each light's absence, and of a refinement."""

EXCHANGE_FALL = 1e-5
"""Relative fall of chi-square that ends a refinement."""

STIFF = 0.1
"""First damping after a light is gone."""


def emptied(ladder: Ladder, whole: Problem) -> tuple[Ladder, Problem]:
    """The same with lights that leave nothing, and with errors that say so, if any are found."""
    view = ladder.view
    if level_of(ladder.best.residual) > HOPELESS:  # further lights only feed an error of the model
        return ladder, whole
    starts = [fit for fit in ladder.fits[1:] if level_of(fit.residual) < HOPELESS]
    for fit in sorted(starts, key=lambda fit: fit.cost)[:STARTS]:
        if is_over():
            return ladder, whole
        one = exchanged(view, Descents.at(fit.lights))
        if is_nothing(view, one):
            break
    else:
        return ladder, whole
    loss = view.criterion.likelihood.scale
    while one.positions.shape[1] > 1 and not are_needed(view.tight, one, loss):
        fewer = without_any(view, one, loss)
        if not is_nothing(view, fewer):
            break
        one = fewer
    if one.positions.shape[1] > view.most_lights:
        return ladder, whole
    view = replace(view, tight=surer(view.tight))
    fit = fit_of(view.tight, one.lights, loss)
    return replace(Ladder.on(view), history=ladder.history).with_("empty", fit), surer(whole)


def surer(problem: Problem) -> Problem:
    """The problem with standard errors at the arithmetic's own level, which exact data leave."""
    return replace(problem, sigma=problem.sigma * NOTHING)


def exchanged(view: View, one: Descents) -> Descents:
    """Lights exchanged until nothing is left, or for as long as that falls by a factor."""
    problem, least = view.tight, view.criterion.likelihood.scale
    one = descend(problem, one, loss=least, steps=STEPS, damping=NEARBY, fall=DEEP_FALL)
    if is_nothing(view, one):
        return one
    stage = Stage(problem, Dictionary.over(problem, view.dictionary.grid), 0.0, view.criterion)
    while not (is_nothing(view, one) or is_over()):
        z = residuals(problem, one.lights)
        loss = spread_of(z, least)
        found = places(stage, one, z, loss, PLACES)
        if not len(found):
            break
        most = FALL * robust(z, loss)
        more = descend(problem, with_faint(one, found), loss=loss, steps=STEPS, fall=EXCHANGE_FALL)
        more = more.rows(np.argsort(more.chi2, kind="stable"))
        best = next((up for up in more.each() if is_nothing(view, up)), None)
        if best is None:
            downs = (without_any(view, up, loss) for up in more.each())
            best = next((down for down in downs if down.chi2[0] < most), None)
        if best is None and one.positions.shape[1] < view.most_lights:
            best = next((up for up in more.each() if up.chi2[0] < most), None)
        if best is None:
            break
        one = best
    return one


def with_faint(one: Descents, found: NDArray[np.float64]) -> Descents:
    """One hypothesis with a faint light at each of the places."""
    m = len(found)
    p, I = (np.repeat(each, m, axis=0) for each in (one.positions, one.intensities))
    faint = FAINT * I.mean(axis=1, keepdims=True)
    return Descents.of(np.append(p, found[:, None], axis=1), np.append(I, faint, axis=1))


def without_any(view: View, one: Descents, loss: float) -> Descents:
    """The best with any one light dropped."""
    problem, p, I = view.tight, one.positions[0], one.intensities[0]
    rows = [(np.delete(p, i, 0), np.delete(I, i, 0)) for i in range(len(p))]
    positions, intensities = (np.stack(each) for each in zip(*rows, strict=True))
    starts = Descents.of(positions, intensities)
    tried = descend(problem, starts, loss=loss, steps=LOOK, damping=STIFF, fall=EXCHANGE_FALL)
    tried = tried.rows(np.argsort(tried.chi2, kind="stable")[:TRIED])
    tried = descend(problem, tried, loss=loss, steps=STEPS, damping=NEARBY, fall=EXCHANGE_FALL)
    return tried.rows(np.array([np.argmin(tried.chi2)]))


def is_nothing(view: View, one: Descents) -> bool:
    """Whether the arithmetic's own error is all that is left."""
    return level_of(residuals(view.tight, one.lights)) < NOTHING
