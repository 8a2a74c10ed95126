"""Votes: where many limiters meet, a light is likely (sections 3.4, 4.2 to 4.4, Eq. 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.fields import NO_LIMITER, Grid
from lightloc.paper.surface import Surface
from lightloc.reprs import short

DISCONTINUITY = 0.05  # T, of the scene's radius (section 4.2)
MERGE = 0.10  # of the scene's radius: nearer peaks are one (section 4.3)
LOWERING = 0.9  # H times this while no peak is found (section 4.3 does not say how fast)
FINE = 64  # directions per cell of the circle's radius, from which its pixels are taken


@dataclass(frozen=True, eq=False)
class Votes:
    """V(p) over a grid and its peaks (section 3.4).

    Parameters
    ----------
    grid : Grid
        Where V was counted.
    votes : array
        V(p), of shape ``grid.shape``: how many limiters lie between neighbours on the circle (2D)
        or within a triangle of the sphere (3D) about p, on the mean.
    medial_axis : array of bool
        Of shape ``grid.shape``, where limiters of consecutive neighbours are T apart or more
        (section 4.2).

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Grid, Votes
    >>> grid = Grid([0, 0, 0], [5, 1, 0], (5, 1, 1))
    >>> votes = np.array([0, 3.0, 0, 2.5, 0]).reshape(grid.shape)
    >>> grid.points[Votes(grid, votes, votes > 9).votes.argmax()].tolist()  # where V is largest
    [1.5, 0.5, 0.0]
    """

    grid: Grid
    votes: NDArray[np.float64]
    medial_axis: NDArray[np.bool_]

    __repr__ = short

    def peaks(
        self, height: float, radius: float, *, merge: float = MERGE, lowering: float = LOWERING
    ) -> NDArray[np.float64]:
        """Find the local maxima of V above H = ``height``, highest first (section 4.3).

        H is lowered until there is a peak.

        Parameters
        ----------
        height : float
            H, in the unit of ``votes``.
        radius : float
            The scene's radius, in the unit of length.
        merge : float
            Share of that radius within which the highest of several peaks stands for all.
        lowering : float
            Factor on H while it has no peak.

        Returns
        -------
        (m, 3) array
            Positions of the peaks, in the unit of length; none where nothing has a vote.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Grid, Votes
        >>> grid = Grid([0, 0, 0], [5, 1, 0], (5, 1, 1))
        >>> values = np.array([0, 3.0, 0, 2.5, 0]).reshape(grid.shape)
        >>> Votes(grid, values, values > 9).peaks(2.0, radius=1.0).tolist()
        [[1.5, 0.5, 0.0], [3.5, 0.5, 0.0]]
        """
        top = float(self.votes.max(initial=0.0))
        if not top > 0:
            return np.zeros((0, 3))
        while height >= top:
            height *= lowering
        field = np.pad(self.votes, 1, constant_values=-np.inf)
        summit = self.votes > height
        nx, ny, nz = self.grid.shape
        for x, y, z in np.ndindex(3, 3, 3):
            if (x, y, z) != (1, 1, 1):
                summit &= self.votes >= field[x : x + nx, y : y + ny, z : z + nz]
        found = np.flatnonzero(summit)
        found = found[np.argsort(-self.votes.ravel()[found], kind="stable")]
        cell = np.stack(np.unravel_index(found, self.grid.shape), axis=1)
        points = self.grid.lower + (cell + 0.5) * self.grid.step
        kept = np.zeros((0, 3))
        for p in points:
            if (np.linalg.norm(kept - p, axis=1) >= merge * radius).all():
                kept = np.concatenate([kept, p[None]])
        return kept


def vote(
    grid: Grid, limiters: ArrayLike, surface: Surface, threshold: float, radius: int = 1
) -> Votes:
    """Votes V(p) of Eq. 8, from the limiter field by the formulas of sections 4.3 and 4.4.

    In 2D, V is the mean over consecutive pixels of the circle of the distance between their
    limiters; in 3D, over the triangles of the sphere, of the area that the three limiters span;
    both in units of the surface that one observation stands for, and zero where T is passed.

    Parameters
    ----------
    grid : Grid
        Where L was computed; one cell deep for a 2D scene.
    limiters : (g,) array_like of int
        Indices L(p) into the observations, as `intensity_distance` gives them for one channel.
    surface : Surface
        Distances between those observations.
    threshold : float
        T, in the unit of length along the surface: limiters further apart are a discontinuity and
        do not vote. The paper's is 0.05 of the scene's radius.
    radius : int
        Radius of the circle or sphere about p, cells: 1 without noise, 15 with it (section 6.1).

    Returns
    -------
    Votes
        V(p) and the medial axis.

    Raises
    ------
    ValueError
        If there is not one limiter for each cell, or the surface has no areas (`Perimeter`) and the
        grid is more than one cell deep.

    Examples
    --------
    Observations 1 m apart on a wall, each of which limits one column of cells. Of the eight pairs
    of neighbours about p four have limiters that differ, by one observation:

    >>> import numpy as np
    >>> from lightloc import Grid, Perimeter, vote
    >>> wall = Perimeter(np.zeros(9, int), np.arange(9.0), np.full(9, 9.0))
    >>> grid = Grid([0, 0, 0], [5, 5, 0], (5, 5, 1))
    >>> vote(grid, np.repeat(np.arange(5), 5), wall, threshold=2.0).votes[2, 2].tolist()
    [0.5]
    """
    L = np.asarray(limiters).reshape(grid.shape)
    if grid.shape[2] == 1:
        votes, broken = _circle(L, surface, threshold, radius)
        return Votes(grid, votes / surface.spacing, broken)
    votes, broken = _sphere(L, surface, threshold, radius)
    return Votes(grid, votes / surface.share, broken)


def circle(radius: int) -> NDArray[np.intp]:
    """The pixels of a circle in order, each a neighbour of the last: (m, 2) steps from p.

    Examples
    --------
    >>> len(circle(1)), len(circle(15))
    (8, 112)
    """
    if radius == 1:
        ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
        return np.array(ring)
    angle = 2 * np.pi * np.arange(FINE * radius) / (FINE * radius)
    pixels = np.rint(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)).astype(int)
    return pixels[(pixels != np.roll(pixels, 1, axis=0)).any(axis=1)]


def _circle(
    L: NDArray[np.intp], surface: Surface, T: float, radius: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Consecutive pixels are neighbours, so there are but four kinds of pairs to measure."""
    nx, ny, _ = L.shape
    pad = radius + 1
    wide = np.pad(L[:, :, 0].astype(np.int64), pad, constant_values=NO_LIMITER)
    pairs: dict[tuple[int, int], tuple[NDArray[np.float32], NDArray[np.bool_]]] = {}

    def pair(
        a: NDArray[np.intp], b: NDArray[np.intp]
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Votes and breaks between p + a and p + b, for all p."""
        first, along = (a, b - a) if tuple(b - a) > (0, 0) else (b, a - b)
        if tuple(along) not in pairs:
            pairs[tuple(along)] = _between(wide, along, surface, T)
        x, y = pad + first
        return tuple(v[x : x + nx, y : y + ny] for v in pairs[tuple(along)])  # type: ignore

    total, broken = np.zeros((nx, ny), np.float32), np.zeros((nx, ny), bool)
    ring, nearest = circle(radius), circle(1)
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        total += pair(a, b)[0]
    for a, b in zip(nearest, np.roll(nearest, -1, axis=0), strict=True):
        broken |= pair(a, b)[1]
    return (total / np.float32(len(ring)))[:, :, None].astype(np.float64), broken[:, :, None]


def _between(
    wide: NDArray[np.intp], along: NDArray[np.intp], surface: Surface, T: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """d(L(p), L(p + along)) where it is under T, and whether it is not, over a padded grid."""
    x, y = along
    here = wide[max(0, -x) : wide.shape[0] - max(0, x), max(0, -y) : wide.shape[1] - max(0, y)]
    there = wide[max(0, x) : wide.shape[0] - max(0, -x), max(0, y) : wide.shape[1] - max(0, -y)]
    limited = (here != NO_LIMITER) & (there != NO_LIMITER)
    d = surface.distances(np.where(limited, here, 0), np.where(limited, there, 0))
    votes, breaks = np.zeros(wide.shape, np.float32), np.zeros(wide.shape, bool)
    at = (slice(max(0, -x), None), slice(max(0, -y), None))
    votes[at][: d.shape[0], : d.shape[1]] = np.where(limited & (d < T), d, 0)
    breaks[at][: d.shape[0], : d.shape[1]] = limited & (d >= T)
    return votes, breaks


def _sphere(
    L: NDArray[np.intp], surface: Surface, T: float, radius: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    votes, broken = _triangles(L, surface, T, radius)
    return votes, broken if radius == 1 else _triangles(L, surface, T, 1)[1]


def _triangles(
    L: NDArray[np.intp], surface: Surface, T: float, radius: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    corners, faces = icosahedron()
    steps = np.rint(corners * (radius if radius > 1 else 1.2)).astype(int).clip(-radius, radius)
    wide = np.pad(L.astype(np.int64), radius, constant_values=NO_LIMITER)
    nx, ny, nz = L.shape

    def at(corner: int) -> NDArray[np.intp]:
        x, y, z = radius + steps[corner]
        return wide[x : x + nx, y : y + ny, z : z + nz].ravel()

    sides: dict[tuple[int, int], NDArray[np.float64]] = {}

    def side(a: int, b: int) -> NDArray[np.float64]:
        """d(L(p + a), L(p + b)) for all p; 0 where a limiter is missing or both are the same."""
        if (a, b) not in sides:
            i, j = at(a), at(b)
            different = np.flatnonzero((i != j) & (i != NO_LIMITER) & (j != NO_LIMITER))
            sides[a, b] = np.zeros(L.size)
            sides[a, b][different] = surface.distances(i[different], j[different])
        return sides[a, b]

    total, broken = np.zeros(L.size), np.zeros(L.size, bool)
    for a, b, c in faces:
        longest = np.maximum(np.maximum(side(a, b), side(b, c)), side(a, c))
        i, j, k = at(a), at(b), at(c)
        limited = (i != NO_LIMITER) & (j != NO_LIMITER) & (k != NO_LIMITER)
        near = np.flatnonzero(limited & (longest > 0) & (longest < T))
        total[near] += surface.areas(i[near], j[near], k[near])
        broken |= longest >= T
    return (total / len(faces)).reshape(L.shape), broken.reshape(L.shape)


def icosahedron() -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The triangulated sphere: 12 unit corners, and 20 faces as sorted triples of corners."""
    golden = (1 + np.sqrt(5)) / 2
    ring = np.array([[0, s, t * golden] for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(ring, k, axis=1) for k in range(3)])
    corners = corners / np.linalg.norm(corners[0])
    edge = np.linalg.norm(corners[:, None] - corners, axis=2)
    joined = (edge > 0) & (edge < 1.01 * np.sort(edge[0])[1])
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if joined[i, j] and joined[j, k] and joined[i, k]
    ]
    return corners, np.array(faces)
