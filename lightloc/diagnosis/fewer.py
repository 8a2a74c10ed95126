"""Fewer lights that explain what is seen in another way: more are not sure to be there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lightloc.answer import Localization
from lightloc.diagnosis.choice import (
    NEEDED,
    attempts,
    best_of,
    is_explained,
    level,
    plain,
    promises,
    total,
    without,
)
from lightloc.diagnosis.departure import Evidence
from lightloc.diagnosis.joint import Joint, fitted, left, lost, modelled
from lightloc.diagnosis.piece import pieces
from lightloc.diagnosis.telling import Diagnosis
from lightloc.diagnosis.wide import wide
from lightloc.given import PointLights

ABOUT = 1.5
"""Times what the best departure leaves and costs, that one with fewer lights may."""

SEVERAL = 4
"""Lights for each that is wide, for which that need only explain about as well."""

CLEARLY = 4.0
"""Prices of a light by which wide lights must otherwise do better than points: these are what the
model has, and at times not at their best. In rooms of points patches did better by up to 46 and
in rooms of patches by 170 and more, where a light costs 20 (measured)."""


def claimed_by_all(evidence: Evidence, best: Joint, joints: Sequence[Joint]) -> Joint:
    """The best, or the fewest lights that explain about as well: more are not sure to be there.

    Not if they leave and cost more than lights do without a departure; nor beside a piece that is
    left out, if that is the best: then what more lights gain tells.
    """
    apart = best.departure is not None and best.departure.aside is not None
    noise = level([best, *joints])
    cost = {id(one): total(evidence, one, noise) for one in [best, *joints]}
    alone = [cost[id(one)] for one in joints if one.departure is None]
    limit = min([ABOUT * cost[id(best)], *alone])
    fewer = [
        one
        for one in joints
        if one.departure
        and not (apart and one.departure.aside is not None)
        and len(one.lights) < len(best.lights)
        and cost[id(one)] < limit
        and is_explained(evidence, one)
    ]
    best = min([best, *fewer], key=lambda one: (len(one.lights), cost[id(one)]))
    while not apart and len(best.lights) > 1:
        one = without(evidence, best, least(evidence, best))
        if total(evidence, one, noise) > limit or not is_explained(evidence, one):
            break
        best = one
    return best


def least(evidence: Evidence, joint: Joint) -> int:
    """The light without which least is left, all else as it is."""

    def cost(i: int) -> float:
        kept = np.delete(np.arange(len(joint.lights)), i)
        lights = PointLights(joint.lights.positions[kept], joint.lights.intensities[kept])
        u = joint.departure.kept(joint.unknowns, kept) if joint.departure else joint.unknowns
        return lost(evidence, left(evidence, modelled(evidence, lights, joint.departure, u).B))[0]

    return min(range(len(joint.lights)), key=cost)


def fewer_wide(
    found: Localization, whole: Evidence, evidence: Evidence, fewest: int
) -> Diagnosis | None:
    """Fewer lights that are patches, where they explain for less than many close together."""
    rows, price = evidence.problem.rows, evidence.criterion.price(evidence.problem)
    many = found.chi2 * rows + len(found.lights) * price
    for count in found.counts:
        if not fewest <= len(count.lights) < len(found.lights):
            continue
        joints = attempts(evidence, promises(evidence, count.lights, (wide,)))
        if not joints:
            continue  # one may lie outside
        best = best_of(evidence, joints)
        several = len(found.lights) >= SEVERAL * len(count.lights)
        limit = many * ABOUT if several else many - CLEARLY * price
        if is_explained(evidence, best) and total(evidence, best, 1.0) < limit:
            share = 1 - best.cost / max(plain(evidence, count.lights).cost, best.cost)
            return Diagnosis(evidence, best, ((best, share),), explained=True)
    return None


def fewer_apart(found: Localization, evidence: Evidence) -> Diagnosis | None:
    """Fewer lights beside a piece that is left out, where the others light little but that.

    It may as well not be what it is believed to be.
    """
    price = evidence.criterion.price(evidence.problem)
    S, _ = evidence.lit(found.lights).brought
    energy = np.square(S * found.lights.intensities / evidence.problem.sigma[:, None]).sum(axis=2)
    for count in found.counts:
        fewer = len(found.lights) - len(count.lights)
        if not 0 < fewer < len(found.lights):
            continue
        for piece in pieces(evidence.lit(count.lights)):
            assert piece.aside is not None
            elsewhere = np.sort(energy[~piece.aside].sum(axis=0))
            if elsewhere[:fewer].sum() > NEEDED * fewer * price:
                continue
            joint = fitted(evidence, count.lights, piece, np.zeros(0))
            if is_explained(evidence, joint):
                alone = plain(evidence, count.lights).cost
                share = 1 - joint.cost / max(alone, joint.cost)
                return Diagnosis(evidence, joint, ((joint, share),), explained=True)
    return None
