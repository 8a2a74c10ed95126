"""Observations inside kernels: what is gathered for a pair (q, p), and S(q, p) of it (Eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import doubles, reals, types
from lightloc.brdf import BRDF, Scatter, Slope, Sloped, is_traced
from lightloc.given import RAY_OFFSET, Geometry, Observations, reach


@dataclass(frozen=True)
class Surfels:
    """Observations as Dr.Jit arrays, ready for kernels that gather them by index."""

    n: int
    x: Any
    normal: Any
    w: Any
    facet: Any  # geometric normals
    origin: Any  # x moved off its surface, where shadow rays begin
    scatter: Scatter
    flat: bool  # facets are the normals: below one, nothing scatters anyway
    slope: Slope | None = None  # the derivative of S in closed form, where the material has one
    material: BRDF | None = None  # what ``scatter`` was bound from, where it is known
    double: bool = False  # whether kernels over these compute in 64 bits
    traced: bool = True  # whether loops within a kernel can evaluate ``scatter``

    def take(self, some: NDArray[np.intp]) -> Surfels:
        """Some of the surfels, renumbered from 0."""
        with doubles(self.double):
            return self._take(some)

    def _take(self, some: NDArray[np.intp]) -> Surfels:
        f = types()
        rows = f.UInt32(np.asarray(some, np.uint32))
        scatter, slope = self.scatter, self.slope

        def scatter_some(i: Any, normal: Any, l: Any, w: Any) -> Any:
            return scatter(dr.gather(f.UInt32, rows, i), normal, l, w)

        def slope_some(i: Any, normal: Any, v: Any, w: Any) -> tuple[Any, Any]:
            assert slope is not None
            return slope(dr.gather(f.UInt32, rows, i), normal, v, w)

        columns = (self.x, self.normal, self.w, self.facet, self.origin)
        x, normal, w, facet, origin = (pick(v, rows) for v in columns)
        dr.eval(x, normal, w, facet, origin)
        return Surfels(
            n=len(some),
            x=x,
            normal=normal,
            w=w,
            facet=facet,
            origin=origin,
            scatter=scatter_some,
            flat=self.flat,
            slope=slope_some if slope else None,
            double=self.double,
            traced=self.traced,
        )


def surfels(q: Observations, geometry: Geometry | None = None, *, double: bool = False) -> Surfels:
    """Move observations into Dr.Jit arrays once; every kernel gathers from these.

    The geometry is the one that their shadow rays are cast in. With ``double`` kernels compute in
    64 bits, but for those rays.
    """
    bounds = getattr(geometry, "bounds", None)
    offset = RAY_OFFSET * reach(q.positions, q.bounds if bounds is None else bounds)
    with doubles(double):
        return Surfels(
            n=len(q),
            x=columns(q.positions),
            normal=columns(q.normals),
            w=columns(q.directions),
            facet=columns(q.facets),
            origin=columns(q.positions + offset * q.facets),
            scatter=q.material.bind(len(q)),
            flat=bool((q.facets == q.normals).all()),
            slope=q.material.bind_slope(len(q)) if isinstance(q.material, Sloped) else None,
            material=q.material,
            double=double,
            traced=is_traced(q.material),
        )


def columns(v: NDArray[np.float64]) -> Any:
    """An (n, 3) array as an Array3f."""
    return types().Array3f(*(reals(column) for column in v.T))


def pick(v: Any, i: Any) -> Any:
    """Gather rows i of a column-wise Array3f."""
    kind = type(v)
    real = dr.value_t(kind)
    return kind(*(dr.gather(real, column, i) for column in v))


def unoccluded(s: Surfels, i: Any, p: Any) -> Any:
    """S(q_i, p) with V = 1: f(x, l, w) (n . l)_+ / |p - x|^2, a Float or an Array3f."""
    to_light = p - pick(s.x, i)
    d2 = dr.squared_norm(to_light)
    l = to_light * dr.rsqrt(d2)
    return s.scatter(i, pick(s.normal, i), l, pick(s.w, i)) / d2


def unoccluded_slope(s: Surfels, i: Any, p: Any) -> tuple[Any, list[Any]]:
    """S(q_i, p) with V = 1 and its gradient in p: a Float or an Array3f, and three of them.

    In closed form where the material has one; else by reverse automatic differentiation, once a
    channel. The gradient is 0 where S is, and where S is finite and it is not: that of a BRDF of
    somebody else's may be none along an edge.
    """
    x, normal, w = pick(s.x, i), pick(s.normal, i), pick(s.w, i)
    if s.slope:
        return s.slope(i, normal, p - x, w)
    channels = 1 if dr.depth_v(unoccluded(s, i, p)) == 1 else 3
    values, gradients = [], []
    for channel in range(channels):
        here = type(p)(p)
        dr.enable_grad(here)
        value = unoccluded(s, i, here)
        value = value if channels == 1 else value[channel]
        dr.backward(value)
        slope = dr.grad(here)
        value = dr.detach(value)
        values.append(value)
        beyond = ~dr.isfinite(value)  # a light on the observation itself
        gradients.append([dr.select((value > 0) & (dr.isfinite(a) | beyond), a, 0) for a in slope])
    if channels == 1:
        return values[0], gradients[0]
    colour = type(p)
    return colour(*values), [colour(*(g[axis] for g in gradients)) for axis in range(3)]


def visible(s: Surfels, i: Any, p: Any, geometry: Geometry | None, active: Any = True) -> Any:
    """V(x_i, p) as a mask: p lies above the facet, and nothing is in between."""
    active = (dr.dot(pick(s.facet, i), p - pick(s.x, i)) > 0) & active
    if geometry is None:
        return active
    origin = pick(s.origin, i)
    if s.double:
        with doubles(False):
            single = types().Array3f
        origin, p = single(origin), single(p)
    return geometry.visible(origin, p, active)


def shade(s: Surfels, i: Any, p: Any, geometry: Geometry | None) -> Any:
    """S(q_i, p) of Eq. 2."""
    value = unoccluded(s, i, p)
    lit = value > 0 if dr.depth_v(value) == 1 else dr.any(value > 0)
    return dr.select(visible(s, i, p, geometry, lit), value, 0)
