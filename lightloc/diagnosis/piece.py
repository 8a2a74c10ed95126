"""Geometry: a piece of what is seen that is not what it is believed to be, and is left out.

An object that was moved, or put into the room, shows light that is meant for another place: its
observations are far off together, each in its own way. Lights beside it would explain a few.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.stats import binom

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled, fixed
from lightloc.diagnosis.joint import left
from lightloc.fit import cauchy

NAME = "a piece of the surface"

CHARGED = 8
"""Unknowns that each observation of it is charged for: with 1 each, pieces took the place of lights
in rooms without outliers (measured)."""

BY_CHANCE = 1e-6
"""Probability that as many are far off together where outliers lie anywhere."""

PRICE, MOST = 12.0, 3.0
"""Loss that an observation must leave to count for the piece that it lies in, and so many times
that at most; what leaves less counts against it. So a third of a piece are far off, wherever
outliers lie."""

SHARE = 0.2
"""Of the observations that are lit, at most: of more the rest would tell little."""

PAIRS = 1 << 22
"""Distances, at most, that are looked at: of more, fewer middles are tried."""

FEW = 6
"""Observations, at least: as many as may lie together by chance."""


def pieces(lit: Lit) -> list[Departure]:
    """The round piece that leaves most, if there is one."""
    inside, centre, radius = piece_of(lit)
    count = int(inside.sum())
    if count < FEW:
        return []
    seen = lit.evidence.problem.radiance
    outside = ~inside[:, None]

    def model(lit: Lit, u: Array) -> Modelled:
        plain = lit.plain
        B = np.where(outside, plain.B, seen)
        return Modelled(B, plain.by_lights * outside[:, :, None], plain.by_unknowns)

    place = ", ".join(f"{x:.3g}" for x in centre)
    unit, (n, c) = lit.evidence.problem.unit, seen.shape
    said = (
        f"{100 * count / n:.2g} % of the observations, those within {radius:.2g} {unit} of "
        f"({place}), are not of the surface that the geometry has there"
    )
    return [
        Departure(
            Kind.GEOMETRY,
            NAME,
            model,
            lambda lit, u: np.zeros((n, c, 0)),
            fixed(np.zeros((1, 0))),
            lambda u, e: said,
            "it without that piece, or with what is there",
            fixed(np.zeros((2, 0))),
            none=0,
            rank=CHARGED * count * c,
            aside=inside,
        )
    ]


def piece_of(lit: Lit) -> tuple[NDArray[np.bool_], Array, float]:
    """Which observations are of it, and the ball that holds them: the most that is left in one."""
    evidence, x = lit.evidence, lit.evidence.q.positions
    problem = evidence.problem
    loss, _ = cauchy(left(evidence, lit.plain.B), evidence.criterion.likelihood.scale)
    worth = np.minimum(loss.max(axis=1), MOST * PRICE) - PRICE
    middles = np.flatnonzero(worth > 0)
    middles = middles[:: 1 + len(middles) * len(x) // PAIRS]
    lit_up = np.abs(problem.radiance) > evidence.criterion.likelihood.scale * problem.sigma
    away = cdist(x[middles], x)
    order = np.argsort(away, axis=1)[:, : int(SHARE * lit_up.any(axis=1).sum())]
    gain = np.cumsum(worth[order], axis=1)
    if not gain.size or gain.max() <= 0:
        return np.zeros(len(x), bool), x[0], 0.0
    i, last = np.unravel_index(np.argmax(gain), gain.shape)
    inside = np.zeros(len(x), bool)
    inside[order[i, : last + 1]] = True
    far, count = (worth > 0) & inside, int(inside.sum())
    elsewhere = (1 + np.count_nonzero((worth > 0) & ~inside)) / (len(x) - count)
    if binom.sf(far.sum() - 1, count, elsewhere) * len(x) ** 2 > BY_CHANCE:
        return np.zeros(len(x), bool), x[0], 0.0
    return inside, x[middles[i]], float(away[i, order[i, last]])
