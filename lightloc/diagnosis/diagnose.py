"""An answer, asked whether the model that it rests on is wrong, and in which way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from lightloc.answer import Kind, Localization, Reason, judged
from lightloc.diagnosis.choice import (
    attempts,
    best_of,
    first_of_each,
    grown,
    hope,
    is_explained,
    level,
    plain,
    promises,
    pruned,
    resumed,
    spread,
    total,
)
from lightloc.diagnosis.covered import Alternative, errors, with_errors
from lightloc.diagnosis.departure import Array, Evidence
from lightloc.diagnosis.emission import lamps_found
from lightloc.diagnosis.fewer import claimed_by_all, fewer_apart, fewer_wide
from lightloc.diagnosis.free import freed
from lightloc.diagnosis.hanging import hung
from lightloc.diagnosis.joint import Joint, fitted
from lightloc.diagnosis.kinds import GEOMETRY, MAKERS
from lightloc.diagnosis.telling import Diagnosis, remarked, told
from lightloc.diagnosis.wide import panels_of
from lightloc.fit import Criterion, Problem, estimated_level, is_exact, working_sigma
from lightloc.given import Geometry, Observations, Options, PointLights
from lightloc.optics import reflected_ambient

SAMPLE, FITTED = 1024, 640
"""Observations that departures are asked of, and fitted to; what is told is then fitted to all."""

FEWER = 6
"""Counts of lights, from none on, with which every departure is asked beside that of an answer; of
larger ones the geometry alone is, since lights may have adapted to a piece of it."""

QUIETER, STILL = 5, 0.9
"""Times that an estimate of the noise is made again beside a departure, and the factor on it from
which it stands."""

COARSE = 1e-3
"""Of B, and a hundredth of it of its mean: the errors of exact data where the model is wrong. By
their own, any residual is so far off that Cauchy's loss is flat."""

DARKER = 2.0
"""Times a standard error at the model's B that it is at what is seen, for that to be taken: the
model is too dark there. Else it is not, since what is seen has noise."""

HALF = 0.5
"""Share that a departure must explain for lights to be claimed as they are beside it."""

LAMPLIKE = 1.5
"""Times what the best departure leaves and costs, that the lights as lamps may, to be looked for
anew where something explains."""

MANY = 4
"""Lights that are many beside a departure."""

ALIKE = 2.0
"""Standard errors by which a light may move beside a departure, and nothing claimed changes."""

