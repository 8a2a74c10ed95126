"""Light that is no longer in B: what it was, and the noise that it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.given import Observations


@dataclass(frozen=True, eq=False)
class Subtracted:
    """Light that was in B and was subtracted: its noise stays.

    Parameters
    ----------
    radiance : (n, c) array
        Of it, W sr^-1 m^-2.
    error : (n, c) array
        Its standard errors.
    """

    radiance: NDArray[np.float64]
    error: NDArray[np.float64]

    @staticmethod
    def between(before: Observations, after: Observations) -> Subtracted:
        """What observations with a sigma have lost, and what their sigma has gained."""
        gained = np.square(after.known_sigma) - np.square(before.known_sigma)
        return Subtracted(before.radiance - after.radiance, np.sqrt(np.maximum(gained, 0)))

    def rows_of(self, some: NDArray[np.intp]) -> Subtracted:
        """At some of the observations."""
        return Subtracted(self.radiance[some], self.error[some])
