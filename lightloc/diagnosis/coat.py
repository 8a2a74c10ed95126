"""The coat of plastic: how much of the light it lets in and out again, at any roughness.

`Plastic` computes that by quadrature, for one roughness in half a second. A fit asks for hundreds:
here it is read off a table, of the index 1.5, to a percent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INDEX = 1.5

ALPHAS = np.array([0.02, 0.06, 0.12, 0.2, 0.3, 0.45, 0.65, 0.95])

COSINES = np.array([0.0, 0.06, 0.12, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0])

TABLE = np.array(
    [
        (0.585, 0.265, 0.334, 0.502, 0.665, 0.793, 0.867, 0.925, 0.953, 0.960),
        (0.572, 0.472, 0.476, 0.566, 0.688, 0.798, 0.867, 0.923, 0.952, 0.960),
        (0.540, 0.602, 0.615, 0.656, 0.728, 0.809, 0.867, 0.919, 0.949, 0.959),
        (0.486, 0.654, 0.687, 0.719, 0.765, 0.820, 0.866, 0.912, 0.943, 0.957),
        (0.415, 0.637, 0.687, 0.727, 0.771, 0.818, 0.856, 0.899, 0.934, 0.953),
        (0.318, 0.550, 0.614, 0.666, 0.722, 0.777, 0.820, 0.869, 0.913, 0.944),
        (0.220, 0.424, 0.491, 0.549, 0.616, 0.685, 0.742, 0.809, 0.875, 0.926),
        (0.128, 0.284, 0.344, 0.399, 0.466, 0.542, 0.610, 0.699, 0.797, 0.888),
    ]
)
"""For each roughness: what is reflected back inside, then what is let in at each cosine."""


def row(alpha: Array) -> tuple[NDArray[np.intp], Array]:
    """The rows of the table about (n,) roughnesses: the lower, and how far to the next."""
    at = np.interp(np.log(alpha), np.log(ALPHAS), np.arange(len(ALPHAS)))
    low = np.minimum(at.astype(int), len(ALPHAS) - 2)
    return low, at - low


def inside(alpha: Array) -> Array:
    """(n,) the share that is reflected back inside."""
    low, t = row(alpha)
    return (1 - t) * TABLE[low, 0] + t * TABLE[low + 1, 0]


def let_in(alpha: Array, cosine: Array) -> Array:
    """(n, k) the share of the light that enters at cosines (n, k), by (n,) roughnesses."""
    low, t = row(alpha)
    at = np.interp(cosine, COSINES, np.arange(len(COSINES)))
    left = np.minimum(at.astype(int), len(COSINES) - 2)
    s, low, t = at - left, low[:, None], t[:, None]

    def of(rows: NDArray[np.intp]) -> Array:
        return (1 - s) * TABLE[rows, 1 + left] + s * TABLE[rows, 2 + left]

    return np.asarray((1 - t) * of(low) + t * of(low + 1))
