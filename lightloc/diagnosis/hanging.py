"""An answer that explains, asked what it hangs on: whether lamps explain as well, or better."""

from __future__ import annotations

from dataclasses import replace

from lightloc.answer import Localization, judged
from lightloc.diagnosis.assumed import alternatives, hangs_on
from lightloc.diagnosis.choice import best_of, plain, pruned
from lightloc.diagnosis.covered import errors, joined, with_errors
from lightloc.diagnosis.departure import Evidence
from lightloc.diagnosis.doubt import MANY, doubtful
from lightloc.diagnosis.emission import joint_of_lamps, lamps_found
from lightloc.diagnosis.joint import Joint
from lightloc.diagnosis.lamp_search import spread_over
from lightloc.diagnosis.score import seen_as_fewer
from lightloc.diagnosis.telling import Diagnosis, told
from lightloc.fit import Bound
from lightloc.given import Options, PointLights

SAMPLE = 4096
"""Observations, at most, that other models are asked of."""


def hung(found: Localization, whole: Evidence, o: Options) -> Localization:
    """An answer that explains, with errors that cover the other models that do.

    One that explains far better takes its place.
    """
    evidence, lights = whole, found.lights
    if not len(lights):
        return found
    if found.noise.share > MANY:
        found = doubted(found, whole, o)
    if len(whole.q) > SAMPLE:
        evidence = whole.rows_of(spread_over(whole.problem, SAMPLE))
    lamps = fewer_lamps(evidence, found)
    if lamps:
        return told(found, whole, emitted(evidence, lights, lamps), o)
    others, better = alternatives(evidence, lights, o.ambient)
    if better:
        joint = pruned(evidence, joint_of_lamps(evidence, better.lamps))
        return told(found, whole, emitted(evidence, lights, joint), o)
    if not others:
        return found
    bound = errors(found.covariance, lights, others, whole.problem.axes)
    verdicts = (*hangs_on(lights, others, whole.problem.unit), *found.verdicts)
    return judged(replace(with_errors(found, bound), verdicts=verdicts), whole.problem, o)


def doubted(found: Localization, whole: Evidence, o: Options) -> Localization:
    """The answer with errors that are no less than by how much patches of observations disagree."""
    spread = joined(found.covariance, doubtful(whole, plain(whole, found.lights), 1.0))
    bound = Bound.of(spread, whole.problem.axes, *found.lights.intensities.shape)
    return judged(with_errors(found, bound), whole.problem, o)


def fewer_lamps(evidence: Evidence, found: Localization) -> Joint | None:
    """Fewer lights that are lamps, where they explain for less than points do."""
    base = plain(evidence, found.lights)
    fewer = [count.lights for count in found.counts if 0 < len(count.lights) < len(found.lights)]
    if not any(seen_as_fewer(evidence, lights, base.cost) for lights in fewer):
        return None
    for one in lamps_found(evidence):
        if len(one.lights) < len(found.lights) and best_of(evidence, [base, one]) is one:
            return one
    return None


def emitted(evidence: Evidence, lights: PointLights, joint: Joint) -> Diagnosis:
    """That lights are lamps, which explains better."""
    before = plain(evidence, lights).cost
    share = (before - joint.cost) / max(before - evidence.problem.rows, before - joint.cost, 1.0)
    return Diagnosis(evidence, joint, ((joint, max(share, 0.0)),), explained=True)
