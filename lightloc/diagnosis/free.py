"""What a user sets free: departures that are fitted together, whether they are needed or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightloc.answer import Assumption, Departed, Kind, Localization, Reason, judged, unexplained
from lightloc.diagnosis.choice import QUICK, finished, grown, is_explained, pruned
from lightloc.diagnosis.departure import (
    Array,
    Change,
    Departure,
    Evidence,
    Lit,
    added,
    fixed,
    pointwise,
    slope_of,
)
from lightloc.diagnosis.encoding import LIMITS, power
from lightloc.diagnosis.groups import groups_of
from lightloc.diagnosis.joint import covariance, fitted
from lightloc.diagnosis.material import FACTORS, factors
from lightloc.diagnosis.telling import moved, on_all
from lightloc.fit import Fit
from lightloc.given import Options

Part = tuple[Kind, str, Change, Array, Array]
"""A part's kind, its name, what it does, where its unknowns begin, and their limits (2, u)."""


def parts(lit: Lit, free: Sequence[str]) -> list[Part]:
    """What is asked for, in the order in which light meets it.

    Raises ValueError where albedos are and there is but one.
    """
    q, result = lit.evidence.q, list[Part]()
    if "albedo" in free:
        groups = groups_of(q)
        if not groups:
            raise ValueError(
                "Options.free has 'albedo', but there are no two regions whose albedos could "
                "differ: a factor on all of them is one on all intensities"
            )
        one = np.ones(len(groups) - 1)
        limits = np.outer(FACTORS, one)
        name = f"albedos, beside that of {groups[0][0]}"
        result.append((Kind.MATERIAL, name, factors(groups), one, limits))
    if "ambient" in free and lit.evidence.problem.ambient is None:
        mean = float(np.abs(q.radiance).mean()) or 1.0
        even = lit.evidence.ambient / max(float(lit.evidence.ambient.mean()), 1e-300) * mean
        each = even[:, :, None] * np.eye(q.channels)
        none, most = np.zeros(q.channels), np.full(q.channels, np.inf)
        name = "ambient light, in the mean radiance"
        result.append((Kind.INDIRECT, name, added(each), none, np.array([-most, most])))
    if "gamma" in free:
        mean = float(np.abs(q.radiance).mean()) or 1.0
        name, limits = "the power of radiance that values are", np.array(LIMITS)[:, None]
        start = np.ones(1)
        result.append((Kind.ENCODING, name, lambda B, u: power(B, u, mean), start, limits))
    return result


def together(lit: Lit, free: Sequence[str]) -> list[Departure]:
    """All that is free, as one departure."""
    chain = parts(lit, free)
    if not chain:
        return []
    sizes = np.cumsum([len(start) for _, _, _, start, _ in chain])

    def change(M: Array, u: Array) -> tuple[Array, Array, Array]:
        B, slope, by = M, np.ones_like(M), np.zeros((*M.shape, 0))
        for (_, _, one, _, _), own in zip(chain, np.split(u, sizes[:-1]), strict=True):
            B, along, columns = one(B, own)
            slope, by = slope * along, np.concatenate([by * along[:, :, None], columns], axis=2)
        return B, slope, by

    return [
        Departure(
            Kind.ASSUMED,
            "what was set free",
            pointwise(change),
            slope_of(change),
            fixed(np.concatenate([start for _, _, _, start, _ in chain])[None]),
            lambda u, e: "what was set free",
            "",
            fixed(np.concatenate([limits for _, _, _, _, limits in chain], axis=1)),
        )
    ]


def told_apart(lit: Lit, free: Sequence[str], u: Array, errors: Array) -> tuple[Departed, ...]:
    """What came out of each part."""
    result, first = list[Departed](), 0
    for kind, name, _, start, _ in parts(lit, free):
        some = slice(first, first + len(start))
        first += len(start)
        values = ", ".join(f"{a:.4g} ± {e:.1g}" for a, e in zip(u[some], errors[some], strict=True))
        sentence = f"{name}: {values}"
        result.append(Departed(kind, name, u[some], errors[some], np.nan, sentence))
    return tuple(result)


def freed(found: Localization, whole: Evidence, evidence: Evidence, o: Options) -> Localization:
    """The answer with what a user set free fitted together with the lights."""

    def maker(lit: Lit) -> list[Departure]:
        return together(lit, o.free)

    counts = [c.lights for c in found.counts if len(c.lights) < len(found.lights)]
    rough = [
        fitted(evidence, lights, one, one.starts(lit)[0], QUICK)
        for lights in (found.lights, *counts)
        for lit in [evidence.lit(lights)]
        for one in maker(lit)
    ]
    if not rough:
        return found
    best = grown(evidence, finished(evidence, rough), o.most_lights)
    joint = on_all(whole, pruned(evidence, best), [maker])
    spread = np.diag(covariance(whole, joint))[-len(joint.unknowns) :]
    apart = told_apart(whole.lit(joint.lights), o.free, joint.unknowns, np.sqrt(spread))
    seen = (Kind.HIDDEN, Kind.MIRROR)
    verdicts = [
        v for v in found.verdicts if v.kind in seen and max((0, *v.lights)) < len(joint.lights)
    ]
    explained = is_explained(whole, joint)
    if not explained:
        fit = Fit(joint.lights, joint.residual, joint.cost, whole.problem)
        verdicts.insert(0, unexplained(fit, whole.problem, tried=len(found.counts)))
    freed = {"albedo": Assumption.MATERIALS, "ambient": Assumption.NO_AMBIENT}
    answer = replace(
        moved(found, whole, joint, o),
        verdicts=tuple(verdicts),
        departures=apart,
        relative=found.relative or "gamma" in o.free,
        reason=Reason.CONVERGED if explained else Reason.NO_GAIN,
        assumed=tuple(a for a in found.assumed if a not in [freed.get(name) for name in o.free]),
    )
    return judged(answer, whole.problem, o)
