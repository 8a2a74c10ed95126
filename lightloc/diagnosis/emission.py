"""Emission: a light that shines more in one direction, as lamps do, taken for one that does not.

What such a light leaves follows the direction in which it is seen from the lamp. Its unknowns are
a vector v for each light: along its axis, as long as the exponent of cos^m; 0 for a point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Evidence, Lit, Modelled
from lightloc.diagnosis.joint import Joint, left, lost
from lightloc.diagnosis.lamp_search import directions, searched
from lightloc.diagnosis.lamps import EXPONENTS, Lamps, seen_from, shone, tangents

NAME = "the emission of lights"

TRIED = (1.0, 4.0, 15.0)
"""Exponents with which a light found is asked whether it is a lamp."""

TRIAL = "the lights as told: such lamps stand there, with these intensities along their axes"


def emission(lit: Lit) -> list[Departure]:
    """Each of the lights as a lamp."""
    if not len(lit.lights):
        return []
    d = len(lit.evidence.problem.axes)
    return [
        Departure(
            Kind.EMISSION,
            NAME,
            model,
            lambda lit, u: model(lit, u).by_unknowns,
            starts,
            lambda u, e: said(u.reshape(-1, d), e.reshape(-1, d)),
            TRIAL,
            limits,
            none=0,
            kept=lambda u, some: u.reshape(-1, d)[some].ravel(),
            more=lambda u, k: np.append(u, np.zeros(d)),
        )
    ]


def lamps_of(lit: Lit, u: Array) -> Lamps:
    """The lights with the vectors u, light by light, along the free axes."""
    axes = np.zeros((len(lit.lights), 3))
    axes[:, lit.evidence.problem.axes] = u.reshape(len(axes), len(lit.evidence.problem.axes))
    m = np.linalg.norm(axes, axis=1)
    axes[m == 0] = np.eye(3)[lit.evidence.problem.axes[-1]]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return Lamps.of(lit.lights, axes, m)


def vectors_of(lamps: Lamps, axes: NDArray[np.intp]) -> Array:
    """The unknowns of lamps."""
    return np.asarray(lamps.axes[:, axes] * lamps.exponents[:, None]).ravel()


def model(lit: Lit, u: Array) -> Modelled:
    """B of the lights as lamps; a point has no derivative by what would make it a lamp."""
    problem, lamps = lit.evidence.problem, lamps_of(lit, u)
    (n, c), k, d = problem.radiance.shape, len(lamps), len(problem.axes)
    B, every = shone(problem, lamps, *lit.brought)
    points = k * (d + c)
    by_angle = every[:, :, points : points + k * (d - 1)].reshape(n, c, k, d - 1)
    by_exponent = every[:, :, points + k * (d - 1) :]
    turns = tangents(lamps.axes, problem.axes)[:, :, problem.axes]
    m = np.where(lamps.exponents > 0, lamps.exponents, np.inf)
    by_vector = np.einsum("ncka,kad->nckd", by_angle, turns)
    by_vector += by_exponent[..., None] * lamps.axes[:, problem.axes]
    by_vector /= m[:, None]
    return Modelled(B, every[:, :, :points], by_vector.reshape(n, c, k * d))


def starts(lit: Lit) -> Array:
    """The one start at which each light in turn is the lamp that leaves least."""
    evidence, axes = lit.evidence, lit.evidence.problem.axes
    u = np.zeros((len(lit.lights), len(axes)))
    S, _ = lit.brought
    w, _ = seen_from(evidence.problem, lit.lights.positions)
    B = lit.plain.B
    for i in np.argsort(-lit.lights.intensities.sum(axis=1)):
        own = S[:, i] * lit.lights.intensities[i]
        rest, best = B - own, lost(evidence, left(evidence, B))[0]
        for axis in directions(axes):
            t = np.maximum(w[:, i] @ axis, 0)
            for m in TRIED:
                other = own * (t**m)[:, None]
                other *= own.sum() / max(float(other.sum()), 1e-300)
                cost = lost(evidence, left(evidence, rest + other))[0]
                if cost < best:
                    best, u[i] = cost, m * axis[axes]
                    B = rest + other
    return u.reshape(1, -1)


def limits(lit: Lit) -> Array:
    """No exponent is larger than `EXPONENTS`; what is no lamp stays a point."""
    size = len(lit.lights) * len(lit.evidence.problem.axes)
    return np.outer([-EXPONENTS[1], EXPONENTS[1]], np.ones(size))


def said(v: Array, e: Array) -> str:
    """What vectors (k, d) and their errors mean."""
    m = np.linalg.norm(v, axis=1)
    along = v / np.maximum(m, 1e-300)[:, None]
    off = np.sqrt(
        np.square(np.where(along == 0, 0, along * np.where(along == 0, 0, e))).sum(axis=1)
    )
    each = []
    for i in np.flatnonzero(m):
        axis = ", ".join(f"{a:.2f}" for a in v[i] / m[i])
        each.append(f"light {i + 1} shines as cos^{m[i]:.2g} (± {off[i]:.1g}) about ({axis})")
    return "; ".join(each) if each else "the lights shine alike in all directions"


def lamps_found(evidence: Evidence) -> list[Joint]:
    """The lamps that a search of their own finds; nothing where all of them are points."""
    fit = searched(evidence.problem, evidence.criterion)
    if not len(fit.lamps) or not fit.lamps.exponents.any():
        return []
    return [joint_of_lamps(evidence, fit.lamps)]


def joint_of_lamps(evidence: Evidence, lamps: Lamps) -> Joint:
    """Lamps as they are, as lights with a departure."""
    lit, u = evidence.lit(lamps.lights), vectors_of(lamps, evidence.problem.axes)
    (one,) = emission(lit)
    z = left(evidence, one.model(lit, u).B)
    return Joint(lamps.lights, one, u, z, lost(evidence, z)[0])
