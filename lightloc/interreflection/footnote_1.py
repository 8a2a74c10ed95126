"""Indirect light, removed with the observations themselves (footnote 1 of the paper).

The observed surfaces light each other. Rays from each observed point meet the surfaces that
shine on it, and the radiance there is interpolated from the observations nearby: the indirect
part of B(q) is the integral of f(x, d, w) (n . d) L(y) over the hemisphere. The radiance of a
diffuse surface is the same in all directions, so this holds where the scene is largely diffuse
and the observations cover most of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc.backend import types
from lightloc.given import Geometry, Observations
from lightloc.optics import Surfels, cosine_direction, pick, surfels

STRATA = 32  # rays per point are STRATA^2, one in each cell of the hemisphere's unit square
GROUPS = 8  # independent parts of the rays from which the gather's own error is measured
NEIGHBOURS = 12  # observations that share in the radiance at a hit
FLATNESS = 0.25  # a neighbour counts less when this share of the reach off the hit's plane
SYSTEMATIC = 0.02  # of the indirect light: interpolation between observations (measured)
LANES = 1 << 21


@dataclass(frozen=True)
class RadianceCache:
    """The observed radiance, looked up by place: cells of space with their nearest observations."""

    lower: NDArray[np.float64]
    step: float
    shape: NDArray[np.int64]
    reach: float
    tree: cKDTree

    @staticmethod
    def of(q: Observations) -> RadianceCache:
        tree = cKDTree(q.positions)
        near, _ = tree.query(q.positions, k=min(NEIGHBOURS, len(q)))
        reach = float(np.median(np.atleast_2d(near)[:, -1]))  # usual radius of that many
        step = max(reach / 2, q.diagonal / 512)
        lower, upper = q.bounds + np.array([[-step], [step]])
        shape = np.ceil((upper - lower) / step).astype(np.int64)
        return RadianceCache(lower, step, shape, reach, tree)

    def cell(self, y: Any) -> Any:
        f = types()
        at = [
            dr.clip((y[a] - float(self.lower[a])) / self.step, 0, float(self.shape[a] - 1))
            for a in range(3)
        ]
        x, y_, z = (f.UInt32(v) for v in at)
        return (x * int(self.shape[1]) + y_) * int(self.shape[2]) + z

    def neighbours(self, cells: NDArray[np.intp]) -> NDArray[np.uint32]:
        """(m, NEIGHBOURS) nearest observations of each cell's centre."""
        where = np.stack(np.unravel_index(cells, self.shape), axis=1)
        centres = self.lower + (where + 0.5) * self.step
        _, near = self.tree.query(centres, k=NEIGHBOURS, workers=-1)
        return np.minimum(near, self.tree.n - 1).astype(np.uint32)


def remove_indirect(q: Observations, geometry: Geometry, seed: int = 0) -> Observations:
    """Remove the interreflected part of B(q), gathered from the observations themselves.

    Works on scenes that are largely diffuse and observed almost everywhere.

    Parameters
    ----------
    q : Observations
        The observations, with interreflected light in their radiance.
    geometry : Geometry
        What the gathering rays meet.
    seed : int
        Seed of those rays; same seed, same result.

    Returns
    -------
    Observations
        The same points with direct radiance, ``interreflected`` being False. The removal's own
        error is added to ``sigma``: that of the rays, measured between independent groups, and 2 %
        of the part removed for the interpolation.

    Raises
    ------
    ValueError
        Nobody knows sigma, or the observations are irradiance, which surfaces do not shine with.

    Notes
    -----
    Footnote 1 of the paper. What was removed leaves noise, so that radiance may be below zero.

    Examples
    --------
    In a diffuse sphere, with a light at its centre, the share 1 - albedo of B is direct:

    >>> import drjit as dr
    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, remove_indirect
    >>> class Ball:
    ...     def intersect(self, x, d, active=True):
    ...         t = -2 * dr.dot(x, d)
    ...         return t > 0, x + t * d
    >>> x = np.random.default_rng(0).normal(size=(2000, 3))
    >>> x /= np.linalg.norm(x, axis=1, keepdims=True)
    >>> q = Observations(positions=x, normals=-x, directions=-x, radiance=np.ones(2000),
    ...                  sigma=0.0, material=Lambert(albedo=0.3), interreflected=True)
    >>> bool(np.allclose(remove_indirect(q, Ball()).radiance, 1 - 0.3, atol=0.002))
    True
    """
    known = q.known_sigma
    if q.quantity == "irradiance":
        raise ValueError(
            "interreflected irradiance can't be gathered from other readings; give indirect, to "
            "render it"
        )
    more, error = indirect(q, geometry, seed)
    sigma = np.sqrt(known**2 + error**2 + (SYSTEMATIC * more) ** 2)
    return q.with_radiance(q.radiance - more, sigma, interreflected=False)


