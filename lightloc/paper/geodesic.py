"""Shortest paths over neighbouring observations: d(x, y) where the surface is not known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from lightloc.checks import array, unit_vectors
from lightloc.reprs import short

NEIGHBOURS = 12  # a graph of 12 neighbours is 4 % longer than a plane's straight lines (measured)
BOTH_SIDES = 3  # times as many are looked at: of 36 on a thin sheet 12 or more lie on one side
MEDIAN = 1 / 3  # the disc to the k-th random neighbour stands for k less this, on the median
SAME_SIDE = -0.5  # normals further apart than 120 degrees are two sides of one sheet


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
        Length of the shortest path of each pair, in the unit of length.
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

    __repr__ = short

    @property
    def spacing(self) -> float:
        """Length of surface that one observation stands for: the root of its area."""
        return float(np.sqrt(self.share))

    @staticmethod
    def of(positions: ArrayLike, normals: ArrayLike, reach: float) -> Geodesic:
        """Connect each observation with its neighbours on the same side of a surface.

        Parameters
        ----------
        positions : (n, 3) array_like
            The observed points, in the unit of length.
        normals : (n, 3) array_like
            Their normals, of any length above 0.
        reach : float
            Length up to which paths are looked for, in the unit of length.

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
        """As of `Surface`: shortest paths over neighbours; infinite beyond the reach."""
        # Cells that lie together ask for the same pairs, and a search in order is 3 times faster.
        wanted, which = np.unique(np.asarray(a, np.int64) * self.n + b, return_inverse=True)
        at = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        return np.where(self.keys[at] == wanted, self.lengths[at], np.inf)[which]

    def areas(
        self, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        """As of `Surface`: by Heron's formula from the three paths; infinite where one is."""
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
