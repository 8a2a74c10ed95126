"""An answer, asked whether the model that it rests on is wrong, and in which way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import MARGIN, Departed, Kind, Localization, Reason, Step, Verdict, judged
from lightloc.diagnosis.choice import (
    Promise,
    attempts,
    best_of,
    grown,
    hope,
    is_explained,
    level,
    plain,
    promises,
    pruned,
    spread,
    total,
)
from lightloc.diagnosis.departure import Evidence, Maker
from lightloc.diagnosis.encoding import encodings
from lightloc.diagnosis.indirect import indirect
from lightloc.diagnosis.joint import Joint, covariance, fitted
from lightloc.diagnosis.material import materials
from lightloc.diagnosis.noise import WHITE, alike
from lightloc.diagnosis.normals import normals
from lightloc.diagnosis.outside import outside
from lightloc.fields import intensity_distance
from lightloc.fit import (
    Bound,
    Criterion,
    Problem,
    inseparable,
    is_exact,
    level_of,
    resolution,
)
from lightloc.given import Geometry, Observations, Options, PointLights
from lightloc.optics import reflected_ambient

SAMPLE = 1024
"""Observations that departures are asked of; what is told is then fitted to all."""

PART = 0.2
"""Share of what lights leave beyond noise that a kind must explain to be named beside the first."""

HALF = 0.5
"""Share that a departure must explain for lights to be claimed as they are beside it."""

SPREAD = 1.17
"""Standard error of a standard deviation that is estimated by the median, times sqrt(n) over it."""

MAKERS: tuple[Maker, ...] = (materials, encodings, indirect, outside, normals)
"""What departures there are, kind by kind."""


def diagnosed(
    found: Localization,
    q: Observations,
    geometry: Geometry | None,
    bounds: NDArray[np.float64],
    o: Options,
    criterion: Criterion,
    seed: int = 0,
) -> Localization:
    """The answer, or what is left of it where the model is wrong in a way that can be named.

    ``q`` are the observations that ``found`` is of, (2, 3) ``bounds`` the region.
    """
    right = found.reason in (Reason.CONVERGED, Reason.UNDECIDED)
    if not (right or found.reason in (Reason.NO_GAIN, Reason.MOST_LIGHTS)) or found.width.any():
        return found
    if any(v.kind is Kind.TOO_FEW for v in found.verdicts) or (is_exact(q) and right):
        return found
    whole = evidence_of(found, q, geometry, bounds, o, criterion)
    some = np.random.default_rng(seed).permutation(len(q))[:SAMPLE]
    evidence = whole if len(q) <= SAMPLE else whole.rows_of(np.sort(some))
    base = plain(evidence, found.lights)
    explained = is_explained(evidence, base)
    asked = promises(evidence, found.lights, MAKERS, far=not explained)
    if explained and not any(hope(evidence, one) < cost_of(evidence, base) for one in asked):
        return found
    verdict = weighed(evidence, base, found, asked, explained, o.most_lights)
    return found if verdict is None else told(found, whole, verdict, o)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a diagnosis came to.

    Parameters
    ----------
    evidence
        What it was asked of.
    best
        The fit that explains for the least; without a departure where none is worth its price.
    others
        The best fit with a departure of each kind, the best first, and the share that it explains.
    explained
        Whether the best leaves no more than noise.
    """

    evidence: Evidence
    best: Joint
    others: tuple[tuple[Joint, float], ...]
    explained: bool


def cost_of(evidence: Evidence, joint: Joint) -> float:
    """What lights leave and cost."""
    return joint.cost + len(joint.lights) * evidence.criterion.price(evidence.problem)


def weighed(
    evidence: Evidence,
    base: Joint,
    found: Localization,
    asked: Sequence[Promise],
    explained: bool,
    most: int,
) -> Diagnosis | None:
    """All departures with all counts of lights; None where nothing is worth its price."""
    every = list(asked)
    for count in found.counts:
        if len(count.lights) < len(found.lights):
            every += promises(evidence, count.lights, MAKERS)
    joints = [base, *attempts(evidence, every)]
    joints += spread(evidence, best_of(evidence, joints), every)
    best = best_of(evidence, joints)
    if best.departure is not None:
        best = pruned(evidence, grown(evidence, best, most))
    alone = base
    if best.departure is not None:
        alone = fitted(evidence, best.lights, None, np.zeros(0))
    excess = max(alone.cost - evidence.problem.rows, 1.0)
    if not is_explained(evidence, best) and alone.cost - best.cost < HALF * excess:
        best = base
    if best.departure is None and explained:
        return None
    others = first_of_each(evidence, [best, *joints])
    shares = [float(np.clip((alone.cost - one.cost) / excess, 0, 1)) for one in others]
    pairs = tuple(zip(others, shares, strict=True))
    return Diagnosis(evidence, best, pairs, is_explained(evidence, best))


def first_of_each(evidence: Evidence, joints: Sequence[Joint]) -> list[Joint]:
    """Of each kind of departure the fit that explains for the least, the best kind first."""
    noise, kinds = level(joints), dict[Kind, Joint]()
    for one in sorted(joints, key=lambda one: total(evidence, one, noise)):
        if one.departure:
            kinds.setdefault(one.departure.kind, one)
    return list(kinds.values())