def indirect(
    q: Observations, geometry: Geometry, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The interreflected part of B(q), gathered from the observations, and its error: (n, c)."""
    s, cache = surfels(q, geometry), RadianceCache.of(q)
    mean, error = np.zeros_like(q.radiance), np.zeros_like(q.radiance)
    rays = STRATA * STRATA
    rows = max(1, LANES // rays)
    for first in range(0, len(q), rows):
        count = min(rows, len(q) - first)
        parts = _gather(q, s, cache, geometry, first, count, seed)
        groups = parts.reshape(count, GROUPS, -1)
        mean[first : first + count] = groups.mean(axis=1)
        error[first : first + count] = groups.std(axis=1, ddof=1) / np.sqrt(GROUPS)
    return mean, error


def _gather(
    q: Observations,
    s: Surfels,
    cache: RadianceCache,
    geometry: Geometry,
    first: int,
    count: int,
    seed: int,
) -> NDArray[np.float64]:
    """Mean of f (n . d) L / pdf over each group of rays: (count * GROUPS, c)."""
    f = types()
    rays = STRATA * STRATA
    lane = dr.arange(f.UInt32, count * rays)
    i = lane // rays + first
    ray = lane % rays
    group, member = ray // (rays // GROUPS), ray % (rays // GROUPS)
    cell = member * GROUPS + group  # neighbouring strata go to different groups
    random = f.PCG32(size=count * rays, initstate=seed, initseq=lane + first * rays)
    u = (f.Float(cell % STRATA) + random.next_float32()) / STRATA
    v = (f.Float(cell // STRATA) + random.next_float32()) / STRATA
    normal = pick(s.normal, i)
    d = cosine_direction(normal, u, v)
    hit, y = geometry.intersect(pick(s.origin, i), d)
    at = cache.cell(y)
    dr.eval(hit, y, d, at)
    cells, row = np.unique(np.array(at), return_inverse=True)
    near = f.UInt32(cache.neighbours(cells).ravel())
    first_near = f.UInt32(row.astype(np.uint32)) * NEIGHBOURS
    B = [f.Float(np.maximum(column, 0).astype(np.float32)) for column in q.radiance.T]
    light, weights = [f.Float(0) for _ in B], f.Float(0)
    for k in range(NEIGHBOURS):
        j = dr.gather(f.UInt32, near, first_near + k)
        w = _kinship(s, cache, j, y, d)
        weights += w
        light = [
            part + w * dr.gather(f.Float, column, j) for part, column in zip(light, B, strict=True)
        ]
    cosine = dr.dot(normal, d)
    share = dr.select(hit & (weights > 0) & (cosine > 0), dr.pi / (cosine * weights), 0)
    value = s.scatter(i, normal, d, pick(s.w, i)) * share
    value = [value if dr.depth_v(value) == 1 else value[c] for c in range(len(light))]
    means = [
        dr.block_sum(a * b, rays // GROUPS) * (GROUPS / rays)
        for a, b in zip(value, light, strict=True)
    ]
    dr.eval(means)
    return np.stack([np.array(m, np.float64) for m in means], axis=-1)


def _kinship(s: Surfels, cache: RadianceCache, j: Any, y: Any, d: Any) -> Any:
    """How much observation j tells of the surface at y, met by a ray along d.

    It must face the ray; it counts less with distance, and much less off the hit's plane, which
    keeps the walls of a corner apart.
    """
    away = y - pick(s.x, j)
    normal = pick(s.normal, j)
    near = dr.square(dr.rcp(1e-3 + dr.squared_norm(away) / cache.reach**2))
    off = dr.dot(normal, away) / (FLATNESS * cache.reach)
    return dr.select(dr.dot(normal, d) < 0, near * dr.exp(-dr.square(off)) + 1e-12, 0)