LITTLE = 0.05
"""Of what counts as known: lights that move less beside a departure stay, with errors that cover
both."""


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
    wrong = found.reason in (Reason.NO_GAIN, Reason.MOST_LIGHTS)
    few = any(v.kind is Kind.TOO_FEW for v in found.verdicts)
    wider = found.reason is Reason.EXTENDED and len(found.lights) > 1
    if few or not (wrong or wider or (right and not found.width.any())):
        return found
    exact = is_exact(q) and right
    if exact and not o.free:
        return found
    whole = evidence_of(found, q, geometry, bounds, o, criterion)
    some = np.random.default_rng(seed).permutation(len(q))[:SAMPLE]
    evidence = whole if len(q) <= FITTED else whole.rows_of(some)
    if o.free:
        return freed(found, whole, evidence, o)
    close = sum(v.kind is Kind.CLUSTER for v in found.verdicts) if right else 0
    fewest = max(1, len(found.lights) - close) if right else 1
    narrower = fewer_wide(found, whole, evidence, fewest) if wider or close else None
    if narrower and is_kept(answer := told(found, whole, narrower, o)):
        return answer
    if wider:
        return found
    base = plain(evidence, found.lights)
    explained = right or is_explained(evidence, base)
    if not explained:
        larger = unmoved(found, whole)
        some = some[:FITTED] if len(evidence.q) > FITTED else np.arange(len(q))
        whole = replace(whole, problem=replace(whole.problem, sigma=larger))
        evidence = whole.rows_of(some)
        base = plain(evidence, found.lights)
    asked = promises(evidence, found.lights, MAKERS, far=not explained)
    if explained:
        asked = [one for one in asked if hope(evidence, one) < cost_of(evidence, base)]
        if not asked:
            apart = fewer_apart(found, evidence)
            if apart and is_kept(answer := told(found, whole, apart, o)):
                return answer
            return hung(found, whole, o)
    several = {one.departure.kind for one in asked} != {Kind.GEOMETRY}
    makers = MAKERS if several or not explained else GEOMETRY
    fewer = [one.lights for one in found.counts if len(one.lights) < len(found.lights)]
    sets = [found.lights, *fewer]
    for i, lights in enumerate(fewer):
        asked += promises(evidence, lights, makers if i < FEWER else GEOMETRY)
    joints = attempts(evidence, asked)
    verdict = weighed(evidence, base, sets, joints, explained, o.most_lights)
    for _ in range(0 if criterion.likelihood.known else QUIETER):
        noise = 1.0 if verdict is None else estimated_level(verdict.best.residual)
        if verdict is None or verdict.best.departure is None or noise > STILL:
            break
        # what was taken for noise was the departure: lights that it hid may show now
        before = verdict, whole
        whole, evidence = whole.quieter(noise), evidence.quieter(noise)
        again = plain(evidence, verdict.best.lights)
        joints = resumed(evidence, [verdict.best, *(one for one, _ in verdict.others)])
        verdict = weighed(evidence, again, sets, joints, False, o.most_lights, first=False)
        departure = before[0].best.departure
        rough = departure is not None and departure.aside is not None  # a ball is not quite it
        if rough and before[0].explained and not (verdict and verdict.explained):
            verdict, whole = before
            break
    if verdict is None:
        return hung(found, whole, o)
    if found.reason is Reason.MOST_LIGHTS and not verdict.explained:
        return found  # lights that may not be looked for would be taken for a departure
    answer = told(found, whole, verdict, o)
    if right and (not is_kept(answer) or is_same(found, answer.lights)):
        return remarked(hung(found, whole, o), verdict)
    if right and verdict.best.departure and is_near(found, answer, whole, o):
        return remarked(hung(beside(found, answer, whole, o), whole, o), verdict)
    return answer


def is_kept(answer: Localization) -> bool:
    """Whether what was told explains all observations, and not a sample alone."""
    return answer.reason is not Reason.NO_GAIN


def unmoved(found: Localization, whole: Evidence) -> Array:
    """(n, c) the standard errors, no less than what they would be of what is seen.

    They were taken at the B of the lights found; where these are wrong, that is too dark at times.
    """
    sigma, seen = whole.problem.sigma, whole.problem.radiance
    if whole.criterion.likelihood.known:
        return sigma
    result = sigma.copy()
    for channel, B in enumerate((seen - found.residual * sigma).T):
        order = np.argsort(B)
        result[:, channel] = np.interp(seen[:, channel], B[order], sigma[order, channel])
    return np.where(result > DARKER * sigma, result, sigma)


def is_same(found: Localization, lights: PointLights) -> bool:
    """Whether lights are those of an answer, to within `ALIKE` of its errors."""
    if len(lights) != len(found.lights):
        return False
    away = np.linalg.norm(found.lights.positions[:, None] - lights.positions, axis=2)
    pairs = linear_sum_assignment(away)[1]
    off = np.abs(found.lights.positions - lights.positions[pairs])
    dimmer = np.abs(found.lights.intensities - lights.intensities[pairs])
    near = off <= ALIKE * found.position_error, dimmer <= ALIKE * found.intensity_error
    return bool(near[0].all() and near[1].all())


def is_near(found: Localization, answer: Localization, whole: Evidence, o: Options) -> bool:
    """Whether two answers are alike to within `LITTLE` of what counts as known."""
    if len(found.lights) != len(answer.lights):
        return False
    a, b = found.lights, answer.lights
    off = np.abs(a.positions - b.positions) <= LITTLE * o.sure_position * whole.problem.size
    dimmer = np.abs(a.intensities - b.intensities) <= LITTLE * o.sure_intensity * a.intensities
    return bool(off.all() and dimmer.all())


