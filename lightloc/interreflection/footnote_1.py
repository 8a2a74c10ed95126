"""Indirect light, removed with the observations themselves (footnote 1 of the paper).

The observed surfaces light each other. Rays from each observed point meet the surfaces that
shine on it, and the radiance there is interpolated from the observations nearby: the indirect
part of B(q) is the integral of f(x, d, w) (n . d) L(y) over the hemisphere. The radiance of a
diffuse surface is the same in all directions, so this holds where the scene is largely diffuse
and the observations cover most of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc.backend import types
from lightloc.deadline import left
from lightloc.given import Geometry, Observations
from lightloc.interreflection.gloss import glossiness
from lightloc.optics import Surfels, cosine_direction, pick, surfels

ENDED = (
    "footnote 1 would gather longer paths than observations with a max_depth hold; render "
    "interreflected light, by localize with a geometry that can"
)
STRATA = 32  # rays per point are STRATA^2, one in each cell of the hemisphere's unit square
FEWEST, GATHERING = 8, 0.5  # the same at first, and share of the time left, where time is short
GROUPS = 8  # independent parts of the rays from which the gather's own error is measured
NEIGHBOURS = 12  # observations that share in the radiance at a hit
FLATNESS = 0.25  # a neighbour counts less when this share of the reach off the hit's plane
DRAWS = 4  # of signs for the error of the interpolation
POOL = 16  # neighbours whose errors of interpolation are pooled
ALIKE = 0.7  # cosine between normals of neighbours on one surface
NEAR = 2.0  # reaches within which an observation tells what a surface sends
SLIP, BENT = 0.01, 4.0  # reaches that a hit may be off an observation's plane, to be told by it;
# and of what its neighbours are: at twice their distance a curved surface is off by four times that
GLOSS = 0.15  # error of the indirect light, as a share of what is reflected by direction (measured)
LANES = 1 << 21


@dataclass(frozen=True)
class RadianceCache:
    """The observed radiance, looked up by place: cells of space with their nearest observations.

    ``slack`` (n,) is how far off its plane an observation tells what a surface sends: nothing is
    told of a lamp or a pane that is mounted on a wall, whose neighbours all lie in one plane.
    """

    lower: NDArray[np.float64]
    step: float
    shape: NDArray[np.int64]
    reach: float
    tree: cKDTree
    slack: NDArray[np.float64]

    @staticmethod
    def of(q: Observations) -> RadianceCache:
        tree, n = cKDTree(q.positions), len(q)
        far, near = (a.reshape(n, -1) for a in tree.query(q.positions, k=min(NEIGHBOURS, n)))
        reach = float(np.median(far[:, -1]))  # usual radius of that many
        off = np.einsum("ni,nki->nk", q.normals, q.positions[near] - q.positions[:, None])
        alike = np.einsum("ni,nki->nk", q.normals, q.normals[near]) > ALIKE
        bent = np.abs(off * alike).max(axis=1)
        slack = np.minimum(SLIP * reach + BENT * bent, FLATNESS * reach)
        step = max(reach / 2, q.diagonal / 512)
        lower, upper = q.bounds + np.array([[-step], [step]])
        shape = np.ceil((upper - lower) / step).astype(np.int64)
        return RadianceCache(lower, step, shape, reach, tree, slack)

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
        error is added to ``sigma``: that of the rays, of the interpolation, of what comes from
        surfaces near which nothing is observed, and of what is glossy.

    Raises
    ------
    ValueError
        Nobody knows sigma, the observations are irradiance, which surfaces do not shine with, or
        their paths end (``max_depth``), while gathered light has bounced once more.

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
    return removed(q, geometry, seed).direct


@dataclass(frozen=True, eq=False)
class Removal:
    """What footnote 1 leaves.

    Parameters
    ----------
    direct
        The observations without their interreflected light, with all its errors in their sigma.
    shared : (s, n, c) array
        Of these, the parts that neighbours share: one standard error each, W sr^-1 m^-2.
    """

    direct: Observations
    shared: NDArray[np.float64]


def removed(q: Observations, geometry: Geometry, seed: int = 0) -> Removal:
    """Remove the interreflected part of B(q), and say all that is wrong with that.

    Four errors add up: that of the rays; that of the interpolation, told by how well each
    observation is predicted by its neighbours; all of what comes from surfaces near which nothing
    is observed; and a share of what is glossy, which sends elsewhere what it does not send to the
    viewer.

    The errors of neighbours' predictions are gathered as radiance is: as they are, which is what
    they share, and each with a sign drawn at random, as they add up if each has its own cause.
    """
    n, c = q.radiance.shape
    if q.quantity == "irradiance":
        raise ValueError(
            "interreflected irradiance can't be gathered from other readings; give indirect, to "
            "render it"
        )
    if q.max_depth is not None:
        raise ValueError(ENDED)
    known, B, cache = q.known_sigma, np.maximum(q.radiance, 0), RadianceCache.of(q)
    unlike = left_out(q, cache)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (DRAWS, n, 1))
    signed = (signs * unlike).swapaxes(0, 1).reshape(n, -1)
    mean, rays = _gathered(np.concatenate([B, unlike, signed], axis=1), q, cache, geometry, seed)
    more, smooth, unseen = mean[:, :c], mean[:, c : 2 * c], mean[:, -c:]
    drawn = np.square(mean[:, 2 * c : -c]).reshape(n, DRAWS, c).mean(axis=1)
    _, near = cache.tree.query(q.positions, k=min(POOL, n))
    interpolated = drawn[near.reshape(n, -1)].mean(axis=1)
    glossy = GLOSS * glossiness(q, seed) * more
    shared = np.stack([smooth, unseen, glossy])
    error = np.square(rays[:, :c]) + interpolated + np.square(shared[1:]).sum(axis=0)
    sigma = np.sqrt(np.square(known) + error)
    return Removal(q.with_radiance(q.radiance - more, sigma, interreflected=False), shared)


def indirect(
    q: Observations, geometry: Geometry, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The interreflected part of B(q), gathered from the observations, and its rays' error."""
    B = np.maximum(q.radiance, 0)
    mean, error = _gathered(B, q, RadianceCache.of(q), geometry, seed)
    return mean[:, : q.channels], error[:, : q.channels]


