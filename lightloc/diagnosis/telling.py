"""What a diagnosis came to, as an answer: lights, errors, verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightloc.answer import (
    MARGIN,
    Departed,
    Kind,
    Localization,
    NoiseLaw,
    Reason,
    Step,
    Verdict,
    judged,
    noise_by,
    unexplained,
)
from lightloc.diagnosis.choice import is_explained, plain
from lightloc.diagnosis.departure import Evidence, Maker
from lightloc.diagnosis.doubt import MANY, doubtful
from lightloc.diagnosis.joint import Joint, covariance, fitted, lost
from lightloc.diagnosis.kinds import MAKERS
from lightloc.diagnosis.wide import PANELS, panels_of
from lightloc.fields import intensity_distance
from lightloc.fit import (
    SPREAD,
    Bound,
    Fit,
    correlation,
    inseparable,
    law_left,
    level_of,
    resolution,
)
from lightloc.given import Options, PointLights

PART = 0.2
"""Share of what lights leave beyond noise that a kind must explain to be named beside the first;
where that explains all, all."""

FALL = 1e-6
"""Share of chi-square by which a step must lower it for another, where all observations are fitted.
"""

LOUDER = 1.5
"""Chi-square per residual that is noise still where the errors are larger than was said: they need
not all be so by one factor."""


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


def told(found: Localization, whole: Evidence, diagnosis: Diagnosis, o: Options) -> Localization:
    """The answer with what a diagnosis came to."""
    best, answer, explained = diagnosis.best, found, diagnosis.explained
    rest = [v for v in found.verdicts if v.kind is not Kind.UNEXPLAINED]
    if best.departure is None:
        here = plain(whole, found.lights)
        if is_louder(whole, here):
            return louder(found, whole, here, o)
    else:
        best = on_all(whole, best)
        if best.departure is None:
            return found  # it was a few of the observations that were asked
        explained = explained and is_explained(whole, best)
        if explained and found.noise.law is NoiseLaw.ESTIMATED:
            found, whole, best = lawful(found, whole, best)
        answer, rest = moved(found, whole, best, o), [v for v in rest if v.kind is Kind.HIDDEN]
    kept = [v for v in found.verdicts if v.kind is Kind.UNEXPLAINED and not explained]
    if not (explained or kept):
        fit = Fit(best.lights, best.residual, best.cost, whole.problem)
        kept = [unexplained(fit, whole.problem, tried=len(found.counts))]
    left = Reason.NO_GAIN if best.departure else found.reason
    right = Reason.EXTENDED if answer.width.any() else Reason.UNDECIDED
    named = []
    for one, share in diagnosis.others:
        if one is diagnosis.best:
            named.append(said(whole, best, share, sure=explained))
        elif share > PART and (not explained or is_explained(diagnosis.evidence, one)):
            named.append(said(diagnosis.evidence, one, share, sure=False))
    answer = replace(
        answer,
        verdicts=(*kept, *(verdict for verdict, _ in named), *rest),
        departures=tuple(departed for _, departed in named),
        reason=right if explained else left,
    )
    return judged(answer, whole.problem, o)


def remarked(found: Localization, diagnosis: Diagnosis) -> Localization:
    """The answer with what explains better, if anything, its lights and its reason as they are."""
    if diagnosis.best.departure is None or found.departures:
        return found
    share = next(share for one, share in diagnosis.others if one is diagnosis.best)
    verdict, departed = said(diagnosis.evidence, diagnosis.best, share, sure=False)
    return replace(found, verdicts=(*found.verdicts, verdict), departures=(departed,))


def said(evidence: Evidence, joint: Joint, share: float, sure: bool) -> tuple[Verdict, Departed]:
    """A departure as a user reads it, and as values."""
    departure = joint.departure
    assert departure is not None
    spread, noise = covariance(evidence, joint), max(1.0, level_of(joint.residual))
    own = np.diag(spread)[len(spread) - len(joint.unknowns) :]
    errors = noise * np.sqrt(np.maximum(own, 0))
    count = len(joint.lights)
    lights = f"{count} light{'s' * (count != 1)}"
    first = "The model as given does not explain the data" if sure else "What is left is most like"
    sentence = (
        f"{first}: {departure.said(joint.unknowns, errors)}. With {lights}, "
        f"this explains {100 * share:.0f} % of what is left beyond noise; try {departure.trial}."
    )
    told = Departed(departure.kind, departure.name, joint.unknowns, errors, share, sentence)
    return Verdict(departure.kind, (), sentence), told


def on_all(whole: Evidence, joint: Joint, makers: Sequence[Maker] = MAKERS) -> Joint:
    """A fit to a sample, fitted to all observations, the brightest light first."""
    assert joint.departure is not None
    order = np.argsort(-joint.lights.intensities.sum(axis=1), kind="stable")
    lights = PointLights(joint.lights.positions[order], joint.lights.intensities[order])
    lit, name = whole.lit(lights), joint.departure.name
    same = [one for maker in makers for one in maker(lit) if one.name == name]
    if name == PANELS:
        same = [panels_of(lit)]
    if not same:
        return plain(whole, lights)
    u, starts = joint.departure.kept(joint.unknowns, order), same[0].starts(lit)
    u = u if len(u) == starts.shape[1] else starts[0]
    return fitted(whole, lights, same[0], u, fall=FALL)


def lawful(
    found: Localization, whole: Evidence, joint: Joint
) -> tuple[Localization, Evidence, Joint]:
    """An answer, its evidence and a fit, with errors by the law of what that leaves."""
    assert joint.departure is not None
    problem, aside = whole.problem, joint.departure.aside
    off = joint.residual * problem.sigma
    model, used = problem.radiance - off, slice(None) if aside is None else ~aside
    law = law_left(off[used], model[used], joint.lights.positions.size + len(joint.unknowns))
    evidence = replace(whole, problem=replace(problem, sigma=problem.errors_by(law, model)))
    best = fitted(evidence, joint.lights, joint.departure, joint.unknowns, fall=FALL)
    return replace(found, noise=noise_by(law, best.residual)), evidence, best


def moved(found: Localization, whole: Evidence, joint: Joint, o: Options) -> Localization:
    """The answer with the lights of a fit, and errors that know of its departure."""
    lights, problem = joint.lights, whole.problem
    k, c = lights.intensities.shape
    m, noise = k * (len(problem.axes) + c), max(1.0, level_of(joint.residual))
    assert joint.departure is not None
    residual, aside = joint.residual, joint.departure.aside
    if aside is not None:
        residual = np.where(aside[:, None], plain(whole, lights).residual, residual)
    left = found.noise.leaving(residual)
    if is_explained(whole, joint) and left.share <= MANY:
        spread = noise**2 * covariance(whole, joint)[:m, :m]
    else:
        spread = doubtful(whole, joint, noise)[:m, :m]
    errors = Bound.of(spread, problem.axes, k, c)
    top, _ = intensity_distance(whole.q, lights.positions, problem.geometry, MARGIN)
    chi2, wide = joint.cost / problem.rows, joint.departure.width
    return replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=spread,
        bound=top,
        residual=residual,
        sigma=problem.sigma,
        inseparable=inseparable(lights, errors.position),
        resolution=resolution(problem, lights),
        width=wide(joint.unknowns) if wide else np.zeros(k),
        certificate=np.nan,
        relative=found.relative or joint.departure.kind is Kind.ENCODING,
        chi2=chi2,
        history=(*found.history, Step("fit with what may be wrong", k, chi2)),
        noise=left,
        counts=tuple(replace(one, allowed=False) for one in found.counts),  # of the model as given
    )


def is_louder(whole: Evidence, here: Joint) -> bool:
    """Whether what is left is noise but for its size: and alike at no neighbours."""
    noise, problem = level_of(here.residual), whole.problem
    scaled = here.residual / max(1.0, noise)
    quiet = lost(whole, scaled)[0] < LOUDER * problem.rows
    pattern = correlation(scaled, problem.neighbours)
    return quiet and noise > 1 and pattern < whole.criterion.unlikely


def louder(found: Localization, whole: Evidence, here: Joint, o: Options) -> Localization:
    """The answer with errors as large as what is left, which is alike at no neighbours."""
    noise = level_of(here.residual)
    error = SPREAD * noise / np.sqrt(whole.problem.rows)
    sentence = (
        f"What the lights leave looks like noise, but {noise:.3g} ± {error:.1g} times as large as "
        f'the standard errors say; try Options(noise="scaled").'
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
