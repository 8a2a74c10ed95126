"""Adam on Mitsuba's differentiable rendering, with more lights for as long as that helps much."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Observations, remove_indirect
from render import Adam, Room, optimize

MOST = 6
MUCH = 0.5  # of the loss, that a further light must not leave: descents end near their minimum
FEW = Adam(starts=16, steps=500)


def solve(
    q: Observations, geometry: Geometry | None, room: Room, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (k, 3) and intensities (k, c), by what Mitsuba renders of the ``room``."""
    q = remove_indirect(q, geometry) if q.interreflected and geometry else q
    best, loss = (np.zeros((0, 3)), np.zeros((0, q.channels))), np.inf
    for k in range(1, MOST + 1):
        descent = optimize(room, q, k, options=FEW, seed=seed)
        left = float(descent.losses.min())
        if not left < MUCH * loss:
            break
        best, loss = (descent.lights.positions, descent.lights.intensities), left
    return best
