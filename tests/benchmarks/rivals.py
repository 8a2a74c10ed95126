"""The same field D(p) without Dr.Jit: plain NumPy, and a Numba loop. Unoccluded Lambert only."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

CHUNK = 64  # grid points at once: temporaries of 64 x 4096 float32 stay in the cache


def numpy_field(
    x: NDArray[np.float32], n: NDArray[np.float32], I0: NDArray[np.float32], p: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """D and L at (g, 3) positions; ``I0`` is pi B / albedo, (n,)."""
    D, L = np.empty(len(p), np.float32), np.empty(len(p), np.int64)
    for first in range(0, len(p), CHUNK):
        d = p[first : first + CHUNK, None] - x
        cosine = np.einsum("gna,na->gn", d, n)
        d2 = np.einsum("gna,gna->gn", d, d)
        with np.errstate(divide="ignore"):
            I = np.where(cosine > 0, I0 * d2 * np.sqrt(d2) / cosine, np.inf)
        least = I.argmin(axis=1)
        L[first : first + CHUNK] = least
        D[first : first + CHUNK] = np.take_along_axis(I, least[:, None], axis=1)[:, 0]
    return D, L


@numba.njit(parallel=True, fastmath={"contract", "reassoc", "nsz", "arcp", "afn"})
def numba_field(x, y, z, nx, ny, nz, I0, p):
    """D and L at (g, 3) positions; the observations as seven arrays, ``I0`` as above."""
    D = np.empty(len(p), np.float32)
    L = np.empty(len(p), np.int64)
    for g in numba.prange(len(p)):
        px, py, pz = p[g, 0], p[g, 1], p[g, 2]
        least, who = np.float32(np.inf), -1
        for i in range(len(x)):
            dx, dy, dz = px - x[i], py - y[i], pz - z[i]
            cosine = dx * nx[i] + dy * ny[i] + dz * nz[i]
            d2 = dx * dx + dy * dy + dz * dz
            I = I0[i] * d2 * np.sqrt(d2) / cosine
            if cosine > 0 and least > I:
                least, who = I, i
        D[g], L[g] = least, who
    return D, L