def beside(found: Localization, answer: Localization, whole: Evidence, o: Options) -> Localization:
    """The answer with errors that cover another, of as many lights in the same order."""
    every = tuple(range(len(found.lights)))
    other = Alternative(every, "", answer.lights, answer.covariance, answer.chi2)
    bound = errors(found.covariance, found.lights, [other], whole.problem.axes)
    return judged(with_errors(found, bound), whole.problem, o)


def cost_of(evidence: Evidence, joint: Joint) -> float:
    """What lights leave and cost."""
    return joint.cost + len(joint.lights) * evidence.criterion.price(evidence.problem)


def weighed(
    evidence: Evidence,
    base: Joint,
    sets: Sequence[PointLights],
    joints: Sequence[Joint],
    explained: bool,
    most: int,
    first: bool = True,
) -> Diagnosis | None:
    """What departures came to, and others with them; None where nothing is worth its price.

    Lamps are looked for the ``first`` time.
    """
    joints = [base, *joints]
    if first and may_be_lamps(evidence, joints):
        lamps = lamps_found(evidence)
        joints += [*lamps, *as_panels(evidence, lamps)]
    joints = [one for one in joints if len(one.lights) <= most]
    joints += spread(evidence, best_of(evidence, joints), sets)
    best = grown(evidence, joints, most)
    if best.departure is not None:
        best = claimed_by_all(evidence, pruned(evidence, best), joints)
    alone = base
    if best.departure is not None:
        alone = fitted(evidence, best.lights, None, np.zeros(0))
    excess = max(alone.cost - evidence.problem.rows, 1.0)
    gained = min(alone.cost, base.cost) - best.cost
    vain = gained < HALF * excess or len(best.lights) > len(base.lights)
    if not is_explained(evidence, best) and vain:
        best = base
    if best.departure is None and explained:
        return None
    others = first_of_each(evidence, joints)
    if best.departure is not None:
        kind = best.departure.kind
        others = [best, *(one for one in others if one.departure and one.departure.kind != kind)]
    shares = [float(np.clip((alone.cost - one.cost) / excess, 0, 1)) for one in others]
    pairs = tuple(zip(others, shares, strict=True))
    return Diagnosis(evidence, best, pairs, is_explained(evidence, best))


def may_be_lamps(evidence: Evidence, joints: Sequence[Joint]) -> bool:
    """Whether a search for lamps is worth its time.

    It is not where another departure, beside few lights, explains for far less than the lights as
    lamps; many lights may be what a lamp looks like.
    """
    noise, best = level(joints), best_of(evidence, joints)
    if len(best.lights) >= MANY or not any(is_explained(evidence, one) for one in joints):
        return True
    if best.departure and best.departure.kind in (Kind.EXTENDED, Kind.INDIRECT):
        return True  # they are as smooth
    lamps = [one for one in joints if one.departure and one.departure.kind is Kind.EMISSION]
    limit = LAMPLIKE * total(evidence, best, noise)
    return any(total(evidence, one, noise) < limit for one in lamps)


def as_panels(evidence: Evidence, lamps: Sequence[Joint]) -> list[Joint]:
    """Lamps that do not explain, as panels: a panel is seen as a lamp from afar."""
    return [
        fitted(evidence, one.lights, panel, panel.starts(evidence.lit(one.lights))[0])
        for one in lamps
        if not is_explained(evidence, one)
        for panel in [panels_of(evidence.lit(one.lights))]
    ]


def evidence_of(
    found: Localization,
    q: Observations,
    geometry: Geometry | None,
    bounds: NDArray[np.float64],
    o: Options,
    criterion: Criterion,
) -> Evidence:
    """The observations that an answer is of, as they were used."""
    sigma = found.sigma
    if q.sigma is not None and o.noise == "given":
        own = working_sigma(q, o)
        sigma = np.where(own > DARKER * sigma, own, sigma)
    if is_exact(q):
        B = np.abs(found.direct)
        sigma = np.hypot(sigma, COARSE * (B + 0.01 * B.mean()))
    used = q.with_radiance(found.direct, sigma, interreflected=False)
    problem = Problem.of(used, sigma, geometry, bounds)
    if o.ambient:
        problem = replace(problem, ambient=reflected_ambient(problem.surfels, used.channels))
    return Evidence(used, problem, criterion)
