"""Lambert, GGX conductor and GGX plastic.

Each material is a frozen value whose parameters are a scalar, an RGB triple, one value per point
(n,), or one value per point and channel (n, c).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

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
from lightloc.brdf.parameters import Parameters, bind_parameter
from lightloc.brdf.protocol import Scatter, Slope
from lightloc.reprs import short


@dataclass(frozen=True)
class Lambert(Parameters):
    """Diffuse reflection, f = albedo / pi.

    Parameters
    ----------
    albedo : float, (3,), (n,) or (n, c) array_like
        Reflectance, at least 0: one for all points, one RGB triple, one per point, or one per point
        and channel. Kept as a (1 or n, 1 or 3) array.

    Raises
    ------
    ValueError
        If the albedo is empty, negative or not finite, or has neither 1 nor 3 channels.

    Notes
    -----
    The f of section 3.1 for the diffuse surfaces that the paper works with.

    Examples
    --------
    A light of 1 W/sr straight above, 2 m away, leaves the radiance albedo / pi / 2**2:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, shading
    >>> up = [[0, 0, 1]]
    >>> q = Observations(positions=[[0, 0, 0]], normals=up, directions=up, radiance=[0],
    ...                  material=Lambert(albedo=0.5))
    >>> bool(np.isclose(shading(q, [[0, 0, 2]])[0, 0, 0], 0.5 / np.pi / 2**2))
    True
    """

    albedo: Any

    __repr__ = short

    def __post_init__(self) -> None:
        self._check("albedo", 0.0)

    def bind(self, n: int) -> Scatter:
        """As of `BRDF`: albedo / pi (n . l)_+, and 0 where the viewer is below the surface."""
        self.check_length(n)
        albedo = bind_parameter(self.albedo)
        return lambda i, normal, l, w: (
            albedo(i) * dr.select(dr.dot(normal, w) > 0, positive_cosine(normal, l) * dr.inv_pi, 0)
        )

    def bind_slope(self, n: int) -> Slope:
        """As of `Sloped`: ``S = albedo / pi (n . v)_+ / |v|^3``."""
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
        """As of `Bounded`; the bound is attained."""
        return ceiling.lambert(self.albedo, cos_w)


@dataclass(frozen=True)
class Conductor(Parameters):
    """GGX microfacet conductor, f = F D G / (4 (n . l) (n . w)), as Mitsuba's ``roughconductor``.

    Every parameter is one for all points, one RGB triple, one per point, or one per point and
    channel, and is kept as a (1 or n, 1 or 3) array.

    Parameters
    ----------
    alpha : float, (3,), (n,) or (n, c) array_like
        GGX roughness, at least 1e-4.
    eta, k : float, (3,), (n,) or (n, c) array_like, optional
        Complex index of refraction eta + i k, each at least 0. Both None makes F = 1.
    specular : float, (3,), (n,) or (n, c) array_like
        Factor on the reflectance, at least 0.

    Raises
    ------
    ValueError
        If one of ``eta`` and ``k`` is given without the other, or a parameter is empty, out of
        range or not finite, or has neither 1 nor 3 channels.

    References
    ----------
    Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007.

    Examples
    --------
    Light that is reflected straight back meets no masking, and D is 1 / (pi alpha^2) there:

    >>> import numpy as np
    >>> from lightloc import Conductor, Observations, shading
    >>> up = [[0, 0, 1]]
    >>> q = Observations(positions=[[0, 0, 0]], normals=up, directions=up, radiance=[0],
    ...                  material=Conductor(alpha=0.5))
    >>> bool(np.isclose(shading(q, [[0, 0, 1]])[0, 0, 0], 1 / (4 * np.pi * 0.5**2)))
    True
    """

    alpha: Any
    eta: Any = None
    k: Any = None
    specular: Any = 1.0

    __repr__ = short

    def __post_init__(self) -> None:
        if (self.eta is None) != (self.k is None):
            raise ValueError("Conductor needs both eta and k, or neither (F = 1)")
        self._check("alpha", SMALLEST_ALPHA)
        self._check("specular", 0.0)
        if self.eta is not None:
            self._check("eta", 0.0)
            self._check("k", 0.0)

    def bind(self, n: int) -> Scatter:
        """As of `BRDF`: F D G / (4 n . w)."""
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
        """As of `Bounded`: the peak of the lobe."""
        return ceiling.conductor(self.alpha, self.specular, cos_w)


@dataclass(frozen=True)
class Plastic(Parameters):
    """GGX dielectric coat over a diffuse base, as Mitsuba's ``roughplastic``.

    Every parameter may be one for all points or one per point; ``diffuse`` and ``specular`` may be
    an RGB triple, or one per point and channel, too. Each is kept as a (1 or n, 1 or 3) array.

    Parameters
    ----------
    alpha : float, (n,) or (n, 1) array_like
        GGX roughness of the coat, at least 1e-4.
    diffuse : float, (3,), (n,) or (n, c) array_like
        Albedo of the base, at least 0.
    ior : float, (n,) or (n, 1) array_like
        Relative index of refraction, interior over exterior, at least 1; by default polypropylene
        in air.
    specular : float, (3,), (n,) or (n, c) array_like
        Factor on the specular reflectance, at least 0.
    nonlinear : bool, (n,) or (n, 1) array_like
        Whether the colour shifts by scattering inside the coat are kept.

    Raises
    ------
    ValueError
        If a parameter is empty, out of range or not finite, or has neither 1 nor 3 channels; of
        ``alpha``, ``ior`` and ``nonlinear``, if it has 3.

    References
    ----------
    Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007.

    Examples
    --------
    A black base leaves the coat alone. Straight back it reflects ((ior - 1) / (ior + 1))^2 of the
    light:

    >>> import numpy as np
    >>> from lightloc import Observations, Plastic, shading
    >>> up = [[0, 0, 1]]
    >>> q = Observations(positions=[[0, 0, 0]], normals=up, directions=up, radiance=[0],
    ...                  material=Plastic(alpha=0.5, diffuse=0.0, ior=1.5))
    >>> bool(np.isclose(shading(q, [[0, 0, 1]])[0, 0, 0], 0.04 / (4 * np.pi * 0.5**2)))
    True
    """

    alpha: Any
    diffuse: Any = 0.5
    ior: Any = 1.4895899  # polypropylene (1.49) in air, Mitsuba's default
    specular: Any = 1.0
    nonlinear: Any = False

    __repr__ = short

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
        """As of `BRDF`: the coat, and the base seen through it."""
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
        """As of `Bounded`: the peak of the coat, and the base."""
        parts = (self.alpha, self.diffuse, self.ior, self.specular, self.nonlinear)
        return ceiling.plastic(*parts, cos_w)


SMALLEST_ALPHA = 1e-4  # Mitsuba clamps here too


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
