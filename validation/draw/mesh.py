"""Lines that show a mesh: where it ends or folds, and where a level cuts it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

CREASE_DEGREES = 20.0  # faces that meet at less are one smooth surface

Array = NDArray[Any]


def creases(vertices: Array, faces: Array, merge: float) -> NDArray[np.float32]:
    """Return the edges (n, 2, 3) where a mesh ends or folds: those that show a room's shape.

    A square's diagonal is no such edge, even where each of its triangles has its own corners.

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> len(creases(square, np.arange(6).reshape(2, 3), 1e-6))
    4
    """
    if len(faces) == 0:
        return np.zeros((0, 2, 3), dtype=np.float32)
    cells = np.round(vertices / max(merge, np.finfo(np.float32).tiny))
    _, first, same = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    corners = same.reshape(-1)[faces]
    places = vertices[first].astype(np.float64)
    normals = np.cross(
        places[corners[:, 1]] - places[corners[:, 0]], places[corners[:, 2]] - places[corners[:, 0]]
    )
    size = np.linalg.norm(normals, axis=1)
    corners, normals = corners[size > 0], normals[size > 0] / size[size > 0, None]
    sides = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    owner = np.tile(np.arange(len(corners)), 3)
    edges, which, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    one = owner[order[start]]
    other = owner[order[start + np.minimum(count, 2) - 1]]
    # The faces may be wound either way, so only the angle between their planes counts.
    fold = np.abs(np.sum(normals[one] * normals[other], axis=1))
    sharp = (count != 2) | (fold < np.cos(np.radians(CREASE_DEGREES)))
    return places[edges[sharp]].astype(np.float32)


def section(room: Mapping[str, Array], height: float) -> NDArray[np.float64]:
    """Return the segments (n, 2, 2) in which a room's triangles meet the plane z = height.

    Examples
    --------
    >>> room = {"vertices": np.array([[0, 0, 0], [2, 0, 0], [0, 0, 4]]), "faces": [[0, 1, 2]]}
    >>> sorted(section(room, 2.0)[0].tolist()), len(section(room, 5.0))
    ([[0.0, 0.0], [1.0, 0.0]], 0)
    """
    triangles = np.asarray(room["vertices"], dtype=float)[np.asarray(room["faces"], dtype=int)]
    above = triangles[..., 2] >= height
    mixed = above.any(axis=1) & ~above.all(axis=1)
    triangles, above = triangles[mixed], above[mixed]
    ends = np.roll(triangles, -1, axis=1)
    crossing = above != np.roll(above, -1, axis=1)  # two sides of each triangle left
    start, end = triangles[crossing], ends[crossing]
    share = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
    crossed = start[:, :2] + share[:, None] * (end[:, :2] - start[:, :2])
    return np.asarray(crossed.reshape(-1, 2, 2))


def strokes(segments: Array) -> NDArray[np.float32]:
    """Segments (n, 2, d) as d rows of coordinates with a gap after each: one trace draws all."""
    padded = np.pad(segments, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    return padded.reshape(-1, segments.shape[2]).T.astype(np.float32)
