"""Votes: where many limiters meet, a light is likely (sections 3.4, 4.2 to 4.4, Eq. 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import array
from lightloc.fields import NO_LIMITER, Grid

DISCONTINUITY = 0.05  # T, of the scene's radius (section 4.2): beyond it lies the medial axis
VOTING = 0.5  # of the scene's radius: the same for votes (measured; 0.05 votes for rings)
MERGE = 0.10  # of the scene's radius: nearer peaks are one (section 4.3)
CIRCLE = 8  # pixels on a circle of radius 1
SOLID_ANGLE_PIECES = 20  # triangles of the icosahedron on the sphere (section 4.4)


@dataclass(frozen=True)
class Votes:
    """V(p) over a grid and its peaks.

    Args:
        grid: where V was counted.
        votes: V(p), `grid.shape`; mean distance along the surface (2D, metres) or mean solid
            angle (3D, steradians) between neighbouring limiters, discontinuities left out.
        medial_axis: `grid.shape` bool, where neighbouring limiters are T apart or more.
    """

    grid: Grid
    votes: NDArray[np.float64]
    medial_axis: NDArray[np.bool_]

    def peaks(self, height: float, radius: float) -> NDArray[np.float64]:
        """(m, 3) positions of local maxima above ``height``, highest first.

        The height is halved until a peak is found; peaks within `MERGE` of ``radius`` (the
        scene's, metres) are one (section 4.3).
        """
        flat = self.votes.ravel()
        order = np.argsort(-flat, kind="stable")
        if not flat.max(initial=0.0) > 0:
            return np.zeros((0, 3))
        while not (flat > height).any():
            height /= 2
        points = self.grid.points
        kept: list[NDArray] = []
        for index in order[: int((flat > height).sum())]:
            p = points[index]
            if all(np.linalg.norm(p - other) > MERGE * radius for other in kept):
                kept.append(p)
        return np.array(kept).reshape(-1, 3)


def vote(grid: Grid, limiters: ArrayLike, positions: ArrayLike, radius: int = 1) -> Votes:
    """V(p) of Eq. 8 from the limiter field, as sections 4.3 and 4.4 compute it.

    Args:
        grid: where L was computed; one cell deep for a 2D scene or a slice.
        limiters: (g,) indices L(p) into the observations, as `intensity_distance` gives them.
        positions: (n, 3) the observed points.
        radius: of the circle or sphere around p, in cells: 1 without noise, more with it.

    In a 2D grid V is the mean distance between limiters of consecutive pixels on the circle. In
    3D it is the mean solid angle, seen from the scene's centre, of the triangles whose corners'
    limiters lie within T.

    >>> import numpy as np
    >>> grid = Grid([0, 0, 0], [3, 3, 0], (3, 3, 1))
    >>> float(vote(grid, np.zeros(9, int), [[0.0, 0.0, 0.0]]).votes.max())
    0.0
    """
    x = array("positions", positions, (None, 3))
    L = np.asarray(limiters).reshape(grid.shape)
    centre = (x.min(axis=0) + x.max(axis=0)) / 2
    scene_radius = float(np.linalg.norm(x - centre, axis=1).max())
    T, reach = DISCONTINUITY * scene_radius, VOTING * scene_radius
    where = np.where((L == NO_LIMITER)[..., None], np.nan, x[np.where(L == NO_LIMITER, 0, L)])
    padded = np.pad(where, [(radius, radius)] * 3 + [(0, 0)], constant_values=np.nan)
    if grid.shape[2] == 1:
        total, count, broken = _circle(padded, grid.shape, radius, T, reach)
    else:
        total, count, broken = _sphere(padded, grid.shape, radius, T, reach, centre)
    return Votes(grid, np.where(count > 0, total / np.maximum(count, 1), 0.0), broken)


def _shifted(padded: NDArray, shape: tuple[int, int, int], radius: int, step: NDArray) -> NDArray:
    x, y, z = radius + step
    return padded[x : x + shape[0], y : y + shape[1], z : z + shape[2]]


def _circle(
    padded: NDArray, shape: tuple[int, int, int], radius: int, T: float, reach: float
) -> tuple[NDArray, NDArray, NDArray]:
    angles = 2 * np.pi * np.arange(CIRCLE * radius) / (CIRCLE * radius)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) * radius
    widen = 1.0 if radius > 1 else 1.42  # radius 1 means the eight neighbours
    steps = np.rint(ring * widen).astype(int).clip(-radius, radius)
    total, count = np.zeros(shape), np.zeros(shape)
    broken = np.zeros(shape, bool)
    for a, b in zip(steps, np.roll(steps, -1, axis=0), strict=True):
        d = np.linalg.norm(
            _shifted(padded, shape, radius, a) - _shifted(padded, shape, radius, b), axis=-1
        )
        near = d < reach
        total += np.where(near, d, 0)
        count += near
        broken |= d >= T
    return total, count, broken


def _sphere(
    padded: NDArray,
    shape: tuple[int, int, int],
    radius: int,
    T: float,
    reach: float,
    centre: NDArray,
) -> tuple[NDArray, NDArray, NDArray]:
    corners, faces = _icosahedron()
    steps = np.rint(corners * (radius if radius > 1 else 1.2)).astype(int).clip(-radius, radius)
    total, count = np.zeros(shape), np.zeros(shape)
    broken = np.zeros(shape, bool)
    for face in faces:
        a, b, c = (_shifted(padded, shape, radius, steps[corner]) for corner in face)
        longest = np.maximum.reduce(
            [np.linalg.norm(u - v, axis=-1) for u, v in ((a, b), (b, c), (c, a))]
        )
        near = longest < reach
        total += np.where(near, _solid_angle(a - centre, b - centre, c - centre), 0)
        count += near
        broken |= longest >= T
    return total, count, broken


def _solid_angle(a: NDArray, b: NDArray, c: NDArray) -> NDArray:
    """Van Oosterom and Strackee's formula, steradians."""
    na, nb, nc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    triple = np.abs((a * np.cross(b, c)).sum(axis=-1))
    below = (
        na * nb * nc
        + (a * b).sum(axis=-1) * nc
        + (b * c).sum(axis=-1) * na
        + (c * a).sum(axis=-1) * nb
    )
    return np.nan_to_num(2 * np.arctan2(triple, below))


def _icosahedron() -> tuple[NDArray, NDArray]:
    golden = (1 + np.sqrt(5)) / 2
    ring = np.array([[0, s, t * golden] for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(ring, k, axis=1) for k in range(3)])
    corners = corners / np.linalg.norm(corners[0])
    edge = np.linalg.norm(corners - corners[0], axis=1)
    near = np.sort(edge)[1] * 1.01
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if max(np.linalg.norm(corners[u] - corners[v]) for u, v in ((i, j), (j, k), (i, k))) < near
    ]
    assert len(faces) == SOLID_ANGLE_PIECES
    return corners, np.array(faces)
