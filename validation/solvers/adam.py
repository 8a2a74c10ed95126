"""Adam on Mitsuba's differentiable rendering, with ever more lights, while BIC falls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Observations, remove_indirect
from render import Adam, Room, optimize

MOST = 6
FEW = Adam(starts=16, steps=500)


def solve(
    q: Observations, geometry: Geometry | None, room: Room, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (k, 3) and intensities (k, c), by what Mitsuba renders of the ``room``."""
    q = remove_indirect(q, geometry) if q.interreflected and geometry else q
    best, score = (np.zeros((0, 3)), np.zeros((0, q.channels))), np.inf
    for k in range(1, MOST + 1):
        descent = optimize(room, q, k, options=FEW, seed=seed)
        chi2 = float(descent.losses.min()) * q.radiance.size
        charged = chi2 + k * (3 + q.channels) * np.log(q.radiance.size)
        if not charged < score:
            break
        q = remove_indirect(q, geometry) if q.interreflected and geometry else q
    best, score = (descent.lights.positions, descent.lights.intensities), charged
    return best