def told(found: Localization, whole: Evidence, diagnosis: Diagnosis, o: Options) -> Localization:
    """The answer with what a diagnosis came to."""
    best, answer = diagnosis.best, found
    kept = [v for v in found.verdicts if v.kind is Kind.UNEXPLAINED and not diagnosis.explained]
    rest = [v for v in found.verdicts if v.kind is not Kind.UNEXPLAINED]
    if best.departure is None:
        here = plain(whole, found.lights)
        if alike(whole, here.residual) < WHITE:
            return louder(found, whole, here, o)
    else:
        best = on_all(whole, best)
        answer, rest = moved(found, whole, best, o), [v for v in rest if v.kind is Kind.HIDDEN]
    named = []
    for one, share in diagnosis.others:
        if one is diagnosis.best:
            named.append(said(whole, best, share, sure=diagnosis.explained))
        elif share > PART:
            named.append(said(diagnosis.evidence, one, share, sure=False))
    answer = replace(
        answer,
        verdicts=(*kept, *(verdict for verdict, _ in named), *rest),
        departures=tuple(departed for _, departed in named),
        reason=Reason.UNDECIDED if diagnosis.explained else found.reason,
    )
    return judged(answer, whole.problem, o)


def said(evidence: Evidence, joint: Joint, share: float, sure: bool) -> tuple[Verdict, Departed]:
    """A departure as a user reads it, and as values."""
    departure = joint.departure
    assert departure is not None
    spread, noise = covariance(evidence, joint), max(1.0, level_of(joint.residual))
    own = np.diag(spread)[len(spread) - len(joint.unknowns) :]
    errors = noise * np.sqrt(np.maximum(own, 0))
    first = "The model as given does not explain the data" if sure else "What is left is most like"
    sentence = (
        f"{first}: {departure.said(joint.unknowns, errors)}. With {len(joint.lights)} light(s) "
        f"that explains {100 * share:.0f} % of what they leave beyond noise; try {departure.trial}."
    )
    told = Departed(departure.kind, departure.name, joint.unknowns, errors, share)
    return Verdict(departure.kind, (), sentence), told


def on_all(whole: Evidence, joint: Joint) -> Joint:
    """A fit to a sample, fitted to all observations, the brightest light first."""
    assert joint.departure is not None
    order = np.argsort(-joint.lights.intensities.sum(axis=1), kind="stable")
    lights = PointLights(joint.lights.positions[order], joint.lights.intensities[order])
    lit, name = whole.lit(lights), joint.departure.name
    same = [one for maker in MAKERS for one in maker(lit) if one.name == name]
    if not same:
        return replace(joint, residual=plain(whole, lights).residual, lights=lights)
    u, starts = joint.departure.kept(joint.unknowns, order), same[0].starts(lit)
    return fitted(whole, lights, same[0], u if len(u) == starts.shape[1] else starts[0])


def moved(found: Localization, whole: Evidence, joint: Joint, o: Options) -> Localization:
    """The answer with the lights of a fit, and errors that know of its departure."""
    lights, problem = joint.lights, whole.problem
    k, c = lights.intensities.shape
    m, noise = k * (len(problem.axes) + c), max(1.0, level_of(joint.residual))
    spread = noise**2 * covariance(whole, joint)[:m, :m]
    errors = Bound.of(spread, problem.axes, k, c)
    top, _ = intensity_distance(whole.q, lights.positions, problem.geometry, MARGIN)
    chi2 = joint.cost / problem.rows
    return replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=spread,
        bound=top,
        residual=joint.residual,
        inseparable=inseparable(lights, errors.position),
        resolution=resolution(problem, lights),
        width=np.zeros(k),
        certificate=np.nan,
        chi2=chi2,
        history=(*found.history, Step("fit with what may be wrong", k, chi2)),
        noise=replace(found.noise, outliers=np.abs(joint.residual) > o.outlier),
    )


def louder(found: Localization, whole: Evidence, here: Joint, o: Options) -> Localization:
    """The answer with errors as large as what is left, which is alike at no neighbours."""
    noise = level_of(here.residual)
    error = SPREAD * noise / np.sqrt(whole.problem.rows)
    sentence = (
        f"What the lights leave looks like noise, but {noise:.3g} ± {error:.1g} times as large as "
        f'the standard errors say; try Options(noise="estimate").'
    )
    answer = replace(
        found,
        position_error=found.position_error * noise,
        intensity_error=found.intensity_error * noise,
        covariance=found.covariance * noise**2,
        reason=Reason.UNDECIDED,
        verdicts=(
            Verdict(Kind.NOISE, (), sentence),
            *(v for v in found.verdicts if v.kind is not Kind.UNEXPLAINED),
        ),
    )
    return judged(answer, whole.problem, o)


def evidence_of(
    found: Localization,
    q: Observations,
    geometry: Geometry | None,
    bounds: NDArray[np.float64],
    o: Options,
    criterion: Criterion,
) -> Evidence:
    """The observations that an answer is of, as they were used."""
    used = q.with_radiance(found.direct, found.sigma, interreflected=False)
    problem = Problem.of(used, found.sigma, geometry, bounds)
    if o.ambient:
        problem = replace(problem, ambient=reflected_ambient(problem.surfels, used.channels))
    return Evidence(used, problem, criterion)
