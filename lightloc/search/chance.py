"""What chance alone would gain: the largest gain of a light that is not there, simulated.

A light may be claimed anywhere, so that the largest of very many gains decides. How many of these
are independent depends on the room: so noise is drawn, and asked for a light at every position of
the grid.
"""

from __future__ import annotations

import numpy as np

from lightloc.fit import Chance, Problem
from lightloc.search.dictionary import Dictionary

DRAWS = 200
"""Of noise: Gumbel's law through their largest gains is then known to 4 % at one in a thousand."""

SEED = 1998
"""Of that noise, the same in every search."""


def by_chance(problem: Problem, dictionary: Dictionary) -> Chance:
    """The gain in chi-square that the best place for a light has where only noise is left.

    ``dictionary`` is over ``problem``, whose radiance is not looked at. Each draw is in units of
    its own size, as noise is where nobody knows it.
    """
    _, g, n = dictionary.atoms.shape
    rng = np.random.default_rng(SEED)
    gains = np.zeros((g, DRAWS), np.float32)
    for atoms, energy in zip(dictionary.atoms, dictionary.energies, strict=True):
        z = rng.normal(size=(n, DRAWS)).astype(np.float32)
        z /= np.sqrt(np.square(z).mean(axis=0))
        whole = np.maximum(energy.sum(axis=1, keepdims=True), np.finfo(np.float32).tiny)
        gains += np.square(np.maximum(atoms.astype(np.float32) @ z, 0)) / whole
    top = gains.max(axis=0)
    width = np.sqrt(6) / np.pi * top.std(ddof=1)
    middle = top.mean() - np.euler_gamma * width
    return Chance(float(middle), float(width))
