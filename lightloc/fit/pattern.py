"""Whether residuals have a pattern: noise differs from neighbour to neighbour, a model's error not.

Next neighbours are left out: the filter of a camera's film makes the noise of pixels alike that
touch, and is no error of a model.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

FIRST, LAST = 9, 16
"""Ranks of the neighbours that are compared: in a grid of pixels, two to three pixels apart."""

ALIKE = 0.5
"""Least cosine between the normals of neighbours."""

LARGEST = 8192
"""Observations that are looked at, at most."""

WILD = 3.0
"""Standard errors beyond which a residual counts no more."""

TINY = np.finfo(float).tiny

LITTLE = 0.25
"""Least mean square that is taken for noise, in standard errors: less is rounding."""


def neighbours(x: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.intp]:
    """(m, 2) pairs of (n, 3) points that lie near each other and face the same way."""
    some = np.arange(len(x))
    if len(x) > LARGEST:
        some = np.linspace(0, len(x) - 1, LARGEST).astype(int)
    if len(some) <= LAST:
        return np.zeros((0, 2), np.intp)
    _, near = cKDTree(x[some]).query(x[some], k=LAST + 1)
    i = np.repeat(some, LAST - FIRST + 1)
    j = some[near[:, FIRST:].ravel()]
    alike = (normals[i] * normals[j]).sum(axis=1) > ALIKE
    pairs = np.sort(np.stack([i, j], axis=1)[alike], axis=1)
    return np.unique(pairs, axis=0)


def correlation(z: NDArray[np.float64], pairs: NDArray[np.intp]) -> float:
    """By how many standard deviations neighbours among (n, c) residuals are alike.

    Examples
    --------
    >>> x = np.stack([np.arange(900) % 30, np.arange(900) // 30, np.zeros(900)], axis=1)
    >>> pairs = neighbours(x, np.tile([0.0, 0, 1], (900, 1)))
    >>> noise = np.random.default_rng(0).normal(size=(900, 1))
    >>> abs(correlation(noise, pairs)) < 3, correlation(noise + np.sin(x[:, :1] / 5), pairs) > 5
    (True, True)
    """
    if not len(pairs):
        return 0.0
    z = np.clip(z, -WILD, WILD)
    noise = np.maximum(np.square(z).mean(axis=0), LITTLE)
    alike = (z[pairs[:, 0]] * z[pairs[:, 1]]).sum(axis=0) / noise
    return float(alike.sum() / np.sqrt(alike.size * len(pairs)))


def clustering(
    z: NDArray[np.float64], outside: NDArray[np.bool_], pairs: NDArray[np.intp]
) -> float:
    """By how many standard deviations outliers among (n, c) residuals lie together on one side.

    That they lie together is no pattern: noise that is larger in some places than in others has
    its outliers there, as many pairs of them on opposite sides of 0 as on the same. What a light
    leaves that is missing lies on one side. The root of twice the logarithm of a ratio of
    likelihoods: pairs are counts, and large noise adds as many to both.

    Examples
    --------
    >>> x = np.stack([np.arange(900) % 30, np.arange(900) // 30, np.zeros(900)], axis=1)
    >>> pairs, near = neighbours(x, np.tile([0.0, 0, 1], (900, 1))), np.all(x < 8, axis=1)
    >>> noise = np.random.default_rng(0).normal(size=(900, 1))
    >>> larger = np.where(near[:, None], 9 * noise, noise)
    >>> clustering(larger, np.abs(larger) > 4, pairs) < 3
    True
    >>> lit = noise + np.where(near[:, None], 9.0, 0.0)
    >>> clustering(lit, np.abs(lit) > 4, pairs) > 5
    True
    """
    sides = np.sign((z * outside).sum(axis=1))
    both = sides[pairs[:, 0]] * sides[pairs[:, 1]]
    same, opposite = int((both > 0).sum()), int((both < 0).sum())
    more = len(pairs) * sides.mean() ** 2  # by chance, on the same side than on opposite ones
    chance = (len(pairs) * np.square(sides).mean() ** 2 + more) / 2
    twice = 2 * more + same + opposite
    expected = max(chance, (twice + np.sqrt(max(twice**2 - 8 * same * more, 0))) / 4, 1 / 2)
    if same <= expected:
        return 0.0
    rest = max(expected - more, TINY)
    ratio = same * np.log(same / expected) - (same - expected) - (opposite - rest)
    ratio += opposite * np.log(max(opposite, 1) / rest)
    return float(np.sqrt(2 * max(ratio, 0)))
