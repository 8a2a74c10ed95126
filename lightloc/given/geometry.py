"""What lightloc must know of a scene's geometry: two questions, answered inside kernels."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.given.observations import Observations

RAY_OFFSET = 8.9e-5
"""How far off its surface a shadow ray starts, as a share of its `reach`: Mitsuba's ray epsilon."""


def reach(positions: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 1) the lengths that the rounding of (n, 3) positions on surfaces within bounds goes by.

    Mitsuba's is 1 + max|x|, so that a scene much smaller than one unit of length is left by the
    very rays that begin in it. Here the 1 is the diagonal where that is less.

    Examples
    --------
    >>> box = np.array([[0.0, 0, 0], [0.3, 0.4, 0]])
    >>> reach(np.array([[0.1, -0.2, 0]]), box).round(3).tolist(), reach(box[1:], 10 * box).tolist()
    ([[0.7]], [[1.4]])
    """
    size = min(1.0, float(np.linalg.norm(np.ptp(bounds, axis=0))))
    return np.asarray(size + np.abs(positions).max(axis=1, keepdims=True))


@runtime_checkable
class Geometry(Protocol):
    """What occludes, as a value with two functions over Dr.Jit arrays.

    Any object with these methods serves; `render.SceneGeometry` is one of a Mitsuba scene. Where
    ``geometry=None`` is accepted, nothing occludes.

    Notes
    -----
    Section 3.1 calls it G.

    Examples
    --------
    A ceiling at z = 2 hides what is above it from a point below:

    >>> from lightloc import Geometry, Lambert, Observations, shading
    >>> class Ceiling:
    ...     def visible(self, x, p, active=True):
    ...         return ((x[2] < 2) == (p[2] < 2)) & active
    ...     def intersect(self, x, d, active=True):
    ...         t = (2 - x[2]) / d[2]
    ...         return (t > 0) & active, x + t * d
    >>> geometry: Geometry = Ceiling()
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=0.5))
    >>> (shading(q, [[0, 0, 1], [0, 0, 3]], geometry)[0, :, 0] > 0).tolist()
    [True, False]
    """

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """Tell whether the segments between points are free: V(x, p) of Eq. 1.

        Parameters
        ----------
        x : Array3f
            One end of each of m segments, in the unit of length. Whoever asks has moved it a little
            off its own surface.
        p : Array3f
            The other end.
        active : Bool, optional
            Which of them are asked; all where True.

        Returns
        -------
        Bool
            Whether each is free; False where it was not asked.

        Examples
        --------
        >>> from lightloc.backend import types
        >>> f = types()
        >>> class Ceiling:
        ...     def visible(self, x, p, active=True):
        ...         return ((x[2] < 2) == (p[2] < 2)) & active
        >>> Ceiling().visible(f.Array3f(0, 0, 0), f.Array3f(0, 0, [1, 3])).numpy().tolist()
        [True, False]
        """
        ...

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """Find the first surface points along rays x + t d, t > 0.

        Parameters
        ----------
        x : Array3f
            Where the m rays begin, in the unit of length.
        d : Array3f
            Their directions.
        active : Bool, optional
            Which of them are asked; all where True.

        Returns
        -------
        hit : Bool
            Whether each meets a surface; False where it was not asked.
        y : Array3f
            Where it does, in the unit of length; anywhere where it meets none.

        Examples
        --------
        >>> from lightloc.backend import types
        >>> f = types()
        >>> class Ceiling:
        ...     def intersect(self, x, d, active=True):
        ...         t = (2 - x[2]) / d[2]
        ...         return (t > 0) & active, x + t * d
        >>> hit, y = Ceiling().intersect(f.Array3f(0, 0, 0), f.Array3f(1, 0, [1, -1]))
        >>> hit.numpy().tolist(), y.numpy()[:, 0].tolist()
        ([True, False], [2.0, 0.0, 2.0])
        """
        ...


@runtime_checkable
class Interreflecting(Geometry, Protocol):
    """A geometry that knows its materials too, and can render the light between its surfaces.

    `localize` asks it where ``indirect`` is a number of samples. `render.SceneGeometry` is one.

    Examples
    --------
    >>> from lightloc import Interreflecting
    >>> class Ceiling:
    ...     def visible(self, x, p, active=True):
    ...         return ((x[2] < 2) == (p[2] < 2)) & active
    ...     def intersect(self, x, d, active=True):
    ...         t = (2 - x[2]) / d[2]
    ...         return (t > 0) & active, x + t * d
    >>> isinstance(Ceiling(), Interreflecting)  # it knows no materials
    False
    """

    def interreflection(
        self, positions: ArrayLike, observations: Observations, samples: int, seed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Render the interreflected radiance of lights of intensity 1.

        Parameters
        ----------
        positions : (k, 3) array_like
            Positions of the lights, in the unit of length.
        observations : Observations
            The n observations: what is seen, and from where.
        samples : int
            Paths per observation and light.
        seed : int
            Seed of the paths: the i-th light has the same ones in every call, wherever it is.

        Returns
        -------
        H : (n, k, c) array
            Interreflected radiance per W/sr, m^-2 sr^-1: ``H @ intensities`` is that of all lights.
        error : (n, k, c) array
            Its standard error, independent from light to light.

        Examples
        --------
        In a diffuse sphere of radius 1 it is the same everywhere, wherever the light is:

        >>> import numpy as np
        >>> from lightloc import Lambert, Observations
        >>> class Ball:
        ...     def interreflection(self, positions, observations, samples, seed):
        ...         a = observations.material.albedo
        ...         H = np.full((len(observations), len(positions), 1), a**2 / (1 - a) / np.pi)
        ...         return H, np.zeros_like(H)
        >>> q = Observations(positions=[[0, 0, -1]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
        ...                  radiance=[0.0], material=Lambert(albedo=0.5))
        >>> H, error = Ball().interreflection([[0, 0, 0], [0, 0, 0.5]], q, 64, 0)
        >>> (np.pi * H[0, :, 0]).tolist()
        [0.5, 0.5]
        """
        ...