def is_told(
    q: Observations, cache: RadianceCache, y: NDArray[np.float64], d: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(m,) whether one is near (m, 3) points, on the surface that a ray along d meets."""
    _, near = cache.tree.query(y, k=min(NEIGHBOURS, len(q)))
    near = near.reshape(len(y), -1)
    away = y[:, None] - q.positions[near]
    off = np.abs(np.einsum("mki,mki->mk", q.normals[near], away)) < cache.slack[near]
    close = np.linalg.norm(away, axis=2) < NEAR * cache.reach
    faces = np.einsum("mki,mi->mk", q.normals[near], d) < 0
    return np.asarray((off & close & faces).any(axis=1))


def left_out(q: Observations, cache: RadianceCache) -> NDArray[np.float64]:
    """By how much each observation's radiance differs from what its neighbours tell: (n, c)."""
    n, k = len(q), min(NEIGHBOURS + 1, len(q))
    _, near = cache.tree.query(q.positions, k=k)
    near = near.reshape(n, k)[:, 1:]
    away = q.positions[:, None] - q.positions[near]
    off = np.einsum("nki,nki->nk", q.normals[near], away) / (FLATNESS * cache.reach)
    weight = 1 / np.square(1e-3 + np.square(away).sum(axis=2) / cache.reach**2)
    weight = weight * np.exp(-np.square(off)) + 1e-12
    weight *= np.einsum("nki,ni->nk", q.normals[near], q.normals) > 0
    whole = weight.sum(axis=1, keepdims=True)
    told = np.einsum("nk,nkc->nc", weight, q.radiance[near]) / np.maximum(whole, 1e-12)
    return np.where(whole > 0, told - q.radiance, 0.0)


def _gathered(
    columns: NDArray[np.float64],
    q: Observations,
    cache: RadianceCache,
    geometry: Geometry,
    seed: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each of (n, m) columns gathered, then the first c from where nothing is observed.

    Returns the mean and its standard error from the rays, (n, m + c) each.
    """
    s, n = surfels(q, geometry), len(q)

    def each(strata: int) -> NDArray[np.float64]:
        rows = max(1, LANES // strata**2)
        parts = []
        for first in range(0, n, rows):
            count = min(rows, n - first)
            part = _gather(columns, q.channels, s, cache, geometry, first, count, seed, strata)
            parts.append(part.reshape(count, GROUPS, -1))
        return np.concatenate(parts)

    groups = in_so_many(each)
    return groups.mean(axis=1), groups.std(axis=1, ddof=1) / np.sqrt(GROUPS)


def in_so_many(gather: Callable[[int], NDArray[np.float64]]) -> NDArray[np.float64]:
    """What is gathered in `STRATA`, or in as many as a deadline leaves time for.

    Fewer are tried first then, and four times as many rays take four times as long.
    """
    if math.isinf(left()):
        return gather(STRATA)
    strata = FEWEST
    while True:
        clock = time.monotonic()
        groups = gather(strata)
        if strata == STRATA or 4 * (time.monotonic() - clock) > GATHERING * left():
            return groups
        strata *= 2


def _gather(
    columns: NDArray[np.float64],
    channels: int,
    s: Surfels,
    cache: RadianceCache,
    geometry: Geometry,
    first: int,
    count: int,
    seed: int,
    strata: int,
) -> NDArray[np.float64]:
    """Mean of f (n . d) L / pdf over each group of rays: (count * GROUPS, m + c)."""
    f = types()
    rays = strata * strata
    lane = dr.arange(f.UInt32, count * rays)
    i = lane // rays + first
    ray = lane % rays
    group, member = ray // (rays // GROUPS), ray % (rays // GROUPS)
    cell = member * GROUPS + group  # neighbouring strata go to different groups
    random = f.PCG32(size=count * rays, initstate=seed, initseq=lane + first * rays)
    u = (f.Float(cell % strata) + random.next_float32()) / strata
    v = (f.Float(cell // strata) + random.next_float32()) / strata
    normal = pick(s.normal, i)
    d = cosine_direction(normal, u, v)
    hit, y = geometry.intersect(pick(s.origin, i), d)
    at = cache.cell(y)
    dr.eval(hit, y, d, at)
    cells, row = np.unique(np.array(at), return_inverse=True)
    near = f.UInt32(cache.neighbours(cells).ravel())
    first_near = f.UInt32(row.astype(np.uint32)) * NEIGHBOURS
    slack = f.Float(cache.slack.astype(np.float32))
    sent = [f.Float(column.astype(np.float32)) for column in columns.T]
    light, weights, seen = [f.Float(0) for _ in sent], f.Float(0), f.Bool(False)
    for k in range(NEIGHBOURS):
        j = dr.gather(f.UInt32, near, first_near + k)
        w, told = _kinship(s, cache, dr.gather(f.Float, slack, j), j, y, d)
        weights += w
        seen |= told
        light = [
            part + w * dr.gather(f.Float, column, j)
            for part, column in zip(light, sent, strict=True)
        ]
    cosine = dr.dot(normal, d)
    share = dr.select(hit & (weights > 0) & (cosine > 0), dr.pi / (cosine * weights), 0)
    value = s.scatter(i, normal, d, pick(s.w, i)) * share
    value = [value] if dr.depth_v(value) == 1 else list(value)
    light += [dr.select(seen, 0, part) for part in light[:channels]]
    means = [
        dr.block_sum(value[c % len(value)] * b, rays // GROUPS) * (GROUPS / rays)
        for c, b in enumerate(light)
    ]
    dr.eval(means)
    return np.stack([np.array(m, np.float64) for m in means], axis=-1)


def _kinship(
    s: Surfels, cache: RadianceCache, slack: Any, j: Any, y: Any, d: Any
) -> tuple[Any, Any]:
    """How much observation j tells of the surface at y, met by a ray along d; whether it is near.

    It must face the ray; it counts less with distance, and much less off the hit's plane, which
    keeps the walls of a corner apart.
    """
    away = y - pick(s.x, j)
    normal = pick(s.normal, j)
    near = dr.square(dr.rcp(1e-3 + dr.squared_norm(away) / cache.reach**2))
    above = dr.dot(normal, away)
    off = above / (FLATNESS * cache.reach)
    faces, apart = dr.dot(normal, d) < 0, dr.squared_norm(away)
    told = faces & (apart < (NEAR * cache.reach) ** 2) & (dr.abs(above) < slack)
    return dr.select(faces, near * dr.exp(-dr.square(off)) + 1e-12, 0), told
