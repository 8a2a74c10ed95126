"""Distances along the scene's surface between observations (sections 4.2 and 4.4).

Votes compare limiters, which are observations; a surface says how far apart two of them are *along
the surface*, and in 3D how much of it three of them span.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from lightloc.checks import array, unit_vectors
from lightloc.plane import follow

NEIGHBOURS = 12  # a graph of 12 neighbours is 4 % longer than a plane's straight lines (measured)
BOTH_SIDES = 3  # times as many are looked at: of 36 on a thin sheet 12 or more lie on one side
MEDIAN = 1 / 3  # the disc to the k-th random neighbour stands for k less this, on the median
SAME_SIDE = -0.5  # normals further apart than 120 degrees are two sides of one sheet


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
        """Metres of surface that one observation stands for: the unit of distances in votes."""
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
            Distances, metres; infinite where there is no way along the surface.

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
        How far along it, metres from its beginning.
    length : (n,) array
        How long that outline is, metres; infinite where it is not closed.

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

    @staticmethod
    def of(positions: ArrayLike, normals: ArrayLike) -> Perimeter:
        """Follow the outlines that observations of the plane z = 0 lie on, from each to the next.

        Parameters
        ----------
        positions : (n, 3) or (n, 2) array_like
            Points on the walls, metres, in any order; `lightloc.plane.follow` says how they are
            joined.
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
        """Metres of outline that one observation stands for; infinite where no two are joined."""
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
        """Distances along the outline between pairs of observations (section 4.2).

        Parameters
        ----------
        a, b : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            The shorter way round, metres; infinite from one outline to another.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Perimeter
        >>> circle = Perimeter(np.zeros(4, int), np.arange(4.0), np.full(4, 4.0))
        >>> circle.distances(np.array([0, 0]), np.array([2, 3])).tolist()
        [2.0, 1.0]
        """
        d = np.abs(self.along[a] - self.along[b])
        d = np.minimum(d, self.length[a] - d)
        return d if not self.loop.any() else np.where(self.loop[a] == self.loop[b], d, np.inf)

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Refuse to answer: an outline has lengths and no areas.

        Parameters
        ----------
        a, b, c : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Never: it raises.

        Raises
        ------
        ValueError
            Always.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Perimeter
        >>> here = np.array([0])
        >>> Perimeter(np.zeros(1, int), np.zeros(1), np.ones(1)).areas(here, here, here)
        Traceback (most recent call last):
            ...
        ValueError: an outline has lengths and no areas: it is the surface of a 2D scene
        """
        raise ValueError(NO_AREAS)


NO_AREAS = "an outline has lengths and no areas: it is the surface of a 2D scene"


@dataclass(frozen=True, eq=False)
class Geodesic:
    """A 3D scene: shortest paths over the graph of neighbouring observations.

    Paths longer than the reach that it was made for are infinite; votes never need them. `of` makes
    one in O(n log n) time, and memory in proportion to the pairs within reach.

    Parameters
    ----------
    keys : (m,) array of int
        Pairs a, b of observations within reach as a * n + b, sorted.
    lengths : (m,) array
        Length of the shortest path of each pair, metres.
    n : int
        Number of observations.
    share : float
        Area that one observation stands for, m^2; NaN where none has enough neighbours to tell.

    Notes
    -----
    The d(x, y) of section 4.2 in 3D, and the areas of section 4.4.

    Examples
    --------
    Of observations on a grid of 1 m in a plane, all but those at the border stand for about 1 m^2:

    >>> import numpy as np
    >>> from lightloc import Geodesic
    >>> x = np.stack(np.meshgrid(np.arange(30.0), np.arange(30.0), [0.0]), -1).reshape(-1, 3)
    >>> flat = Geodesic.of(x, np.tile([0.0, 0.0, 1.0], (900, 1)), reach=3.0)
    >>> bool(0.9 < flat.share < 1.2)
    True
    """

    keys: NDArray[np.int64]  # sorted, a * n + b of the pairs within reach
    lengths: NDArray[np.float64]
    n: int
    share: float

    @property
    def spacing(self) -> float:
        """Metres of surface that one observation stands for: the root of its area."""
        return float(np.sqrt(self.share))

    @staticmethod
    def of(positions: ArrayLike, normals: ArrayLike, reach: float) -> Geodesic:
        """Connect each observation with its neighbours on the same side of a surface.

        Parameters
        ----------
        positions : (n, 3) array_like
            The observed points, metres.
        normals : (n, 3) array_like
            Their normals, of any length above 0.
        reach : float
            Length up to which paths are looked for, metres.

        Returns
        -------
        Geodesic
            Distances between the observations.

        Raises
        ------
        ValueError
            If a shape is wrong, a value is not finite, a normal has length zero, or the reach is
            not above 0.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Geodesic
        >>> x = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), -1).reshape(-1, 3)
        >>> flat = Geodesic.of(x, np.tile([0.0, 0.0, 1.0], (25, 1)), reach=3.0)
        >>> flat.distances(np.array([0, 0]), np.array([2, 24])).tolist()
        [2.0, inf]
        """
        x = array("positions", positions, (None, 3))
        normal = unit_vectors("normals", normals, len(x))
        if not reach > 0:
            raise ValueError(f"reach is {reach:g}; expected a length above 0")
        n = len(x)
        tree = cKDTree(x)
        length, near, joined = _neighbours(tree, x, normal)
        row = np.repeat(np.arange(n), near.shape[1])[joined.ravel()]
        edges = np.maximum(length[joined], np.finfo(float).tiny), (row, near[joined])
        graph = coo_array(edges, shape=(n, n)).tocsr()
        pairs = [_within(graph, x, tree, rows, reach) for rows in _blocks(x, 2 * reach)]
        keys = np.concatenate([rows * n + columns for rows, columns, _ in pairs])
        lengths = np.concatenate([found for _, _, found in pairs])
        order = np.argsort(keys)
        full = length[joined.sum(axis=1) == NEIGHBOURS, -1:]
        share = np.pi * np.median(full) ** 2 / (NEIGHBOURS - MEDIAN) if full.size else np.nan
        return Geodesic(keys[order], lengths[order], n, float(share))

    def distances(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.float64]:
        """Lengths of shortest paths between pairs of observations (section 4.2).

        Parameters
        ----------
        a, b : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Lengths, metres; infinite beyond the reach.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Geodesic
        >>> line = np.arange(4.0)[:, None] * [1, 0, 0]
        >>> path = Geodesic.of(line, np.tile([0, 0, 1], (4, 1)), reach=2.5)
        >>> path.distances(np.array([0, 0]), np.array([2, 3])).tolist()
        [2.0, inf]
        """
        # Cells that lie together ask for the same pairs, and a search in order is 3 times faster.
        wanted, which = np.unique(np.asarray(a, np.int64) * self.n + b, return_inverse=True)
        at = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        return np.where(self.keys[at] == wanted, self.lengths[at], np.inf)[which]

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Areas that triples of observations span (section 4.4).

        Parameters
        ----------
        a, b, c : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Areas, m^2; infinite where one of the paths is.

        Notes
        -----
        Heron's formula for the three paths.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Geodesic
        >>> corners = [[0, 0, 0], [4, 0, 0], [0, 3, 0]]
        >>> flat = Geodesic.of(corners, np.tile([0, 0, 1], (3, 1)), reach=6.0)
        >>> flat.areas(*np.array([[0], [1], [2]])).tolist()
        [6.0]
        """
        x, y, z = self.distances(a, b), self.distances(b, c), self.distances(c, a)
        half = (x + y + z) / 2
        with np.errstate(invalid="ignore"):
            square = half * (half - x) * (half - y) * (half - z)
        return np.where(np.isfinite(half), np.sqrt(np.maximum(square, 0.0)), np.inf)


