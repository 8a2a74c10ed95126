"""BRDFs: Lambert, GGX conductor, GGX plastic, and a mixture that picks one per point.

Each material is a frozen value whose parameters are a scalar, an RGB triple, one value per point
(n,), or one value per point and channel (n, c). ``bind(n)`` turns it into a function for Dr.Jit
kernels, ``scatter(i, normal, l, w) -> f(x_i, l, w) (n . l)_+``, where ``i`` is the index of the
observation, ``l`` the unit vector to the light and ``w`` the unit vector to the viewer.
Any other object with ``channels`` and ``bind`` serves as well: `render` hands in Mitsuba's BSDFs
in that way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import reals, types
from lightloc.brdf import ceiling
from lightloc.brdf.ceiling import Ceiling
from lightloc.brdf.microfacet import (
    TABLE_NODES,
    fresnel_conductor,
    fresnel_dielectric,
    ggx,
    smith,
    transmittance_table,
)
from lightloc.brdf.parameters import Parameters, bind_parameter, channels_last
from lightloc.checks import numbers

Scatter = Callable[[Any, Any, Any, Any], Any]
Slope = Callable[[Any, Any, Any, Any], tuple[Any, Any]]


@runtime_checkable
class BRDF(Protocol):
    """What a material must offer: its channels (1 or 3) and ``bind``."""

    @property
    def channels(self) -> int: ...

    def bind(self, n: int) -> Scatter: ...


@runtime_checkable
class Bounded(BRDF, Protocol):
    """A material that can say what f (n . l)_+ is at most, so that fields can cull.

    ``cos_w`` (n, 1) is n . w at each of n points.
    """

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling | None: ...


@runtime_checkable
class Sloped(BRDF, Protocol):
    """A material with a closed form of the derivative: faster than differentiating ``scatter``.

    ``bind_slope(n)`` gives ``slope(i, normal, v, w) -> (S, dS/dv)`` with v the vector to the
    light, whose length counts: S = f (n . l)_+ / |v|^2, Eq. 2 without its visibility.
    """

    def bind_slope(self, n: int) -> Slope: ...


@dataclass(frozen=True)
class Lambert(Parameters):
    """Diffuse reflection, f = albedo / pi.

    >>> Lambert(albedo=0.5).channels, Lambert(albedo=[0.5, 0.4, 0.3]).channels
    (1, 3)
    """

    albedo: Any

    def __post_init__(self) -> None:
        self._check("albedo", 0.0)

    def bind(self, n: int) -> Scatter:
        self.check_length(n)
        albedo = bind_parameter(self.albedo)
        return lambda i, normal, l, w: (
            albedo(i) * dr.select(dr.dot(normal, w) > 0, positive_cosine(normal, l) * dr.inv_pi, 0)
        )

    def bind_slope(self, n: int) -> Slope:
        """``S = albedo / pi (n . v)_+ / |v|^3``, and its gradient in v: one per channel."""
        self.check_length(n)
        albedo = bind_parameter(self.albedo)

        def slope(i: Any, normal: Any, v: Any, w: Any) -> tuple[Any, list[Any]]:
            inverse2 = dr.rcp(dr.squared_norm(v))
            along = dr.dot(normal, v)
            lit = (along > 0) & (dr.dot(normal, w) > 0)
            steep = dr.select(lit, inverse2 * dr.sqrt(inverse2) * dr.inv_pi, 0)
            turn = normal - v * (3 * along * inverse2)
            return albedo(i) * (steep * along), [albedo(i) * (steep * a) for a in turn]

        return slope

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling:
        return ceiling.lambert(self.albedo, cos_w)


@dataclass(frozen=True)
class Conductor(Parameters):
    """GGX microfacet conductor, f = F D G / (4 (n.l)(n.w)), as Mitsuba's ``roughconductor``.

    Args:
        alpha: GGX roughness, above 0.
        eta, k: complex index of refraction; None (both) makes F = 1.
        specular: factor on the reflectance.
    """

    alpha: Any
    eta: Any = None
    k: Any = None
    specular: Any = 1.0

    def __post_init__(self) -> None:
        if (self.eta is None) != (self.k is None):
            raise ValueError("Conductor needs both eta and k, or neither (F = 1)")
        self._check("alpha", SMALLEST_ALPHA)
        self._check("specular", 0.0)
        if self.eta is not None:
            self._check("eta", 0.0)
            self._check("k", 0.0)

    def bind(self, n: int) -> Scatter:
        self.check_length(n)
        alpha, specular = bind_parameter(self.alpha), bind_parameter(self.specular)
        eta = None if self.eta is None else bind_parameter(self.eta)
        k = None if self.k is None else bind_parameter(self.k)

        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            lit, value, cos_h = _microfacet(alpha(i), normal, l, w)
            value = value * specular(i)
            if eta is not None and k is not None:
                value = value * fresnel_conductor(cos_h, eta(i), k(i))
            return dr.select(lit, value, 0)

        return scatter

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling:
        return ceiling.conductor(self.alpha, self.specular, cos_w)


@dataclass(frozen=True)
class Plastic(Parameters):
    """GGX dielectric coat over a diffuse base, as Mitsuba's ``roughplastic``.

    Args:
        alpha: GGX roughness, above 0 (a scalar or one per point).
        diffuse: albedo of the base.
        ior: relative index of refraction (interior / exterior), above 1.
        specular: factor on the specular reflectance.
        nonlinear: whether colour shifts by scattering inside the coat are kept.
    """

    alpha: Any
    diffuse: Any = 0.5
    ior: Any = 1.4895899  # polypropylene (1.49) in air, Mitsuba's default
    specular: Any = 1.0
    nonlinear: Any = False

    def __post_init__(self) -> None:
        self._check("alpha", SMALLEST_ALPHA)
        self._check("diffuse", 0.0)
        self._check("ior", 1.0)
        self._check("specular", 0.0)
        self._check("nonlinear", 0.0, 1.0)
        for name in ("alpha", "ior", "nonlinear"):
            if getattr(self, name).shape[1] != 1:
                raise ValueError(
                    f"Plastic.{name} has 3 channels; expected 1 (a row for each point)"
                )

    def bind(self, n: int) -> Scatter:
        self.check_length(n)
        f = types()
        pairs = np.concatenate(np.broadcast_arrays(self.alpha, self.ior), axis=1)
        unique, row = np.unique(pairs, axis=0, return_inverse=True)
        tables, internal = zip(*(transmittance_table(a, eta) for a, eta in unique), strict=True)
        table = reals(np.concatenate(tables))
        row_of = bind_parameter(row.reshape(-1, 1) * float(TABLE_NODES))
        inside = bind_parameter(np.asarray(internal)[row.reshape(-1)][:, None])
        alpha, ior = bind_parameter(self.alpha), bind_parameter(self.ior)
        diffuse, specular = bind_parameter(self.diffuse), bind_parameter(self.specular)
        nonlinear = bind_parameter(self.nonlinear)

        def transmitted(i: Any, cosine: Any) -> Any:
            x = dr.clip(cosine, 0, 1) * (TABLE_NODES - 1)
            cell = dr.minimum(f.UInt32(dr.detach(x)), TABLE_NODES - 2)
            at = f.UInt32(row_of(i)) + cell
            t = x - f.Float(cell)
            return dr.lerp(dr.gather(f.Float, table, at), dr.gather(f.Float, table, at + 1), t)

        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            lit, value, cos_h = _microfacet(alpha(i), normal, l, w)
            cos_l, cos_w = dr.dot(normal, l), dr.dot(normal, w)
            base = diffuse(i)
            base = base / (1 - inside(i) * dr.lerp(base * 0 + 1, base, nonlinear(i)))
            both = transmitted(i, cos_l) * transmitted(i, cos_w)
            base = base * (cos_l * both * dr.inv_pi / dr.square(ior(i)))
            return dr.select(lit, value * fresnel_dielectric(cos_h, ior(i)) * specular(i) + base, 0)

        return scatter

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling:
        parts = (self.alpha, self.diffuse, self.ior, self.specular, self.nonlinear)
        return ceiling.plastic(*parts, cos_w)


@dataclass(frozen=True)
class Mixed:
    """A different BRDF at each point: point i has ``brdfs[index[i]]``.

    A parameter given one per point counts over all n points of the observations.
    """

    brdfs: tuple[BRDF, ...]
    index: Any

    def __post_init__(self) -> None:
        if is_brdf(self.brdfs) or not all(is_brdf(brdf) for brdf in self.brdfs):
            raise ValueError("Mixed.brdfs is not a sequence of BRDFs")
        object.__setattr__(self, "brdfs", tuple(self.brdfs))
        numbers("Mixed.index", self.index)  # refuses ragged lists and text
        index = np.asarray(self.index)
        if not self.brdfs or index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
            raise ValueError("Mixed needs at least one BRDF and an integer index for each point")
        if len(index) and not 0 <= index.min() <= index.max() < len(self.brdfs):
            raise ValueError(f"Mixed.index must lie in 0 to {len(self.brdfs) - 1}")
        object.__setattr__(self, "index", index.astype(np.uint32))

    @property
    def channels(self) -> int:
        return max(brdf.channels for brdf in self.brdfs)

    def check_length(self, n: int) -> None:
        """Raise ValueError where the index, or a parameter of a part, has not n rows."""
        if len(self.index) != n:
            raise ValueError(f"Mixed.index has {len(self.index)} rows; expected {n}")
        for brdf in self.brdfs:
            if isinstance(brdf, (Mixed, Parameters)):
                brdf.check_length(n)

    def bind(self, n: int) -> Scatter:
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
        parts = [brdf.ceiling(cos_w) for brdf in self.brdfs if isinstance(brdf, Bounded)]
        known = [part for part in parts if part is not None]
        return ceiling.mixed(known, self.index) if len(known) == len(self.brdfs) else None


def is_brdf(thing: Any) -> bool:
    """Whether it has ``channels`` and ``bind``, and is not a class that makes such things."""
    return isinstance(thing, BRDF) and not isinstance(thing, type)


SMALLEST_ALPHA = 1e-4  # Mitsuba clamps here too


def evaluate(brdf: BRDF, normals: ArrayLike, l: ArrayLike, w: ArrayLike) -> NDArray[np.float64]:
    """f(x, l, w) (n . l)_+ for (n, 3) unit vectors; returns (n, c).

    >>> import numpy as np
    >>> up = [[0.0, 0.0, 1.0]]
    >>> bool(np.isclose(evaluate(Lambert(albedo=0.5), up, up, up)[0, 0], 0.5 / np.pi))
    True
    """
    f = types()
    normals, l, w = (np.asarray(v, np.float32) for v in (normals, l, w))
    value = brdf.bind(len(normals))(
        dr.arange(f.UInt32, len(normals)), f.Array3f(normals.T), f.Array3f(l.T), f.Array3f(w.T)
    )
    return channels_last(value, len(normals))


def positive_cosine(normal: Any, l: Any) -> Any:
    return dr.maximum(dr.dot(normal, l), 0)


def _microfacet(alpha: Any, normal: Any, l: Any, w: Any) -> tuple[Any, Any, Any]:
    """Whether both directions are above the surface; D G / (4 n.w), which is f (n.l) without its
    Fresnel term; the cosine for Fresnel. To be selected last: a derivative that is not finite
    below the horizon must not meet a product."""
    cos_l, cos_w = dr.dot(normal, l), dr.dot(normal, w)
    h = dr.normalize(l + w)
    value = ggx(alpha, normal, h) * smith(alpha, normal, l) * smith(alpha, normal, w)
    return (cos_l > 0) & (cos_w > 0), value / (4 * cos_w), dr.dot(w, h)
