"""Distances along the scene's surface between observations (sections 4.2 and 4.4).

Votes compare limiters, which are observations; a surface says how far apart two of them are *along
the surface*, and in 3D how much of it three of them span.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.plane import follow
from lightloc.reprs import short


class Surface(Protocol):
    """What votes ask of the observed surface: distances d(a, b) and areas d(a, b, c) along it.

    Any object with these methods serves. Indices count the n observations.

    Notes
    -----
    The d(x, y) of section 4.2, and the areas of section 4.4.

    Examples
    --------
    Four observations in the middle of the sides of a square of side 1 stand for a side each:

    >>> from lightloc import Perimeter, Surface
    >>> square = [[0.5, 0, 0], [1, 0.5, 0], [0.5, 1, 0], [0, 0.5, 0]]
    >>> inwards = [[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]]
    >>> surface: Surface = Perimeter.of(square, inwards)
    >>> surface.spacing
    1.0
    """

    @property
    def spacing(self) -> float:
        """Length of surface that one observation stands for: the unit of distances in votes."""
        ...

    @property
    def share(self) -> float:
        """Area that one observation stands for, m^2 or steradians: the unit of areas in votes."""
        ...

    def distances(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.float64]:
        """Distances along the surface between pairs of observations (section 4.2).

        Parameters
        ----------
        a, b : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Distances, in the unit of length; infinite where there is no way along the surface.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Perimeter
        >>> circle = Perimeter(np.zeros(4, int), np.arange(4.0), np.full(4, 4.0))
        >>> circle.distances(np.array([0, 0]), np.array([2, 3])).tolist()
        [2.0, 1.0]
        """
        ...

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Areas of the surface that triples of observations span (section 4.4).

        Parameters
        ----------
        a, b, c : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Areas, in the unit of ``share``.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import SolidAngle
        >>> ends = np.concatenate([np.eye(3), -np.eye(3)])
        >>> octant = SolidAngle(ends).areas(*np.array([[0], [1], [2]]))
        >>> bool(np.allclose(octant, 4 * np.pi / 8))
        True
        """
        ...


@dataclass(frozen=True, eq=False)
class Perimeter:
    """A 2D scene: the exact distance along outlines, infinite from one to another.

    Parameters
    ----------
    loop : (n,) array of int
        Which outline each observation lies on.
    along : (n,) array
        How far along it, in the unit of length from its beginning.
    length : (n,) array
        How long that outline is, in the unit of length; infinite where it is not closed.

    Notes
    -----
    The d(x, y) of section 4.2.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Perimeter
    >>> square = Perimeter(np.zeros(3, int), np.array([0.5, 1.5, 3.5]), np.full(3, 4.0))
    >>> square.distances(np.array([0, 1]), np.array([1, 2])).tolist(), square.spacing
    ([1.0, 2.0], 1.3333333333333333)
    """

    loop: NDArray[np.intp]
    along: NDArray[np.float64]
    length: NDArray[np.float64]

    __repr__ = short

    @staticmethod
    def of(positions: ArrayLike, normals: ArrayLike) -> Perimeter:
        """Follow the outlines that observations of the plane z = 0 lie on, from each to the next.

        Parameters
        ----------
        positions : (n, 3) or (n, 2) array_like
            Points on the walls, in the unit of length, in any order; `lightloc.plane.follow` says
            how they are joined.
        normals : (n, 3) or (n, 2) array_like
            Their normals, into free space.

        Returns
        -------
        Perimeter
            Distances between the observations.

        Raises
        ------
        ValueError
            If there is no point, the shapes differ, or a value is not finite or off the plane.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Perimeter
        >>> square = [[0.5, 0, 0], [1, 0.5, 0], [0.5, 1, 0], [0, 0.5, 0]]
        >>> walls = Perimeter.of(square, [[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]])
        >>> walls.distances(np.array([0, 0]), np.array([1, 2])).tolist(), walls.spacing
        ([1.0, 2.0], 1.0)
        """
        return Perimeter(*follow(positions, normals))

    @property
    def spacing(self) -> float:
        """Length of outline that one observation stands for; infinite where no two are joined."""
        _, first, which = np.unique(self.loop, return_index=True, return_inverse=True)
        length, extent = self.length[first], np.zeros(len(first))
        np.maximum.at(extent, which.ravel(), self.along)
        closed = np.isfinite(length)
        steps = len(self.loop) - np.count_nonzero(~closed)  # a wall's end has no next
        return float(np.where(closed, length, extent).sum() / steps) if steps else np.inf

    @property
    def share(self) -> float:
        """Refused with a ValueError: an outline has lengths and no areas."""
        raise ValueError(NO_AREAS)

    def distances(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.float64]:
        """As of `Surface`: the shorter way round; infinite from one outline to another."""
        d = np.abs(self.along[a] - self.along[b])
        d = np.minimum(d, self.length[a] - d)
        return d if not self.loop.any() else np.where(self.loop[a] == self.loop[b], d, np.inf)

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Raise ValueError: an outline has lengths and no areas."""
        raise ValueError(NO_AREAS)


NO_AREAS = "an outline has lengths and no areas: it is the surface of a 2D scene"


@dataclass(frozen=True, eq=False)
class SolidAngle:
    """The paper's own approximation in 3D: solid angles seen from the scene's centre.

    Distances are straight lines; "some artifacts (e.g. underestimating votes near the corners of
    boxy scenes)" are section 4.4's words on it.

    Parameters
    ----------
    positions : (n, 3) array
        The observed points, in the unit of length.

    Examples
    --------
    All observations together stand for the whole sphere:

    >>> import numpy as np
    >>> from lightloc import SolidAngle
    >>> ends = np.concatenate([np.eye(3), -np.eye(3)])
    >>> bool(np.isclose(len(ends) * SolidAngle(ends).share, 4 * np.pi))
    True
    """

    positions: NDArray[np.float64]

    __repr__ = short

    @property
    def share(self) -> float:
        """Solid angle that one observation stands for, steradians."""
        return 4 * np.pi / len(self.positions)

    @property
    def spacing(self) -> float:
        """Length that one observation stands for, as if all lay on the sphere about their box."""
        half = np.ptp(self.positions, axis=0) / 2
        return float(np.linalg.norm(half) * np.sqrt(self.share))

    def distances(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.float64]:
        """As of `Surface`: along straight lines."""
        return np.linalg.norm(self.positions[a] - self.positions[b], axis=-1)

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """As of `Surface`: by van Oosterom and Strackee's formula, steradians."""
        centre = (self.positions.min(axis=0) + self.positions.max(axis=0)) / 2
        u, v, w = (self.positions[i] - centre for i in (a, b, c))
        nu, nv, nw = (np.linalg.norm(x, axis=-1) for x in (u, v, w))
        triple = np.abs((u * np.cross(v, w)).sum(axis=-1))
        below = (
            nu * nv * nw
            + (u * v).sum(axis=-1) * nw
            + (v * w).sum(axis=-1) * nu
            + (w * u).sum(axis=-1) * nv
        )
        return 2 * np.arctan2(triple, below)
