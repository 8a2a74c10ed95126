"""Lights whose places are known: how strong they are, and whether that explains all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import (
    Kind,
    Localization,
    Reason,
    Step,
    Verdict,
    judged,
    localization,
    too_few,
    unexplained,
)
from lightloc.fit import Descents, Problem, errors_at, fit_of, intensities
from lightloc.given import Observations, Options
from lightloc.search.lawful import posed_by
from lightloc.search.polish import sharpened
from lightloc.search.settle import by_its_own
from lightloc.search.view import View

DARK = 2.0
"""Standard errors below which a lamp is not seen to shine."""


def strengths(
    q: Observations, view: View, whole: Problem, places: NDArray[np.float64], o: Options
) -> Localization:
    """The intensities of lights at (k, 3) places, of a problem in which they are held there."""
    criterion = view.criterion
    begun = Descents.of(places[None], intensities(whole, places)[None])
    fit = sharpened(whole, begun, criterion)
    if criterion.likelihood.lawful:
        whole = posed_by(fit, whole)
    fit, whole = by_its_own(whole, fit, criterion)
    fit = replace(fit, lights=fit.lights.brightest_first())
    explained, first = criterion.is_explained(whole, fit), fit
    if not explained:  # what is left is no noise, and the errors follow from it
        size = float(np.sqrt(np.square(fit.residual).mean()))
        whole = replace(whole, sigma=whole.sigma * max(1.0, size))
        fit = fit_of(whole, fit.lights, criterion.likelihood.scale)
    peak, where = view.certificate(whole, fit)
    errors = errors_at(criterion.trusted(whole, fit), fit.lights)
    verdicts, reason = too_few(whole, fit.lights), Reason.CONVERGED
    if not explained or peak**2 >= criterion.price(whole):
        reason = Reason.MISFIT
    if not explained and peak**2 < criterion.price(whole):
        verdicts.append(unexplained(first, first.problem, tried=len(fit)))
    elif reason is Reason.MISFIT:
        at = ", ".join(f"{x:.3g}" for x in where)
        said = (
            f"A further light would explain more, best at ({at}): is one missing, or not where it "
            "was said to be? The intensities are not to be used."
        )
        verdicts.append(Verdict(Kind.UNEXPLAINED, (), said))
    I = fit.lights.intensities
    dark = (DARK * errors.intensity.reshape(I.shape) > I).all(axis=1)
    for i in np.flatnonzero(dark) if reason is Reason.CONVERGED else ():
        verdicts.append(Verdict(Kind.UNLIT, (int(i),), f"Light {i + 1} is not seen to shine."))
    step = Step("intensities alone", len(fit), fit.cost / whole.rows)
    found = localization(
        q,
        whole,
        fit,
        o,
        reason,
        (step,),
        errors,
        certificate=peak,
        verdicts=tuple(verdicts),
    )
    return judged(found, whole, o)
