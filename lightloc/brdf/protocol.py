"""What a material must offer, and what it may: its bound and its derivative in closed form.

``bind(n)`` turns a material into a function for Dr.Jit kernels, ``scatter(i, normal, l, w) ->
f(x_i, l, w) (n . l)_+``, where ``i`` is the index of the observation, ``l`` the unit vector to the
light and ``w`` the unit vector to the viewer. Any object with ``channels`` and ``bind`` serves:
`render` hands in Mitsuba's BSDFs in that way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.brdf.ceiling import Ceiling
from lightloc.brdf.parameters import channels_last

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

    Examples
    --------
    >>> from lightloc import Lambert
    >>> from lightloc.brdf import Bounded
    >>> isinstance(Lambert(albedo=0.5), Bounded)
    True
    """

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling | None:
        """Bound f (n . l)_+ over all directions to a light.

        Parameters
        ----------
        cos_w : (n, 1) array
            Cosine n . w of the angle at which each point is seen.

        Returns
        -------
        Ceiling or None
            ``flat`` and ``cosine``, each (n, c) in sr^-1: f (n . l)_+ <= flat + cosine (n . l)_+.
            None where nothing is known.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Lambert
        >>> top = Lambert(albedo=0.5).ceiling(np.array([[1.0], [-1.0]]))  # from above, from below
        >>> (np.pi * top.cosine).tolist(), top.flat.tolist(), top.attained
        ([[0.5], [0.0]], [[0.0], [0.0]], True)
        """
        ...


@runtime_checkable
class Sloped(BRDF, Protocol):
    """A material with a closed form of the derivative: faster than differentiating ``scatter``.

    Examples
    --------
    >>> from lightloc import Conductor, Lambert
    >>> from lightloc.brdf import Sloped
    >>> [isinstance(material, Sloped) for material in (Lambert(albedo=0.5), Conductor(alpha=0.5))]
    [True, False]
    """

    def bind_slope(self, n: int) -> Slope | None:
        """Bind S and its gradient to n observations, for use inside kernels.

        Parameters
        ----------
        n : int
            Number of observations.

        Returns
        -------
        callable or None
            ``slope(i, normal, v, w)``: S of Eq. 2 without its visibility, f (n . l)_+ / |v|^2 in
            m^-2 sr^-1, a Dr.Jit Float or Array3f, and its three derivatives in v, the vector to
            the light. The rest is as in `BRDF.bind`. None where nothing is known.

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
        ...


def is_brdf(thing: Any) -> bool:
    """Whether it has ``channels`` and ``bind``, and is not a class that makes such things."""
    return isinstance(thing, BRDF) and not isinstance(thing, type)


def evaluate(brdf: BRDF, normals: ArrayLike, l: ArrayLike, w: ArrayLike) -> NDArray[np.float64]:
    """f(x, l, w) (n . l)_+ in sr^-1 for (n, 3) unit vectors; returns (n, c).

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Lambert
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
