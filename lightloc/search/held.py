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
from lightloc.fit import Descents, Problem, errors_at, intensities
from lightloc.given import Observations, Options
from lightloc.search.lawful import posed_by
from lightloc.search.polish import sharpened
from lightloc.search.settle import by_its_own
from lightloc.search.view import View


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
    peak, where = view.certificate(whole, fit)
    verdicts, reason = too_few(whole, fit.lights), Reason.CONVERGED
    if not criterion.is_explained(whole, fit):
        reason = Reason.NO_GAIN
        verdicts.append(unexplained(fit, whole, tried=len(fit)))
    elif peak**2 >= criterion.price(whole):
        reason = Reason.NO_GAIN
        at = ", ".join(f"{x:.3g}" for x in where)
        said = f"A further light would explain more, best at ({at})."
        verdicts.append(Verdict(Kind.UNEXPLAINED, (), said))
    step = Step("intensities alone", len(fit), fit.cost / whole.rows)
    found = localization(
        q,
        whole,
        fit,
        o,
        reason,
        (step,),
        errors_at(criterion.trusted(whole, fit), fit.lights),
        certificate=peak,
        verdicts=tuple(verdicts),
    )
    return judged(found, whole, o)
