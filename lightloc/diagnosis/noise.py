"""Noise: the mean is right, but what is left is larger, or smaller, than the errors say.

What is left by a wrong model is alike at neighbours. Where it is not, and no departure explains
it, the errors are what is wrong.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from lightloc.diagnosis.departure import Array, Evidence
from lightloc.fit import level_of

NEIGHBOURS = 4
"""Of each observation."""

WHITE = 5.0
"""Standard errors by which the correlation between neighbours may differ from 0."""


def alike(evidence: Evidence, z: Array) -> float:
    """The correlation of (n, c) residuals with their neighbours', in standard errors.

    Of their signs and ranks only: outliers do not count.
    """
    n = len(z)
    if n <= NEIGHBOURS:
        return 0.0
    q = evidence.q
    near = np.concatenate([q.positions, q.normals * q.diagonal / 4], axis=1)
    _, index = cKDTree(near).query(near, NEIGHBOURS + 1)
    bounded = np.tanh(z / np.maximum(level_of(z), np.finfo(float).tiny))
    bounded = bounded - bounded.mean(axis=0)
    each = bounded[:, None] * bounded[index[:, 1:]]
    scale = np.maximum(np.square(bounded).mean(axis=0), np.finfo(float).tiny)
    pairs = n * NEIGHBOURS / 2 * z.shape[1]  # most pairs are counted from both sides
    return float((each.mean(axis=(0, 1)) / scale).mean() * np.sqrt(pairs))
