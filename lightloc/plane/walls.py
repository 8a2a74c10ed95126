"""The walls of a 2D room, followed through points on them from each to the next.

Free space lies on the side that a normal points to. With it on the left, a wall runs on along the
normal turned right, so each point has one that comes next and one that came before: ahead along
its own direction, and along the other's too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from lightloc.checks import array
from lightloc.plane.vectors import cross, in_plane

NEAREST = 12  # points that are looked at for the next one, and for the one before
SAME = 1e-6  # of the extent: points nearer than this are in one place, to float32
CORNER = np.cos(0.55)  # rad: a lesser turn is an arc; a corner is 2.6 % longer there at most, and
# a disc of 11 points has sharper turns, one of 12 none
BACK = 0.1  # of a step, that it may lead back: a point at a corner is ahead of none for sure
SAME_SIDE = -0.5  # normals further apart than 120 degrees are two sides of one wall
STRAIGHTER = 0.1  # of two ways that are about as long, the one that turns less


def follow(
    positions: ArrayLike, normals: ArrayLike
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Which wall (n, 3) points of the plane z = 0 lie on, and where, in O(n log n) time.

    Between two points that face alike a wall is an arc; where they do not, a corner, for which both
    walls go on straight until they meet.

    Parameters
    ----------
    positions : (n, 3) or (n, 2) array_like
        Points in metres, in any order, as unevenly spaced as they may be.
    normals : (n, 3) or (n, 2) array_like
        Their normals, into free space.

    Returns
    -------
    wall : (n,) array of int
        The index of each point's wall.
    along : (n,) array
        How far along it the point lies, in the unit of length.
    length : (n,) array
        The wall's whole length, in the unit of length; infinite where the points do not go all
        around, as on a wall that is seen in part.

    Raises
    ------
    ValueError
        If there is no point, the shapes differ, or a value is not finite or off the plane.

    Examples
    --------
    >>> square = np.array([[0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5]])
    >>> wall, along, length = follow(square, [[0, 1], [-1, 0], [0, -1], [1, 0]])
    >>> wall.tolist(), np.sort(along).tolist(), length.tolist()
    ([0, 0, 0, 0], [0.0, 1.0, 2.0, 3.0], [4.0, 4.0, 4.0, 4.0])
    """
    x = in_plane("positions", positions)
    if not len(x):
        raise ValueError("positions are empty; expected at least one point")
    normal = array("normals", in_plane("normals", normals), (len(x), 2))
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    extent = np.ptp(x, axis=0).max() or 1.0
    x = (x - x.min(axis=0)) / extent
    alike = np.rint(np.concatenate([x, normal], axis=1) / SAME)
    _, first, which = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    x, onward = x[first], normal[first][:, ::-1] * [1, -1]
    wall, along, length = _measured(x, onward, _next(x, onward))
    which = which.ravel()
    return wall[which], extent * along[which], extent * length[which]


def _next(x: NDArray[np.float64], onward: NDArray[np.float64]) -> NDArray[np.intp]:
    """(m,) the point after each, -1 where a wall ends.

    The shortest way is taken first. What is left then are loose ends, which look for each other.
    Of points in one place, as at a corner, it is known which comes first once one is joined.
    """
    after, before = np.full((2, len(x)), -1)
    joined = True
    while joined and (after < 0).any():
        a, b = _pairs(x, np.flatnonzero(after < 0), np.flatnonzero(before < 0))
        possible = _possible(x, onward, a, b, (before[a] >= 0) | (after[b] >= 0))
        order = np.lexsort((b, a, _cost(x, onward, a, b)))
        order = order[possible[order]]
        joined = _join(a[order], b[order], after, before)
    return after


