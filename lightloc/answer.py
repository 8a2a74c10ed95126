"""The answer: how sure the lights are, what cannot be told, and why the search stopped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.certainty import Bound, bound_at, inseparable, resolution
from lightloc.extended import Extended, extended
from lightloc.fields import intensity_distance
from lightloc.ladder import Ladder
from lightloc.lights import PointLights
from lightloc.noise import level_of
from lightloc.observations import Observations
from lightloc.options import Options
from lightloc.result import Localization, Reason, Step
from lightloc.solve import Fit, Problem, amounts
from lightloc.verdicts import (
    DECISIVE,
    Kind,
    Verdict,
    clusters,
    hidden,
    mirrored,
    spread_out,
    too_few,
    uncertain,
    unexplained,
)

MARGIN = 3.0
"""Standard errors on top of B before D bounds an intensity: one in a thousand B is lower still."""


def answer(q: Observations, problem: Problem, fit: Fit, o: Options, ladder: Ladder) -> Localization:
    """How sure the lights are, what cannot be told, and why the search stopped."""
    view, count = ladder.view, len(fit)
    criterion = view.criterion
    wide = None if view.rough else extended(problem, fit, criterion, o.cluster)
    left = Fit(wide.points, wide.fit.residual, wide.fit.cost) if wide else fit
    peak = np.nan if view.rough else view.certificate(problem, left)[0]
    if wide is None:
        fit = Fit(fit.lights.brightest_first(), fit.residual, fit.cost)
        width = np.zeros(len(fit))
        wide = Extended(fit, width, bound_at(problem, fit.lights), fit.lights)
    fit, lights = wide.fit, wide.fit.lights
    level = max(1.0, level_of(fit.residual)) if len(lights) else 1.0
    verdicts = [
        *too_few(problem, lights),
        *mirrored(problem, lights, level, criterion, o),
        *hidden(view.dictionary, problem.geometry, problem.axes),
        *spread_out(wide.width),
    ]
    if not len(lights):
        few = any(verdict.kind is Kind.TOO_FEW for verdict in verdicts)
        reason = Reason.UNDECIDED if few else Reason.DARK
    elif not criterion.is_explained(problem, fit):
        reason = Reason.MOST_LIGHTS if count >= o.most_lights else Reason.NO_GAIN
        verdicts.insert(0, unexplained(fit, problem))
    else:
        reason = Reason.EXTENDED if wide.width.any() else Reason.CONVERGED
    found = localization(
        q,
        problem,
        fit,
        o,
        reason,
        ladder.history,
        bound=wide.bound,
        points=wide.points,
        resolution=np.where(wide.width > 0, np.nan, resolution(problem, lights)),
        width=wide.width,
        certificate=peak,
        verdicts=tuple(verdicts),
    )
    return judged(found, problem, o)


def judged(found: Localization, problem: Problem, o: Options) -> Localization:
    """The answer with the verdicts that follow from its errors, and undecided where they say so."""
    errors = Bound(found.position_error, found.intensity_error, found.covariance)
    others = [v for v in found.verdicts if v.kind not in (Kind.UNCERTAIN, Kind.CLUSTER)]
    verdicts = (
        *others,
        *uncertain(problem, found.lights, errors, o),
        *clusters(problem, found.resolution, found.inseparable, o),
    )
    reason = found.reason
    if reason in (Reason.CONVERGED, Reason.UNDECIDED) and len(found.lights):
        doubt = found.inseparable or any(verdict.kind in DECISIVE for verdict in verdicts)
        reason = Reason.UNDECIDED if doubt else Reason.CONVERGED
    return replace(found, verdicts=verdicts, reason=reason)


def localization(
    q: Observations,
    problem: Problem,
    fit: Fit,
    o: Options,
    reason: Reason,
    history: Sequence[Step],
    bound: Bound,
    points: PointLights | None = None,
    resolution: NDArray[np.float64] | None = None,
    width: NDArray[np.float64] | None = None,
    certificate: float = np.nan,
    verdicts: tuple[Verdict, ...] = (),
) -> Localization:
    """The answer in the form that both methods give it; ``points`` stand for wide lights."""
    lights = fit.lights
    top, _ = intensity_distance(q, lights.positions, problem.geometry, margin=MARGIN)
    ambient = np.zeros(q.channels)
    if problem.ambient is not None:
        lit = lights if points is None else points
        ambient = amounts(problem, lit.positions)[len(lit)]
    return Localization(
        lights=lights,
        position_error=bound.position,
        intensity_error=bound.intensity.reshape(len(lights), q.channels),
        covariance=bound.covariance,
        bound=top,
        residual=fit.residual,
        direct=q.radiance,
        sigma=problem.sigma,
        inseparable=inseparable(lights, bound.position),
        resolution=np.full(len(lights), np.nan) if resolution is None else resolution,
        width=np.zeros(len(lights)) if width is None else width,
        certificate=certificate,
        ambient=ambient,
        verdicts=verdicts,
        chi2=fit.cost / problem.rows,
        outliers=int((np.abs(fit.residual) > o.outlier).sum()),
        reason=reason,
        history=tuple(history),
    )
