"""A different material at each point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.brdf import ceiling
from lightloc.brdf.ceiling import Ceiling
from lightloc.brdf.parts import Parts
from lightloc.brdf.protocol import Bounded, Scatter
from lightloc.checks import numbers
from lightloc.reprs import short


@dataclass(frozen=True, eq=False)
class Mixed(Parts):
    """A different BRDF at each point: point i has ``brdfs[index[i]]``.

    Parameters
    ----------
    brdfs : sequence of BRDF
        The materials. A parameter that one of them has per point counts over all n points of the
        observations.
    index : (n,) array_like of int
        Which material each point has.

    Raises
    ------
    ValueError
        If there is no material or one of them is no BRDF, or if the index is not one-dimensional,
        not of whole numbers, or out of range.

    Notes
    -----
    The f(x, omega_i, omega_o) of section 3.1, which may differ from point to point.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Lambert, Mixed, Observations, shading
    >>> up = np.tile([0, 0, 1], (2, 1))
    >>> mixed = Mixed([Lambert(albedo=0.2), Lambert(albedo=0.6)], [0, 1])
    >>> q = Observations(positions=[[0, 0, 0], [9, 0, 0]], normals=up, directions=up,
    ...                  radiance=[0, 0], material=mixed)
    >>> S = shading(q, [[0, 0, 1], [9, 0, 1]])[:, :, 0]  # one light above each point
    >>> (np.pi * np.diag(S)).round(6).tolist()
    [0.2, 0.6]
    """

    index: Any

    __repr__ = short

    def __post_init__(self) -> None:
        self._check()
        numbers("Mixed.index", self.index)  # refuses ragged lists and text
        index = np.asarray(self.index)
        if not self.brdfs or index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
            raise ValueError("Mixed needs at least one BRDF and an integer index for each point")
        if len(index) and not 0 <= index.min() <= index.max() < len(self.brdfs):
            raise ValueError(f"Mixed.index must lie in 0 to {len(self.brdfs) - 1}")
        index = index.astype(np.uint32)
        index.setflags(write=False)
        object.__setattr__(self, "index", index)

    def check_length(self, n: int) -> None:
        """Check that the material fits n observations.

        Parameters
        ----------
        n : int
            Number of observations.

        Raises
        ------
        ValueError
            If the index has not n rows, or a parameter of a part has neither 1 row nor n.

        Examples
        --------
        >>> from lightloc import Lambert, Mixed
        >>> Mixed([Lambert(albedo=0.5)], [0, 0]).check_length(3)
        Traceback (most recent call last):
            ...
        ValueError: Mixed.index has 2 rows; expected 3
        """
        if len(self.index) != n:
            raise ValueError(f"Mixed.index has {len(self.index)} rows; expected {n}")
        super().check_length(n)

    def bind(self, n: int) -> Scatter:
        """As of `BRDF`: each point's own part."""
        self.check_length(n)
        f = types()
        which = f.UInt32(self.index)
        parts = [brdf.bind(n) for brdf in self.brdfs]

        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            mine = dr.gather(f.UInt32, which, i)
            total = parts[0](i, normal, l, w)
            for b, part in enumerate(parts[1:], start=1):
                total = dr.select(mine == b, part(i, normal, l, w), total)
            return total

        return scatter

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling | None:
        """As of `Bounded`; None where a part has no bound."""
        parts = [brdf.ceiling(cos_w) for brdf in self.brdfs if isinstance(brdf, Bounded)]
        known = [part for part in parts if part is not None]
        return ceiling.mixed(known, self.index) if len(known) == len(self.brdfs) else None
