"""The shading function S(q, p) of Eq. 2, its gradient in p, and Eq. 4 that sums it up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.brdf import BRDF, Scatter
from lightloc.checks import array
from lightloc.geometry import RAY_OFFSET, Geometry
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.parameters import channels_last

LANES = 1 << 22
"""Most (q, p) pairs in one kernel launch: 4 Mi pairs keep temporaries under 200 MB."""


@dataclass(frozen=True)
class Surfels:
    """Observations as Dr.Jit arrays, ready for kernels that gather them by index."""

    n: int
    x: Any
    normal: Any
    w: Any
    facet: Any  # geometric normals
    start: Any  # x moved off its surface, where shadow rays begin
    scatter: Scatter
    flat: bool  # facets are the normals: below one, nothing scatters anyway
    material: BRDF | None = None  # what ``scatter`` was bound from, where it is known

    def take(self, some: NDArray) -> Surfels:
        """Some of the surfels, renumbered from 0."""
        f = types()
        rows = f.UInt32(np.asarray(some, np.uint32))
        scatter = self.scatter

        def scatter_some(i: Any, normal: Any, l: Any, w: Any) -> Any:
            return scatter(dr.gather(f.UInt32, rows, i), normal, l, w)

        columns = (self.x, self.normal, self.w, self.facet, self.start)
        x, normal, w, facet, start = (pick(v, rows) for v in columns)
        dr.eval(x, normal, w, facet, start)
        return Surfels(len(some), x, normal, w, facet, start, scatter_some, self.flat)


def surfels(q: Observations) -> Surfels:
    """Move observations into Dr.Jit arrays once; every kernel gathers from these."""
    f = types()

    def columns(v: NDArray) -> Any:
        return f.Array3f(*(f.Float(column.astype(np.float32)) for column in v.T))

    offset = RAY_OFFSET * (1 + np.abs(q.positions).max(axis=1, keepdims=True))
    return Surfels(
        n=len(q),
        x=columns(q.positions),
        normal=columns(q.normals),
        w=columns(q.directions),
        facet=columns(q.facets),
        start=columns(q.positions + offset * q.facets),
        scatter=q.material.bind(len(q)),
        flat=bool((q.facets == q.normals).all()),
        material=q.material,
    )


def pick(v: Any, i: Any) -> Any:
    """Gather rows i of a column-wise Array3f."""
    f = types()
    return f.Array3f(*(dr.gather(f.Float, column, i) for column in v))


def unoccluded(s: Surfels, i: Any, p: Any) -> Any:
    """S(q_i, p) with V = 1: f(x, l, w) (n . l)_+ / |p - x|^2, a Float or an Array3f."""
    to_light = p - pick(s.x, i)
    d2 = dr.squared_norm(to_light)
    l = to_light * dr.rsqrt(d2)
    return s.scatter(i, pick(s.normal, i), l, pick(s.w, i)) / d2


def visible(s: Surfels, i: Any, p: Any, geometry: Geometry | None, active: Any = True) -> Any:
    """V(x_i, p) as a mask: p lies above the facet, and nothing is in between."""
    active = (dr.dot(pick(s.facet, i), p - pick(s.x, i)) > 0) & active
    if geometry is None:
        return active
    return geometry.visible(pick(s.start, i), p, active)


def shade(s: Surfels, i: Any, p: Any, geometry: Geometry | None) -> Any:
    """S(q_i, p) of Eq. 2."""
    value = unoccluded(s, i, p)
    lit = value > 0 if dr.depth_v(value) == 1 else dr.any(value > 0)
    return dr.select(visible(s, i, p, geometry, lit), value, 0)


def shading(
    q: Observations | Surfels, positions: ArrayLike, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """S(q, p) of Eq. 2 for every observation and every one of (k, 3) positions, m^-2 sr^-1.

    Returns (n, k, c). The radiance of lights there is ``S @ intensities``.

    >>> import numpy as np
    >>> from lightloc import Lambert
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=1.0))
    >>> S = shading(q, [[0, 0, 2]])
    >>> bool(np.isclose(S[0, 0, 0], 1 / np.pi / 2**2, rtol=1e-6))
    True
    """
    s = q if isinstance(q, Surfels) else surfels(q)
    blocks = []
    for i, p, k in _pairs(s.n, positions):
        value = shade(s, i, p, geometry)
        blocks.append(channels_last(value, s.n * k).reshape(k, s.n, -1))
    return np.concatenate(blocks).transpose(1, 0, 2)


def shading_gradient(
    q: Observations | Surfels, positions: ArrayLike, geometry: Geometry | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """S(q, p) and dS/dp at (k, 3) positions: (n, k, c) and (n, k, c, 3).

    Derivatives by forward automatic differentiation through the BRDF, whatever it is; V is held
    constant, as it is everywhere but on a shadow's edge, and the gradient is 0 where S is.
    """
    s = q if isinstance(q, Surfels) else surfels(q)
    f = types()
    values, gradients = [], []
    for i, p, k in _pairs(s.n, positions):
        plain = dr.detach(unoccluded(s, i, p))
        seen = visible(s, i, p, geometry)
        along = []
        for axis in range(3):
            t = f.Float(0)
            dr.enable_grad(t)
            moved = f.Array3f(*(p[a] + t if a == axis else p[a] for a in range(3)))
            value = unoccluded(s, i, moved)
            dr.set_grad(t, 1)
            dr.forward_to(value)
            along.append(dr.select(seen & (plain > 0), dr.grad(value), 0))
        plain = dr.select(seen, plain, 0)
        dr.eval(plain, along)
        size = s.n * k
        values.append(channels_last(plain, size).reshape(k, s.n, -1))
        gradients.append(
            np.stack([channels_last(a, size) for a in along], axis=-1).reshape(k, s.n, -1, 3)
        )
    return (
        np.concatenate(values).transpose(1, 0, 2),
        np.concatenate(gradients).transpose(1, 0, 2, 3),
    )


def radiance(
    q: Observations | Surfels, lights: PointLights, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """Direct radiance of ``lights`` at the observations, Eq. 4: (n, c)."""
    if not len(lights):
        n = q.n if isinstance(q, Surfels) else len(q)
        return np.zeros((n, lights.channels))
    S = shading(q, lights.positions, geometry)
    return np.einsum(
        "nkc,kc->nc",
        np.broadcast_to(S, (*S.shape[:2], max(S.shape[2], lights.channels))),
        lights.intensities,
    )


def check_gradient(
    q: Observations, position: ArrayLike, geometry: Geometry | None = None, step: float = 1e-3
) -> float:
    """The worst disagreement of `shading_gradient` with central differences at one position.

    Returns max |AD - FD| / max |FD| over the observations that are visible at all six shifted
    positions. The differences are of float32 values: with ``step`` in metres, expect
    about 1e-7 / step + step^2.
    """
    p = array("position", position, (3,))
    moves = step * np.concatenate([np.eye(3), -np.eye(3)])
    S, gradient = shading_gradient(q, p[None], geometry)
    around = shading(q, p + moves, geometry)
    smooth = (around > 0).all(axis=(1, 2)) & (S[:, 0] > 0).all(axis=1)
    if not smooth.any():
        raise ValueError("check_gradient: no observation sees all of the shifted positions")
    slope = (around[:, :3] - around[:, 3:]) / (2 * step)
    error = np.abs(slope.transpose(0, 2, 1) - gradient[:, 0])[smooth]
    return float(error.max(initial=0.0) / max(np.abs(slope[smooth]).max(initial=0.0), 1e-30))


def _pairs(n: int, positions: ArrayLike) -> Iterator[tuple[Any, Any, int]]:
    """Blocks of all pairs of n observations and (k, 3) positions: index, position, count."""
    f = types()
    points = array("positions", positions, (None, 3))
    rows = max(1, LANES // n)
    for first in range(0, len(points), rows):
        block = points[first : first + rows].astype(np.float32)
        lane = dr.arange(f.UInt32, n * len(block))
        which = lane // n
        table = f.Array3f(*(f.Float(column) for column in block.T))
        yield lane - which * n, pick(table, which), len(block)
