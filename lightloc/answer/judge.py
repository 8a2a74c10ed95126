"""The answer that both methods give, and the verdicts that follow from its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from lightloc.answer.basis import Assumption, Count, Noise, NoiseLaw
from lightloc.answer.result import Localization, Reason, Step
from lightloc.answer.verdicts import DECISIVE, Kind, Verdict, clusters, uncertain, unseen
from lightloc.fields import intensity_distance
from lightloc.fit import (
    RATHER,
    SPREAD,
    Bound,
    Fit,
    Law,
    Problem,
    amounts,
    inseparable,
    outside,
    working_sigma,
)
from lightloc.given import Limits, Observations, Options, PointLights

RARE = 0.00135
"""Chance that a Gaussian error exceeds `MARGIN`; of any error at all, where sigma is estimated."""

MUCH = 1.5
"""Chi-square per residual that is said of a search that was not finished."""

MARGIN = 3.0
"""Standard errors on top of B before D bounds an intensity: one in a thousand B is lower still."""


def judged(found: Localization, problem: Problem, o: Options) -> Localization:
    """The answer with the verdicts that follow from its errors, and undecided where they say so."""
    told = np.where(untold(found), 0.0, found.intensity_error)
    errors = Bound(found.position_error, told, found.covariance)
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
    errors: Bound,
    points: PointLights | None = None,
    resolution: NDArray[np.float64] | None = None,
    width: NDArray[np.float64] | None = None,
    certificate: float = np.nan,
    verdicts: tuple[Verdict, ...] = (),
    counts: tuple[Count, ...] = (),
) -> Localization:
    """The answer in the form that both methods give it; ``points`` stand for wide lights.

    Of k lights, ``resolution`` and ``width`` are (k,), in the unit of length; where None, the one
    was not asked and the other is 0.
    """
    lights = fit.lights
    top, _ = intensity_distance(
        q.with_radiance(q.radiance, problem.sigma) if o.noise != "given" or q.step else q,
        lights.positions,
        problem.geometry,
        margin=MARGIN if o.noise == "given" else float(norm.isf(RARE / len(q))),
    )
    ambient, nothing = np.zeros(q.channels), np.zeros(len(q), bool)
    if problem.ambient is not None:
        lit = lights if points is None else points
        ambient = amounts(problem, lit.positions)[len(lit)]
    assumed = {
        Assumption.ISOTROPIC: True,
        Assumption.MATERIALS: True,
        Assumption.NO_AMBIENT: problem.ambient is None,
        Assumption.ERRORS: o.noise == "given",
    }
    return Localization(
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity.reshape(len(lights), q.channels),
        covariance=errors.covariance,
        bound=top,
        residual=fit.residual,
        direct=q.radiance,
        sigma=problem.sigma,
        inseparable=inseparable(lights, errors.position),
        resolution=np.full(len(lights), np.nan) if resolution is None else resolution,
        width=np.zeros(len(lights)) if width is None else width,
        certificate=certificate,
        ambient=ambient,
        verdicts=verdicts,
        chi2=chi_square(problem, fit, o),
        reason=reason,
        history=tuple(history),
        noise=noise_of(q, problem, fit, o),
        limits=Limits(nothing, nothing),
        counts=counts,
        assumed=tuple(assumption for assumption, holds in assumed.items() if holds),
    )


def noise_of(q: Observations, problem: Problem, fit: Fit, o: Options) -> Noise:
    """What was taken for noise: of the errors' common factor, where it was estimated, how large."""
    if o.noise == "estimate":
        return noise_by(fit.law, fit.residual)
    law, scale, error = NoiseLaw.GIVEN, np.ones(q.channels), np.zeros(q.channels)
    if o.noise == "scaled":
        law, scale = NoiseLaw.SCALED, np.median(problem.sigma / working_sigma(q, o), axis=0)
        error = SPREAD * scale / np.sqrt(problem.rows)
    unknown = np.full((6, q.channels), np.nan)
    none = np.zeros(fit.residual.shape, bool)
    return Noise(law, scale, error, none, 0.0, *unknown).leaving(fit.residual)


def chi_square(problem: Problem, fit: Fit, o: Options) -> float:
    """Robust, per residual; where errors follow a law, of those that are no outliers by it."""
    if o.noise != "estimate":
        return fit.cost / problem.rows
    _, core = outside(fit.residual)
    z = fit.residual[(core > RATHER) & problem.radiance.any(axis=0)]
    return float(np.square(z).mean()) if z.size else np.nan


