"""What lightloc must know of a scene's geometry: two questions, answered inside kernels."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.given.observations import Observations

RAY_OFFSET = 8.9e-5
"""A shadow ray starts this far off its surface, times 1 + max|x|: Mitsuba's ray epsilon."""


class Geometry(Protocol):
    """Geometry as a value with two functions over Dr.Jit arrays.

    `render` makes one of a Mitsuba scene; any object with these methods serves. Where
    ``geometry=None`` is accepted, nothing occludes.
    """

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """V(x, p): whether the segment between (Array3f) x and p is free (Bool)."""
        ...

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """The first surface point along the ray x + t d: (hit, y)."""
        ...


@runtime_checkable
class Interreflecting(Geometry, Protocol):
    """A geometry that knows its materials too, and can render the light between its surfaces."""

    def interreflection(
        self, positions: ArrayLike, observations: Observations, samples: int, seed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Interreflected radiance of a light of intensity 1 at each of (k, 3) positions.

        Parameters
        ----------
        positions : (k, 3) array
            In the unit of length.
        observations : Observations
            Where it is seen from, and what.
        samples : int
            Paths per observation and light.
        seed : int
            Of the paths: the same ones for the i-th light in every call, wherever it is.

        Returns
        -------
        H, error : (n, k, c) arrays
            ``H @ intensities`` is the radiance, m^-2 sr^-1 per W/sr; its standard error,
            independent from light to light.
        """
        ...
