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
    """What a material must offer: its number of channels, and ``bind``.

    Any object that has both serves as a material: the f(x, omega_i, omega_o) of section 3.1.
    Methods ``bind_slope`` (the derivative in closed form) and ``ceiling`` (a bound), as `Lambert`
    has them, make a search faster.

    Examples
    --------
    >>> from lightloc import BRDF, Lambert
    >>> isinstance(Lambert(albedo=0.5), BRDF), isinstance(0.5, BRDF)
    (True, False)
    """

    @property
    def channels(self) -> int:
        """The number of channels: 1, or 3 for linear RGB."""
        ...

    def bind(self, n: int) -> Scatter:
        """Bind the material to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``scatter(i, normal, l, w)``: f (n . l)_+ in sr^-1, a Dr.Jit Float, or an Array3f for
            three channels. ``i`` is the index of the observation (UInt32); ``normal``, ``l`` to the
            light and ``w`` to the viewer are unit vectors (Array3f).

        Examples
        --------
        Seen and lit head-on, a diffuse surface scatters albedo / pi:

        >>> import numpy as np
        >>> from lightloc import Lambert
        >>> from lightloc.backend import types
        >>> f = types()
        >>> up = f.Array3f(0, 0, 1)
        >>> value = Lambert(albedo=0.5).bind(1)(f.UInt32(0), up, up, up)
        >>> round(np.pi * value[0], 6)
        0.5
        """
        ...


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

    def __post_init__(self) -> None:
        self._check("albedo", 0.0)

    def bind(self, n: int) -> Scatter:
        """Bind the albedo to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``scatter(i, normal, l, w)``: albedo / pi (n . l)_+ in sr^-1, and 0 where the viewer is
            below the surface; arguments as in `BRDF.bind`.

        Raises
        ------
        ValueError
            If the albedo has neither 1 row nor n.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Lambert
        >>> from lightloc.backend import types
        >>> f = types()
        >>> up, slant = f.Array3f(0, 0, 1), f.Array3f(0.6, 0, 0.8)
        >>> value = Lambert(albedo=0.5).bind(1)(f.UInt32(0), up, slant, up)
        >>> round(np.pi * value[0], 6)  # 0.5 times the cosine of the light's angle
        0.4
        """
        self.check_length(n)
        albedo = bind_parameter(self.albedo)
        return lambda i, normal, l, w: (
            albedo(i) * dr.select(dr.dot(normal, w) > 0, positive_cosine(normal, l) * dr.inv_pi, 0)
        )

    def bind_slope(self, n: int) -> Slope:
        """Bind S and its gradient to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``slope(i, normal, v, w)``: S in m^-2 sr^-1, a Dr.Jit Float or Array3f, and a list of
            its three derivatives in m^-3 sr^-1. ``v`` is the vector to the light in metres; the
            rest is as in `BRDF.bind`.

        Raises
        ------
        ValueError
            If the albedo has neither 1 row nor n.

        Notes
        -----
        Eq. 2 without its visibility: ``S = albedo / pi (n . v)_+ / |v|^3``.

        Examples
        --------
        Straight above, S falls off as 1 / d^2, so that dS / dd = -2 S / d:

        >>> from lightloc import Lambert
        >>> from lightloc.backend import types
        >>> f = types()
        >>> up = f.Array3f(0, 0, 1)
        >>> S, gradient = Lambert(albedo=0.5).bind_slope(1)(f.UInt32(0), up, f.Array3f(0, 0, 4), up)
        >>> round(gradient[2][0] / S[0], 6)
        -0.5
        """
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
        """Bound f (n . l)_+ over all directions to a light: here the bound is attained.

        Parameters
        ----------
        cos_w : (n, 1) array
            Cosine n . w of the angle at which each point is seen.

        Returns
        -------
        Ceiling
            ``flat`` and ``cosine``, each (n, c) in sr^-1: f (n . l)_+ <= flat + cosine (n . l)_+.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Lambert
        >>> from_above_and_below = np.array([[1.0], [-1.0]])
        >>> top = Lambert(albedo=0.5).ceiling(from_above_and_below)
        >>> (np.pi * top.cosine).tolist(), top.flat.tolist(), top.attained
        ([[0.5], [0.0]], [[0.0], [0.0]], True)
        """
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

    def __post_init__(self) -> None:
        if (self.eta is None) != (self.k is None):
            raise ValueError("Conductor needs both eta and k, or neither (F = 1)")
        self._check("alpha", SMALLEST_ALPHA)
        self._check("specular", 0.0)
        if self.eta is not None:
            self._check("eta", 0.0)
            self._check("k", 0.0)

    def bind(self, n: int) -> Scatter:
        """Bind the parameters to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``scatter(i, normal, l, w)``: f (n . l)_+ in sr^-1, and 0 where the light or the viewer
            is below the surface; arguments as in `BRDF.bind`.

        Raises
        ------
        ValueError
            If a parameter has neither 1 row nor n.

        Examples
        --------
        Reflected straight back, F is ((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2), here 1 / 5:

        >>> import numpy as np
        >>> from lightloc import Conductor
        >>> from lightloc.backend import types
        >>> f = types()
        >>> up = f.Array3f(0, 0, 1)
        >>> value = Conductor(alpha=0.5, eta=1, k=1).bind(1)(f.UInt32(0), up, up, up)
        >>> round(4 * np.pi * 0.5**2 * value[0], 6)
        0.2
        """
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
        """Bound f (n . l)_+ over all directions to a light, by the lobe's peak.

        Parameters
        ----------
        cos_w : (n, 1) array
            Cosine n . w of the angle at which each point is seen.

        Returns
        -------
        Ceiling
            ``flat`` and ``cosine``, each (n, c) in sr^-1: f (n . l)_+ <= flat + cosine (n . l)_+.
            Here ``cosine`` is 0.

        Examples
        --------
        Seen head-on, the peak is attained: specular / (4 pi alpha^2).

        >>> import numpy as np
        >>> from lightloc import Conductor
        >>> top = Conductor(alpha=0.5, specular=0.8).ceiling(np.array([[1.0]]))
        >>> (np.pi * top.flat).round(9).tolist(), top.cosine.tolist()
        ([[0.8]], [[0.0]])
        """
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
        """Bind the parameters to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``scatter(i, normal, l, w)``: f (n . l)_+ in sr^-1, and 0 where the light or the viewer
            is below the surface; arguments as in `BRDF.bind`.

        Raises
        ------
        ValueError
            If a parameter has neither 1 row nor n.

        Examples
        --------
        Reciprocity: f is the same from l to w as from w to l.

        >>> from lightloc import Plastic
        >>> from lightloc.backend import types
        >>> f = types()
        >>> scatter = Plastic(alpha=0.3).bind(1)
        >>> n, l, w = f.Array3f(0, 0, 1), f.Array3f(0.6, 0, 0.8), f.Array3f(0, 0.8, 0.6)
        >>> there, back = scatter(f.UInt32(0), n, l, w) / 0.8, scatter(f.UInt32(0), n, w, l) / 0.6
        >>> abs(there[0] / back[0] - 1) < 1e-5
        True
        """
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
        """Bound f (n . l)_+ over all directions to a light: the lobe's peak over the base's albedo.

        Parameters
        ----------
        cos_w : (n, 1) array
            Cosine n . w of the angle at which each point is seen.

        Returns
        -------
        Ceiling
            ``flat`` of the coat and ``cosine`` of the base, each (n, c) in sr^-1: f (n . l)_+ <=
            flat + cosine (n . l)_+.

        Examples
        --------
        Without Fresnel's factor, the coat is bounded as a conductor's lobe is:

        >>> import numpy as np
        >>> from lightloc import Conductor, Plastic
        >>> head_on = np.array([[1.0]])
        >>> coat, metal = Plastic(alpha=0.5).ceiling(head_on), Conductor(alpha=0.5).ceiling(head_on)
        >>> bool(coat.flat == metal.flat), bool(coat.cosine > 0)
        (True, True)
        """
        parts = (self.alpha, self.diffuse, self.ior, self.specular, self.nonlinear)
        return ceiling.plastic(*parts, cos_w)


