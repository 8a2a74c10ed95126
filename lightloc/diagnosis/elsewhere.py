"""What comes from elsewhere: diffuse patches around the observations, and points far away."""

from __future__ import annotations

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


def sources(q: Observations, problem: Problem) -> Array:
    """(n, s, c) what each patch and each direction brings, its mean being that of B."""
    axes, box = problem.axes, q.bounds
    flat = len(axes) == 2
    columns = [patch(q, problem, side, int(axis)) for axis in axes for side in (0, 1)]
    middle, size = box.mean(axis=0), float(np.ptp(box, axis=0).max())
    ways = around(flat)
    far = shading(problem.surfels, middle + FAR * size * ways, problem.geometry)
    all_ = np.concatenate([*columns, far], axis=1)
    all_ = np.broadcast_to(all_, (*all_.shape[:2], q.channels))
    mean = all_.mean(axis=(0, 2), keepdims=True)
    some = mean.ravel() > 0
    return all_[:, some] / mean[:, some] * float(np.abs(q.radiance).mean())


def patch(q: Observations, problem: Problem, side: int, axis: int) -> Array:
    """(n, patches, c) the light of diffuse patches on one side of the observations' box."""
    box, axes = q.bounds, problem.axes
    inwards = 1.0 - 2.0 * side
    along = [a for a in axes if a != axis]
    size = float(np.ptp(box, axis=0).max())
    ticks = (np.arange(PATCHES * POINTS) + 0.5) / (PATCHES * POINTS)
    grid = np.stack(np.meshgrid(*[ticks] * len(along), indexing="ij"), axis=-1)
    places = np.tile(box[0], (grid[..., 0].size, 1))
    grid = grid.reshape(-1, len(along))
    places[:, along] += grid * np.ptp(box, axis=0)[along]
    places[:, axis] = box[side, axis] + inwards * INWARDS * size
    S = shading(problem.surfels, places, problem.geometry)
    off = q.positions[:, None] - places
    slant = np.maximum(off[:, :, axis] * inwards, 0) / np.maximum(
        np.linalg.norm(off, axis=2), np.finfo(float).tiny
    )
    light = S * slant[:, :, None]
    cell = np.minimum(grid * PATCHES, PATCHES - 1).astype(int)
    which = (cell * PATCHES ** np.arange(len(along))).sum(axis=1)
    return np.stack(
        [light[:, which == i].sum(axis=1) for i in range(PATCHES ** len(along))], axis=1
    )


def around(flat: bool) -> Array:
    """(u, 3) directions over the circle, or over the sphere."""
    k = np.arange(DIRECTIONS)
    if flat:
        angle = 2 * np.pi * k / DIRECTIONS
        return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    z, angle = 1 - (2 * k + 1) / DIRECTIONS, k * np.pi * (3 - np.sqrt(5))
    ring = np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
