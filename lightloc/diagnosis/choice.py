"""Which departure, with how many lights, explains what is seen for the least.

What is weighed is the robust chi-square, in units of the noise that the best leaves, and a price
on top: of each light, and of each unknown of a departure.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Evidence, Lit, Maker, Modelled
from lightloc.diagnosis.joint import Ground, Joint, ahead, covariance, fitted, ground_of, left, lost
from lightloc.fields import Grid
from lightloc.fit import Fit, level_of
from lightloc.given import PointLights
from lightloc.optics import shading

RARE = 1e-6
"""Chance that noise gains what a departure costs: dozens are asked, at several starts each."""

AHEAD, TRIED, FRONT = 3, 8, 2
"""Pairs of a count and a departure: those that are fitted by promise alone, all that are fitted
roughly, and those that are to their end."""

QUICK = 3
"""Steps at each width of a rough fit."""

CELLS, BIRTHS, FAINT = 1024, 4, 1e-6
"""Positions at which a light is asked for beside a departure, lights that may be added, and the
least share of the largest energy that one of them has."""

COMPARABLE = 2.0
"""Times what the best fit leaves and costs, that one of another kind may to be asked for more."""

MUCH = 0.5
"""Of what is left beyond noise, what is left at most by a light that only shows beside a
departure."""

NEEDED = 4.0
"""A light is needed, unasked, if its intensity is beyond 0 by so many times its price."""


@dataclass(frozen=True, eq=False)
class Promise:
    """What a departure would leave beside lights, to first order."""

    lights: PointLights
    departure: Departure
    unknowns: Array
    cost: float


def price(evidence: Evidence, departure: Departure | None, unknowns: int) -> float:
    """Chi-square that a departure must gain, in units of the noise; 0 of none."""
    if departure is None:
        return 0.0
    luck = float(chi2.isf(RARE, departure.rank or unknowns))
    return max(luck, evidence.criterion.shared * evidence.problem.rows)


def plain(evidence: Evidence, lights: PointLights) -> Joint:
    """Lights as they are, without a departure."""
    z = left(evidence, evidence.lit(lights).plain.B)
    return Joint(lights, None, np.zeros(0), z, lost(evidence, z)[0])


def promises(
    evidence: Evidence, lights: PointLights, makers: Sequence[Maker], far: bool = True
) -> list[Promise]:
    """What each departure would leave beside lights, from the best of its starts.

    Only from those at which the model is as given where nothing ``far`` is asked, and of what has
    no unknowns.
    """
    lit, result = evidence.lit(lights), []
    ground = ground_of(lit)
    for departure in (one for maker in makers for one in maker(lit)):
        each: list[tuple[float, int, Array]] = []
        for i, u in enumerate(departure.starts(lit)):
            if i < departure.none:
                each.append((ground.promised(departure.columns(lit, u)), i, u))
            elif far or not u.size:
                each.append((ahead(evidence, departure.model(lit, u)), i, u))
        if each:
            cost, _, u = min(each)
            result.append(Promise(lights, departure, u, cost))
    return result


def level(joints: Iterable[Joint]) -> float:
    """The least residuals of any, in standard errors, taken for noise; 1 where less."""
    return max(1.0, min(level_of(one.residual) for one in joints))


def total(evidence: Evidence, joint: Joint, noise: float) -> float:
    """What a fit leaves, in units of the noise, and what it costs."""
    lights = len(joint.lights) * evidence.criterion.price(evidence.problem)
    own = price(evidence, joint.departure, len(joint.unknowns))
    return lost(evidence, joint.residual / noise)[0] + lights + own


def is_explained(evidence: Evidence, joint: Joint) -> bool:
    """Whether a fit leaves no more than noise."""
    criterion = evidence.criterion
    fit = Fit(joint.lights, joint.residual, joint.cost, evidence.problem)
    if joint.departure and joint.departure.kind in (Kind.EMISSION, Kind.EXTENDED):
        return criterion.is_clean(evidence.problem, fit)  # a further one may reach but a few
    return criterion.is_explained(evidence.problem, fit)


def hope(evidence: Evidence, one: Promise) -> float:
    """What a promise leaves and costs."""
    lights = len(one.lights) * evidence.criterion.price(evidence.problem)
    return one.cost + lights + price(evidence, one.departure, len(one.unknowns))


def attempts(evidence: Evidence, every: Sequence[Promise]) -> list[Joint]:
    """Fits of the pairs of a count of lights and a departure that promise most.

    The most promising by far, then the first of each other kind: all roughly, until one explains,
    and those that come nearest to their end.
    """
    ranked = sorted(every, key=lambda one: hope(evidence, one))
    firsts, seen = list[Promise](), set[Kind]()
    for one in ranked:
        if one.departure.kind not in seen:
            firsts.append(one)
            seen.add(one.departure.kind)
    names, some = set[tuple[str, int]](), list[Promise]()
    for one in [*ranked[:AHEAD], *firsts, *ranked]:
        apart = one.departure.aside is not None or one.departure.kind is Kind.EXTENDED
        name = one.departure.name, len(one.lights) if apart else 0
        if name not in names and len(some) < TRIED:
            some.append(one)
            names.add(name)
    rough = list[Joint]()
    for i, one in enumerate(some):
        rough.append(fitted(evidence, one.lights, one.departure, one.unknowns, QUICK))
        known = evidence.criterion.likelihood.known
        if known and i + 1 >= AHEAD and any(is_explained(evidence, joint) for joint in rough):
            break
    return finished(evidence, rough)


def resumed(evidence: Evidence, joints: Sequence[Joint]) -> list[Joint]:
    """The same fits, taken up where other errors hold; each once."""
    each = {id(one): one for one in joints}.values()
    return [
        fitted(evidence, one.lights, one.departure, one.unknowns)
        for one in list(each)[:FRONT]
        if one.departure
    ]


def finished(evidence: Evidence, rough: Sequence[Joint]) -> list[Joint]:
    """Fits of which those that come nearest are fitted to their end."""
    if not rough:
        return []
    noise = level(rough)
    order = sorted(rough, key=lambda one: total(evidence, one, noise))
    return [
        fitted(evidence, one.lights, one.departure, one.unknowns) if i < FRONT else one
        for i, one in enumerate(order)
    ]


def best_of(evidence: Evidence, joints: Sequence[Joint]) -> Joint:
    """The one that explains for the least.

    Where none explains, errors are shared by neighbours, and a light must gain more.
    """
    if not any(is_explained(evidence, one) for one in joints):
        evidence = replace(evidence, criterion=evidence.criterion.doubting())
    noise = level(joints)
    return min(joints, key=lambda one: total(evidence, one, noise))


def spread(evidence: Evidence, best: Joint, sets: Sequence[PointLights]) -> list[Joint]:
    """The departure that is best so far with the next other counts of lights."""
    departure, count = best.departure, len(best.lights)
    if departure is None:
        return []
    result = []
    for lights in sets:
        if len(lights) in (count - 2, count - 1, count + 1):
            starts = departure.starts(evidence.lit(lights))
            if starts.shape[1] == len(best.unknowns):
                starts = best.unknowns[None]
            result += [fitted(evidence, lights, departure, u, QUICK) for u in starts]
    noise = level([best, *result])
    limit = COMPARABLE * total(evidence, best, noise)
    return finished(evidence, [one for one in result if total(evidence, one, noise) < limit])[:1]


def pruned(evidence: Evidence, best: Joint) -> Joint:
    """Without the lights that are not needed beside the departure."""
    while len(best.lights):
        fewer = [without(evidence, best, int(i)) for i in doubtful(evidence, best)]
        one = best_of(evidence, [best, *fewer])
        if one is best:
            return best
        best = one
    return best


def grown(evidence: Evidence, joints: Sequence[Joint], most: int) -> Joint:
    """The best, with the lights that only show beside a departure.

    Where the best does not explain what is seen, the first of each other kind is asked, too, if it
    leaves about as little.
    """
    best, noise = best_of(evidence, joints), level(joints)
    if best.departure is None or is_explained(evidence, best):
        return best
    limit = COMPARABLE * total(evidence, best, noise)
    near = [one for one in first_of_each(evidence, joints) if total(evidence, one, noise) <= limit]
    return best_of(evidence, [best, *(added(evidence, one, most) for one in near)])


def first_of_each(evidence: Evidence, joints: Sequence[Joint]) -> list[Joint]:
    """Of each kind of departure the fit that explains for the least, the best kind first."""
    noise, kinds = level(joints), dict[Kind, Joint]()
    for one in sorted(joints, key=lambda one: total(evidence, one, noise)):
        if one.departure:
            kinds.setdefault(one.departure.kind, one)
    return list(kinds.values())


def added(evidence: Evidence, best: Joint, most: int) -> Joint:
    """A fit with lights more, each of which leaves no more than `MUCH` of what was left of it."""
    grid, rows = Grid.over(evidence.problem.bounds, CELLS).points, evidence.problem.rows
    for _ in range(BIRTHS):
        if is_explained(evidence, best) or len(best.lights) >= most:
            break
        more = with_one(evidence, best, grid)
        if more.cost - rows > MUCH * (best.cost - rows):
            break
        best = more
    return best


def with_one(evidence: Evidence, joint: Joint, grid: Array) -> Joint:
    """A fit with a light more, where it gains most to first order: at one of (g, 3) places."""
    lit, departure, problem = evidence.lit(joint.lights), joint.departure, evidence.problem
    assert departure is not None
    one = departure.model(lit, joint.unknowns)
    ground = Ground.of(lit, one)
    atoms = shading(problem.surfels, grid, problem.geometry)
    own = ground.beside(atoms.swapaxes(1, 2) * shown(lit, one)[:, :, None])
    a, free = own.T @ ground.rest, np.square(own).sum(axis=0)
    if not free.any():
        return joint
    gain = np.where(a > 0, a**2 / np.maximum(free, free.max() * FAINT), 0)
    best = int(np.argmax(gain))
    intensity = np.full((1, joint.lights.channels), a[best] / max(free[best], 1e-300))
    lights = PointLights(
        np.concatenate([joint.lights.positions, grid[best : best + 1]]),
        np.concatenate([joint.lights.intensities, np.maximum(intensity, 0)]),
    )
    k = len(joint.lights)
    u = departure.more(joint.unknowns, k)
    return fitted(evidence, lights, departure, u)


def shown(lit: Lit, one: Modelled) -> Array:
    """(n, c) how much more is seen of a departure where the lights bring more: 1 if all of it."""
    bright = slice(len(lit.lights) * len(lit.evidence.problem.axes), None)
    seen = one.by_lights[:, :, bright] @ lit.lights.intensities.ravel()
    return np.asarray(
        np.where(lit.plain.B > 0, seen / np.where(lit.plain.B > 0, lit.plain.B, 1), 1)
    )


def doubtful(evidence: Evidence, joint: Joint) -> NDArray[np.intp]:
    """The lights that may not be needed: whose intensities are not far beyond 0."""
    (k, c), spread = joint.lights.intensities.shape, covariance(evidence, joint)
    first = k * len(evidence.problem.axes)
    error = np.sqrt(np.diag(spread)[first : first + k * c]).reshape(k, c)
    beyond = np.square(joint.lights.intensities / np.maximum(error, np.finfo(float).tiny))
    worth = NEEDED * evidence.criterion.price(evidence.problem) * level([joint]) ** 2
    return np.flatnonzero(beyond.sum(axis=1) < worth)


def without(evidence: Evidence, joint: Joint, i: int) -> Joint:
    """The same fitted again with one light less."""
    kept = np.delete(np.arange(len(joint.lights)), i)
    lights = PointLights(joint.lights.positions[kept], joint.lights.intensities[kept])
    u = joint.departure.kept(joint.unknowns, kept) if joint.departure else joint.unknowns
    return fitted(evidence, lights, joint.departure, u)
