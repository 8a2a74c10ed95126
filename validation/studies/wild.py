"""Outliers: values that no noise explains, each kind where it comes about."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc import Geometry, Observations, PointLights, shading
from validation.rooms import under

MOVED = 0.15  # of the diagonal: how far an object that was moved was moved
NEIGHBOURS = 8  # of a point, among which a shadow's edge runs where they differ

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Rng = np.random.Generator


def anywhere(
    q: Observations, lights: PointLights, geometry: Geometry | None, count: int, rng: Rng
) -> tuple[Indices, Array]:
    """Random points, of anything up to the brightest."""
    which = rng.permutation(len(q))[:count]
    return which, rng.uniform(0.0, q.radiance.max(), (count, 1))


def at_edges(
    q: Observations, lights: PointLights, geometry: Geometry | None, count: int, rng: Rng
) -> tuple[Indices, Array]:
    """The points nearest to shadows' edges lie on the other side of them.

    Random ones where there are not as many in a room.
    """
    open_ = shading(q, lights.positions)[:, :, 0] * lights.intensities[:, 0]
    seen = shading(q, lights.positions, geometry)[:, :, 0] > 0
    distance, near = cKDTree(q.positions).query(q.positions, NEIGHBOURS + 1)
    across = (seen[near] != seen[:, None]) & (open_ > 0)[near] & (open_ > 0)[:, None]
    away = np.where(across, distance[:, :, None], np.inf).min(axis=1)  # (n, k) of each light
    light = away.argmin(axis=1)
    nearest = away.min(axis=1)
    which = np.argsort(nearest, kind="stable")[:count]
    if not count or not np.isfinite(nearest[which[-1]]):
        return anywhere(q, lights, geometry, count, rng)
    change = open_[which, light[which]] * np.where(seen[which, light[which]], -1.0, 1.0)
    return which, np.maximum(q.radiance[which] + change[:, None], 0.0)


def object_moved(
    q: Observations, lights: PointLights, geometry: Geometry | None, count: int, rng: Rng
) -> tuple[Indices, Array]:
    """A whole piece of the surface is seen where it is not: its B is that of another place."""
    centre = q.positions[rng.integers(len(q))]
    which = np.argsort(np.linalg.norm(q.positions - centre, axis=1), kind="stable")[:count]
    if not count:
        return which, np.zeros((0, 1))
    free = np.ptp(q.positions, axis=0) > 0
    aside = rng.normal(size=3) * free
    aside *= MOVED * q.diagonal / np.linalg.norm(aside)
    piece = q.at(which)
    there = replace(piece, positions=piece.positions + aside)
    return which, under(there, lights, None).radiance


KINDS: Mapping[str, Callable[..., tuple[Indices, Array]]] = {
    "random": anywhere,
    "edges": at_edges,
    "moved": object_moved,
}