@dataclass(frozen=True)
class Mixed:
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
        """The number of channels: 3 where a part has 3, else 1."""
        return max(brdf.channels for brdf in self.brdfs)

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
        for brdf in self.brdfs:
            if isinstance(brdf, (Mixed, Parameters)):
                brdf.check_length(n)

    def bind(self, n: int) -> Scatter:
        """Bind the materials to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable
            ``scatter(i, normal, l, w)``: f (n . l)_+ of the material of observation i, in sr^-1;
            arguments as in `BRDF.bind`.

        Raises
        ------
        ValueError
            If the index has not n rows, or a parameter of a part has neither 1 row nor n.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Lambert, Mixed
        >>> from lightloc.backend import types
        >>> f = types()
        >>> scatter = Mixed([Lambert(albedo=0.2), Lambert(albedo=0.6)], [0, 1]).bind(2)
        >>> up = f.Array3f(0, 0, 1)
        >>> [round(np.pi * scatter(f.UInt32(i), up, up, up)[0], 6) for i in (0, 1)]
        [0.2, 0.6]
        """
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
        """Bound f (n . l)_+ over all directions to a light, at each point by its own material.

        Parameters
        ----------
        cos_w : (n, 1) array
            Cosine n . w of the angle at which each point is seen.

        Returns
        -------
        Ceiling or None
            ``flat`` and ``cosine``, each (n, c) in sr^-1: f (n . l)_+ <= flat + cosine (n . l)_+.
            None where a part has no bound.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Lambert, Mixed
        >>> mixed = Mixed([Lambert(albedo=0.2), Lambert(albedo=0.6)], [0, 1])
        >>> (np.pi * mixed.ceiling(np.ones((2, 1))).cosine).round(9).tolist()
        [[0.2], [0.6]]
        """
        parts = [brdf.ceiling(cos_w) for brdf in self.brdfs if isinstance(brdf, Bounded)]
        known = [part for part in parts if part is not None]
        return ceiling.mixed(known, self.index) if len(known) == len(self.brdfs) else None


def is_brdf(thing: Any) -> bool:
    """Whether it has ``channels`` and ``bind``, and is not a class that makes such things."""
    return isinstance(thing, BRDF) and not isinstance(thing, type)


SMALLEST_ALPHA = 1e-4  # Mitsuba clamps here too


def evaluate(brdf: BRDF, normals: ArrayLike, l: ArrayLike, w: ArrayLike) -> NDArray[np.float64]:
    """f(x, l, w) (n . l)_+ in sr^-1 for (n, 3) unit vectors; returns (n, c).

    Examples
    --------
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