@runtime_checkable
class OtherwiseLit(Geometry, Protocol):
    """A geometry that knows of light from emitters that are not to be found, and can render it.

    `localize` subtracts it first, with its error. `render.SceneGeometry` is one.

    Examples
    --------
    >>> from lightloc import OtherwiseLit
    >>> class Ceiling:
    ...     def visible(self, x, p, active=True):
    ...         return ((x[2] < 2) == (p[2] < 2)) & active
    ...     def intersect(self, x, d, active=True):
    ...         t = (2 - x[2]) / d[2]
    ...         return (t > 0) & active, x + t * d
    >>> isinstance(Ceiling(), OtherwiseLit)  # it knows no emitters
    False
    """

    def known_light(
        self, observations: Observations, samples: int, seed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Render the radiance by the known emitters.

        Parameters
        ----------
        observations : Observations
            The n observations: what is seen, and from where. Interreflected light of the known
            emitters belongs to it where they hold such light.
        samples : int
            Paths per observation.
        seed : int
            Seed of the paths.

        Returns
        -------
        B : (n, c) array
            Radiance, W sr^-1 m^-2.
        error : (n, c) array
            Its standard error; 0 where it is exact.

        Examples
        --------
        Under a sky of radiance 1, a floor of albedo a has the radiance a:

        >>> import numpy as np
        >>> from lightloc import Lambert, Observations
        >>> class Floor:
        ...     def known_light(self, observations, samples, seed):
        ...         a = np.broadcast_to(observations.material.albedo, (len(observations), 1))
        ...         return a, np.zeros_like(a)
        >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
        ...                  radiance=[0.7], material=Lambert(albedo=0.5))
        >>> Floor().known_light(q, 64, 0)[0].tolist()
        [[0.5]]
        """
        ...
