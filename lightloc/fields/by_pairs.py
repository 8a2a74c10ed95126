"""D and L from S of every pair, for materials over which a kernel can't loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.fields.ranking import DARKEST, NO_LIMITER
from lightloc.given import Geometry
from lightloc.optics import Surfels, shaded

PAIRS = 1 << 20
"""Of observations and positions at once, at most."""


def by_pairs(
    s: Surfels, B: NDArray[np.float64], points: NDArray[np.floating], geometry: Geometry | None
) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """D (g, k) and L (g, k) of (n, k) radiances at (g, 3) positions, in float32."""
    (n, k), g = B.shape, len(points)
    D, L = np.zeros((g, k), np.float32), np.zeros((g, k), np.uint32)
    rows = max(1, PAIRS // n)
    for first in range(0, g, rows):
        some = slice(first, first + rows)
        S = shaded(s, np.asarray(points[some], float), geometry)
        for c in range(k):
            rank = S[min(c, len(S) - 1)] / np.maximum(B[:, c], DARKEST)
            who = rank.argmax(axis=1)
            most = np.take_along_axis(rank, who[:, None], axis=1)[:, 0]
            with np.errstate(divide="ignore"):
                D[some, c] = np.where((most > 0) & (B[who, c] <= DARKEST), 0, 1 / most)
            L[some, c] = np.where(most > 0, who, NO_LIMITER)
    return D, L