def _pairs(
    x: NDArray[np.float64], ends: NDArray[np.intp], starts: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Ends of walls and beginnings of walls, each with the nearest of the others."""
    pairs = []
    for own, others in ((ends, starts), (starts, ends)):
        k = np.arange(min(NEAREST + 1, len(others))) + 1  # one may be the point itself
        _, near = cKDTree(x[others]).query(x[own], k=k)
        pairs.append((np.repeat(own, len(k)), others[near.ravel()]))
    (a, b), (d, c) = pairs
    return np.concatenate([a, c]), np.concatenate([b, d])


def _possible(
    x: NDArray[np.float64],
    onward: NDArray[np.float64],
    a: NDArray[np.intp],
    b: NDArray[np.intp],
    known: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Whether a wall can run on from a to b: b is ahead of a, and on the same side of it.

    Where both are in one place, at a corner, it can if that is ``known``.
    """
    step = x[b] - x[a]
    apart = np.linalg.norm(step, axis=1)
    straight = (onward[a] * onward[b]).sum(axis=1)
    out, into = ((step * onward[i]).sum(axis=1) for i in (a, b))
    ahead = (out >= -BACK * apart) & (into >= -BACK * apart) & (out + into > 0)
    corner = (apart < SAME) & (straight < CORNER)
    return np.where(corner, known, ahead) & (straight > SAME_SIDE)


def _cost(
    x: NDArray[np.float64], onward: NDArray[np.float64], a: NDArray[np.intp], b: NDArray[np.intp]
) -> NDArray[np.float64]:
    """How long the way from a to b is, and a little for how bent."""
    straight = (onward[a] * onward[b]).sum(axis=1)
    return _way(x, onward, a, b) * (1 + STRAIGHTER * (1 - straight))


def _way(
    x: NDArray[np.float64], onward: NDArray[np.float64], a: NDArray[np.intp], b: NDArray[np.intp]
) -> NDArray[np.float64]:
    """How long a wall is from a to b: an arc, or two straight walls that meet."""
    step, straight = x[b] - x[a], (onward[a] * onward[b]).sum(axis=1)
    chord = np.linalg.norm(step, axis=1)
    arc = chord / np.sinc(np.arccos(np.clip(straight, -1, 1)) / (2 * np.pi))
    turned = cross(onward[a], onward[b])
    with np.errstate(divide="ignore", invalid="ignore"):
        out, into = cross(step, onward[b]) / turned, cross(onward[a], step) / turned
        corner = np.where((out >= 0) & (into >= 0), out + into, chord)
    return np.where(straight < CORNER, corner, arc)


def _join(
    a: NDArray[np.intp], b: NDArray[np.intp], after: NDArray[np.intp], before: NDArray[np.intp]
) -> bool:
    """Join pairs, given best first, that are each other's best, until none is left.

    Each point of a wall is the nearest ahead of the one before it, so that the first pass joins
    nearly all. Returns whether any was joined.
    """
    any_joined = len(a) > 0
    while len(a):
        best = _first(a) & _first(b)
        after[a[best]], before[b[best]] = b[best], a[best]
        free = (after[a] < 0) & (before[b] < 0)
        a, b = a[free], b[free]
    return any_joined


def _first(values: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(m,) whether it is the first of its value."""
    result = np.zeros(len(values), bool)
    result[np.unique(values, return_index=True)[1]] = True
    return result


def _measured(
    x: NDArray[np.float64], onward: NDArray[np.float64], after: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Walk each wall from its beginning, or from any of its points where it has none."""
    step = _way(x, onward, np.arange(len(x)), after)
    wall, along, length = np.full(len(x), -1), np.zeros(len(x)), np.full(len(x), np.inf)
    starts = np.setdiff1d(np.arange(len(x)), after)
    walls = 0
    for start in (*starts, *range(len(x))):
        if wall[start] >= 0:
            continue
        chain, point, reached = [], start, 0.0
        while point >= 0 and wall[point] < 0:
            chain.append(point)
            wall[point], along[point] = walls, reached
            reached += step[point]
            point = after[point]
        if point >= 0:
            length[chain] = reached
        walls += 1
    return wall, along, length