def _neighbours(
    tree: cKDTree, x: NDArray[np.float64], normal: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.bool_]]:
    """The nearest on the same side: (n, k) how far, which, and whether there is one, each."""
    apart, near = tree.query(x, k=min(BOTH_SIDES * NEIGHBOURS + 1, len(x)))
    apart, near = apart.reshape(len(x), -1)[:, 1:], near.reshape(len(x), -1)[:, 1:]
    same = np.einsum("nd,nkd->nk", normal, normal[near]) > SAME_SIDE
    first = np.argsort(~same, axis=1, kind="stable")[:, :NEIGHBOURS]  # a sheet has two sides
    nearest = [np.take_along_axis(v, first, axis=1) for v in (apart, near, same)]
    return nearest[0], nearest[1], nearest[2]


def _blocks(x: NDArray[np.float64], side: float) -> Iterator[NDArray[np.intp]]:
    """Indices of the points in each cube of a side, at most `ROWS` at once."""
    cell = np.floor((x - x.min(axis=0)) / side)
    _, which = np.unique(cell, axis=0, return_inverse=True)
    order = np.argsort(which.ravel(), kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(which.ravel()[order])) + 1):
        yield from np.split(rows, range(ROWS, len(rows), ROWS))


def _within(
    graph: csr_array, x: NDArray[np.float64], tree: cKDTree, rows: NDArray[np.intp], reach: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Paths from ``rows`` that are no longer than the reach: (from, to, length).

    No point of such a path lies further than the reach from its beginning in a straight line, so
    the graph of the points around the block holds them all.
    """
    lower, upper = x[rows].min(axis=0), x[rows].max(axis=0)
    around = np.linalg.norm(upper - lower) / 2 + reach
    some = np.array(tree.query_ball_point((lower + upper) / 2, around, return_sorted=True))
    part = graph[some][:, some]
    here = np.searchsorted(some, rows)
    paths = dijkstra(part, directed=False, indices=here, limit=reach)
    a, b = np.nonzero(np.isfinite(paths))
    return rows[a], some[b], paths[a, b]


ROWS = 256
"""Shortest paths from so many observations at once, which bounds the memory of one block."""


@dataclass(frozen=True, eq=False)
class SolidAngle:
    """The paper's own approximation in 3D: solid angles seen from the scene's centre.

    Distances are straight lines; "some artifacts (e.g. underestimating votes near the corners of
    boxy scenes)" are section 4.4's words on it.

    Parameters
    ----------
    positions : (n, 3) array
        The observed points, metres.

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

    @property
    def share(self) -> float:
        """Solid angle that one observation stands for, steradians."""
        return 4 * np.pi / len(self.positions)

    @property
    def spacing(self) -> float:
        """Metres that one observation stands for, as if all lay on the sphere about their box."""
        half = np.ptp(self.positions, axis=0) / 2
        return float(np.linalg.norm(half) * np.sqrt(self.share))

    def distances(self, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.float64]:
        """Straight-line distances between pairs of observations.

        Parameters
        ----------
        a, b : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Distances, metres.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import SolidAngle
        >>> corners = np.array([[0, 0, 0], [4, 0, 0], [0, 3, 0.0]])
        >>> SolidAngle(corners).distances(np.array([1]), np.array([2])).tolist()
        [5.0]
        """
        return np.linalg.norm(self.positions[a] - self.positions[b], axis=-1)

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """Solid angles of triples of observations, seen from the centre of all (section 4.4).

        Parameters
        ----------
        a, b, c : (m,) array of int
            Indices of observations.

        Returns
        -------
        (m,) array
            Solid angles, steradians.

        Notes
        -----
        Van Oosterom and Strackee's formula.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import SolidAngle
        >>> ends = np.concatenate([np.eye(3), -np.eye(3)])
        >>> octant = SolidAngle(ends).areas(*np.array([[0], [1], [2]]))
        >>> bool(np.allclose(octant, 4 * np.pi / 8))
        True
        """
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
