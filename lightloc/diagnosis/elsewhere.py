"""What comes from elsewhere: diffuse patches around the observations, and points far away."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import Problem
from lightloc.given import Observations
from lightloc.optics import shading

Array = NDArray[np.float64]

PATCHES, POINTS = 3, 2
"""Along each axis of a side: patches, and the points that each is made of."""

INWARDS = 1e-3
"""Of the longest side: how far before the wall a patch lies."""

FAR, DIRECTIONS = 3.0, 32
"""Of the longest side: how far away what is far is put; directions that are asked."""


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """What sources elsewhere bring.

    Parameters
    ----------
    columns : (n, s, c) array
        Of each, in radiance; its mean is that of B.
    patches : tuple of (int, int, (d - 1,) array), or None
        Of each, the side (0 the lower, 1 the upper) and the axis that it is across, and its middle,
        in 0..1 along the other axes; None of one that is far away.
    """

    columns: Array
    patches: tuple[tuple[int, int, Array] | None, ...]


def sources(q: Observations, problem: Problem) -> Elsewhere:
    """Patches of all sides, and points in all directions."""
    box, flat = q.bounds, len(problem.axes) == 2
    cells, points = ticks(PATCHES, len(problem.axes) - 1), ticks(POINTS, len(problem.axes) - 1)
    grid = cells[:, None] + (points - 0.5) / PATCHES
    columns, patches = [], list[tuple[int, int, Array] | None]()
    for axis in problem.axes:
        for side in (0, 1):
            light = diffuse(q, problem, side, int(axis), grid.reshape(-1, grid.shape[2]))
            columns.append(light.reshape(len(q), len(cells), len(points), -1).sum(axis=2))
            patches += [(side, int(axis), cell) for cell in cells]
    far = box.mean(axis=0) + FAR * float(np.ptp(box, axis=0).max()) * around(flat)
    columns.append(shading(problem.surfels, far, problem.geometry))
    whole = np.concatenate(columns, axis=1)
    whole = np.broadcast_to(whole, (*whole.shape[:2], q.channels))
    mean = whole.mean(axis=(0, 2), keepdims=True)
    lit = mean.ravel() > 0
    told = tuple(one for one, some in zip([*patches, *[None] * len(far)], lit, strict=True) if some)
    return Elsewhere(whole[:, lit] / mean[:, lit] * float(np.abs(q.radiance).mean()), told)


def ticks(count: int, d: int) -> Array:
    """(count^d, d) middles of so many cells along each axis of the unit square, or interval."""
    each = (np.arange(count) + 0.5) / count
    return np.stack(np.meshgrid(*[each] * d, indexing="ij"), axis=-1).reshape(-1, d)


def diffuse(q: Observations, problem: Problem, side: int, axis: int, grid: Array) -> Array:
    """(n, g, c) the light of diffuse points on one side of the observations' box.

    ``grid`` (g, d - 1) is where, in 0..1 along the other axes.
    """
    box, inwards = q.bounds, 1.0 - 2.0 * side
    along = [a for a in problem.axes if a != axis]
    places = np.tile(box[0], (len(grid), 1))
    places[:, along] += grid * np.ptp(box, axis=0)[along]
    places[:, axis] = box[side, axis] + inwards * INWARDS * float(np.ptp(box, axis=0).max())
    S = shading(problem.surfels, places, problem.geometry)
    off = q.positions[:, None] - places
    far = np.maximum(np.linalg.norm(off, axis=2), np.finfo(float).tiny)
    return np.asarray(S * (np.maximum(off[:, :, axis] * inwards, 0) / far)[:, :, None])


def around(flat: bool) -> Array:
    """(u, 3) directions over the circle, or over the sphere."""
    k = np.arange(DIRECTIONS)
    if flat:
        angle = 2 * np.pi * k / DIRECTIONS
        return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    z, angle = 1 - (2 * k + 1) / DIRECTIONS, k * np.pi * (3 - np.sqrt(5))
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
