"""From a hypothesis to others that have one light less: one dropped, or two joined."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import Descents, Problem, normal_equations

MERGE = 0.2
"""Of the longest side: pairs nearer than this may be one light."""

TRIED = 2
"""Lights that are dropped, and pairs that are joined, before the best of these is taken."""

HOPELESS = 100.0
"""Standard errors per residual: what is so far off is no start for a descent to the end. In exact
data that is 1e-4 of B, which is a measured error, or a model's."""

RIDGE = 1e-9
"""Of the normal equations' diagonal, so that lights at one place can be inverted."""


def without_one(problem: Problem, one: Descents, loss: float) -> Descents:
    """A light less: those that matter least dropped, those nearest joined where they balance."""
    p, I = one.positions[0], one.intensities[0]
    power = I.mean(axis=1) + np.finfo(float).tiny
    least = np.argsort(worths(problem, one, loss), kind="stable")[:TRIED]
    starts = [(np.delete(p, i, 0), np.delete(I, i, 0)) for i in least]
    a, b = np.triu_indices(len(p), 1)
    apart = np.linalg.norm(p[a] - p[b], axis=1)
    spread = np.minimum(power[a], power[b]) * apart**2
    for pair in np.argsort(spread, kind="stable")[:TRIED]:
        if apart[pair] < MERGE * problem.size:
            i, j = a[pair], b[pair]
            q, K = p.copy(), I.copy()
            q[i] = (power[i] * p[i] + power[j] * p[j]) / (power[i] + power[j])
            K[i] = I[i] + I[j]
            starts.append((np.delete(q, j, axis=0), np.delete(K, j, axis=0)))
    positions, intensities = zip(*starts, strict=True)
    return Descents.of(np.stack(positions), np.stack(intensities))


def are_needed(problem: Problem, one: Descents, loss: float) -> bool:
    """Whether each light's absence would, to first order, leave far more than others can take."""
    return bool(worths(problem, one, loss).min() > HOPELESS**2 * problem.rows)


def worths(problem: Problem, one: Descents, loss: float) -> NDArray[np.float64]:
    """Loss that each light's absence would cost, to first order, all others refitted: (k,)."""
    A = normal_equations(problem, one, loss)
    k, c = one.intensities.shape[1:]
    first = len(A) - k * c
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    spread = np.linalg.inv(A / np.outer(size, size) + RIDGE * np.eye(len(A)))
    cost = np.zeros(k)
    for i in range(k):
        own = first + i * c + np.arange(c)
        cost[i] = size[own] @ np.linalg.inv(spread[np.ix_(own, own)]) @ size[own]
    return cost


def distinct(tried: Descents, most: int, apart: float) -> Descents:
    """The ``most`` best hypotheses, leaving out those that are the same lights again."""
    kept: list[int] = []
    for j in np.argsort(tried.chi2, kind="stable"):
        p = tried.positions[j]
        if all(_furthest(p, tried.positions[i]) > apart for i in kept):
            kept.append(int(j))
        if len(kept) == most:
            break
    return tried.rows(np.array(kept, int))


def _furthest(p: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    apart = np.linalg.norm(p[:, None] - other, axis=2)
    return float(apart.min(axis=1, initial=np.inf).max(initial=0.0))
