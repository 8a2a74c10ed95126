"""Points, vectors and polylines in the plane z = 0."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import array, numbers

THICKNESS = 1e-6  # of the largest coordinate: a point in the plane may be off it by float32's eps


def in_plane(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """(n, 2) of points given as (n, 2), or as (n, 3) in the plane z = 0; else a ValueError."""
    rough = numbers(name, value)
    points = array(name, rough, (None, 3 if rough.ndim == 2 and rough.shape[1] == 3 else 2))
    if not is_in_plane(points):
        row = int(np.argmax(np.abs(points[:, 2])))
        raise ValueError(f"{name}[{row}] has z = {points[row, 2]:g}; expected z = 0")
    return points[:, :2]


def is_in_plane(points: NDArray[np.float64]) -> bool:
    """Whether (n, 2) or (n, 3) points lie in the plane z = 0, to float32.

    Examples
    --------
    >>> is_in_plane(np.array([[1.0, 2.0, 1e-7]])), is_in_plane(np.array([[1.0, 2.0, 1e-3]]))
    (True, False)
    """
    return bool((np.abs(points[:, 2:]) <= THICKNESS * np.abs(points).max(initial=0.0)).all())


def cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """z of the cross product of vectors in the plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def crossings(a: NDArray[np.float64], b: NDArray[np.float64] | None = None) -> bool:
    """Whether any two edges cross, of two closed polylines or of one with itself."""
    other = a if b is None else b
    da, db = np.roll(a, -1, axis=0) - a, np.roll(other, -1, axis=0) - other
    side_b = cross(da[:, None], other[None] - a[:, None]) > 0
    side_a = cross(db[None], a[:, None] - other[None]) > 0
    cut = (side_b != np.roll(side_b, -1, axis=1)) & (side_a != np.roll(side_a, -1, axis=0))
    if b is None:  # neighbours share a vertex
        i = np.arange(len(a))
        for step in (-1, 0, 1):
            cut[i, (i + step) % len(a)] = False
    return bool(cut.any())


def turn(v: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([v[..., 0] * cos - v[..., 1] * sin, v[..., 0] * sin + v[..., 1] * cos], -1)
