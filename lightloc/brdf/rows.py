"""The materials of some of the observations, and whether kernels can hold a material."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.brdf.in_numpy import FromNumPy
from lightloc.brdf.mixed import Mixed
from lightloc.brdf.parameters import Parameters
from lightloc.brdf.parts import Parts
from lightloc.brdf.protocol import BRDF, Scatter
from lightloc.brdf.sum import Sum


@dataclass(frozen=True)
class Rows:
    """Some rows of a material of ``n`` points that lightloc can't take apart."""

    material: BRDF
    rows: NDArray[np.intp] = field(repr=False)
    n: int

    @property
    def channels(self) -> int:
        return self.material.channels

    def bind(self, n: int) -> Scatter:
        if len(self.rows) != n:
            raise ValueError(f"the material has {len(self.rows)} points; expected {n}")
        f, whole = types(), self.material.bind(self.n)
        of = f.UInt32(self.rows.astype(np.uint32))
        return lambda i, normal, l, w: whole(dr.gather(f.UInt32, of, i), normal, l, w)


def rows_of(material: BRDF, rows: NDArray[np.intp], n: int) -> BRDF:
    """The material of some of n points, by their (m,) indices.

    Examples
    --------
    >>> from lightloc.brdf import Lambert
    >>> rows_of(Lambert(albedo=[0.1, 0.2, 0.4, 0.8]), np.array([3, 0]), 4).albedo.ravel().tolist()
    [0.8, 0.1]
    """
    if isinstance(material, Mixed):
        parts = tuple(rows_of(part, rows, n) for part in material.brdfs)
        return Mixed(parts, material.index[rows])
    if isinstance(material, Sum):
        return Sum(tuple(rows_of(part, rows, n) for part in material.brdfs))
    if not isinstance(material, Parameters):
        return Rows(material, rows, n)
    some = copy(material)
    for name, value in material.parameters().items():
        object.__setattr__(some, name, value if len(value) == 1 else value[rows])
    return some


def is_traced(material: BRDF) -> bool:
    """Whether a kernel can hold the material: not where it has to stop and call NumPy.

    Examples
    --------
    >>> from lightloc.brdf import FromNumPy, Lambert, Sum
    >>> slow = FromNumPy(lambda i, normals, l, w: np.ones(len(i)))
    >>> is_traced(Lambert(albedo=0.5)), is_traced(Sum([Lambert(albedo=0.5), slow]))
    (True, False)
    """
    if isinstance(material, Parts):
        return all(is_traced(part) for part in material.brdfs)
    if isinstance(material, Rows):
        return is_traced(material.material)
    return not isinstance(material, FromNumPy)