def noise_by(law: Law, residual: NDArray[np.float64]) -> Noise:
    """The noise of an estimated law, which leaves (n, c) residuals."""
    one, none = np.ones(residual.shape[1]), np.zeros(residual.shape, bool)
    variance, error = law.variance.T, law.error.T
    read, relative = np.sqrt(variance[[0, 2]])
    known = np.where(np.isfinite(error[[0, 2]]), error[[0, 2]], 0)
    half = np.sqrt(variance[[0, 2]] + known) - np.sqrt(variance[[0, 2]])
    half = np.where(np.isfinite(error[[0, 2]]), half, np.inf)
    terms = (read, variance[1], relative, half[0], error[1], half[1])
    return Noise(NoiseLaw.ESTIMATED, one, 0 * one, none, 0.0, *terms).leaving(residual)


def untold(found: Localization) -> NDArray[np.bool_]:
    """(k, c) intensities that nothing tells: no observation shows them, and none bounds them."""
    return np.asarray(np.isinf(found.intensity_error) & np.isinf(found.bound))


def with_unknowns(found: Localization) -> Localization:
    """The answer with NaN in place of intensities that nothing tells, and a verdict on them."""
    unknown = untold(found)
    if not unknown.any():
        return found

    every = np.asarray(unknown.all(axis=0))

    def without(lights: PointLights, which: NDArray[np.bool_]) -> PointLights:
        return PointLights(lights.positions, np.where(which, np.nan, lights.intensities))

    return replace(
        found,
        lights=without(found.lights, unknown),
        intensity_error=np.where(unknown, np.nan, found.intensity_error),
        counts=tuple(replace(count, lights=without(count.lights, every)) for count in found.counts),
        verdicts=(*found.verdicts, *unseen(unknown)),
    )


def hardly_gathered(found: Localization) -> Localization:
    """The answer with a verdict that footnote 1 did not apply, and nothing could render."""
    said = (
        "Footnote 1 does not apply here, and this geometry can't render interreflected light: the "
        "lights may be off by more than is stated."
    )
    verdict = Verdict(Kind.INDIRECT, tuple(range(len(found.lights))), said)
    reason = Reason.UNDECIDED if found.reason is Reason.CONVERGED else found.reason
    return replace(found, verdicts=(*found.verdicts, verdict), reason=reason)


def out_of_time(found: Localization) -> Localization:
    """The answer of a search that was not finished, which may claim nothing."""
    left = [v for v in found.verdicts if v.kind is Kind.UNEXPLAINED]
    verdicts = tuple(v for v in found.verdicts if v.kind not in (Kind.UNEXPLAINED, Kind.COUNT))
    if left:
        said = "The lights, their number and their errors may all change."
        if found.chi2 > MUCH:
            level = f"Chi-square is still {found.chi2:.3g} per residual, where noise alone leaves 1"
            said = f"{level}: {said[0].lower()}{said[1:]}"
        verdicts = (Verdict(Kind.UNEXPLAINED, (), said), *verdicts)
    return replace(found, reason=Reason.OUT_OF_TIME, verdicts=verdicts)


def at_border(
    found: Localization, sides: NDArray[np.bool_], bounds: NDArray[np.float64]
) -> Localization:
    """The answer with a verdict on lights at sides (2, 3) of the region's bounds (2, 3)."""
    names = [f"{sign}{axis}" for sign in "-+" for axis in "xyz"]
    which = ", ".join(name for name, met in zip(names, sides.ravel(), strict=True) if met)
    near = np.zeros(len(found.lights), bool)
    for side, axis in zip(*np.nonzero(sides), strict=True):
        off = np.abs(found.lights.positions[:, axis] - bounds[side, axis])
        near |= off <= off.min() + 1e-9 * np.ptp(bounds)
    said = (
        f"A light lies at the border of the region that was searched, towards {which}; it may be "
        "beyond: give wider bounds."
    )
    verdict = Verdict(Kind.BORDER, tuple(int(i) for i in np.flatnonzero(near)), said)
    reason = Reason.UNDECIDED if found.reason is Reason.CONVERGED else found.reason
    return replace(found, verdicts=(*found.verdicts, verdict), reason=reason)
