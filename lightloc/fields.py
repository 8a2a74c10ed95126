"""The scene transforms: I(q,p), the intensity-distance field D(p) and the limiter L(p)."""

from __future__ import annotations

import functools
import operator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.brdf import Bounded
from lightloc.ceiling import Ceiling
from lightloc.checks import array
from lightloc.culling import Clusters
from lightloc.geometry import Geometry
from lightloc.grid import Grid
from lightloc.limiters import (
    NO_LIMITER,
    Best,
    Lanes,
    Ranking,
    Seen,
    columns_of,
    rows_of,
    search,
    seeded,
)
from lightloc.observations import Observations
from lightloc.shading import Surfels, shading, surfels

RUN = 8  # grid points on a lane (measured: 4 fetch too often, 16 spill and cull less)
LEAST_RUN = 3
REGISTERS = 48  # (grid point, radiance) pairs on a lane, at most: more spill (measured)
COLUMNS = 10  # radiances at once: with six numbers of the surfel they fill a record of 16
WORTH = 64  # observations: fewer are not worth clusters
COARSER = {2: 8, 3: 4}  # cells along an axis to one of the grid that seeds are taken from
DARKEST = 1e-30  # W sr^-1 m^-2: up to this B is 0, and so is D; 1 / B stays finite in float32
COARSEST = 4096  # cells that are searched without seeds


def intensity(
    q: Observations, positions: ArrayLike, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """I(q, p) = B(q) / S(q, p), Eq. 3, in W/sr: (n, k, c); infinite where S = 0."""
    S = shading(q, positions, geometry)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(S > 0, q.radiance[:, None, :] / S, np.inf)


def intensity_distance(
    q: Observations,
    positions: ArrayLike | Grid,
    geometry: Geometry | None = None,
    margin: float = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """D(p) = min_q I(q, p) and its limiting observation L(p), Eq. 6 and 7, exactly.

    What is the brightest that a light can be at p? Each D is an upper bound on the intensity of
    a light at p, for any number of lights.

    Args:
        positions: (g, 3) metres, or a `Grid`, which is many times as fast as its points.
        margin: B is raised by this many standard errors first, so that the bound holds under
            noise with that confidence.

    Returns:
        D (g, c) in W/sr, infinite where nothing limits; L (g, c), an index into ``q`` or
        `NO_LIMITER`.
    """
    B = np.maximum(q.radiance + margin * q.sigma, 0.0)
    return limits(surfels(q), B, positions, geometry)


def limits(
    s: Surfels, B: ArrayLike, where: ArrayLike | Grid, geometry: Geometry | None = None
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """D and L for k radiances over the same surfels at once, Eq. 6 and 7.

    Whoever has many of them, one after another, keeps a `Field`.

    Args:
        B: (n, k) radiances, at least 0; a material of three channels needs k = 3.
        where: (g, 3) positions in metres, or a `Grid`.

    Returns:
        D (g, k) and L (g, k) as `intensity_distance`.
    """
    D, L = Field.over(s, where, geometry).limits(B)
    return D.astype(np.float64), L


@dataclass(frozen=True, eq=False)
class Field:
    """Surfels and positions, ready for D and L of one radiance after another.

    Made by `Field.over`. On a `Grid`, observations that cannot be limiters are left out by
    clusters, where the material says how bright it can be; the result is the same.
    """

    surfels: Surfels
    where: Grid | NDArray[np.float32]
    geometry: Geometry | None
    ceiling: Ceiling | None
    clusters: Clusters | None
    coarser: Field | None

    @staticmethod
    def over(
        s: Surfels,
        where: ArrayLike | Grid,
        geometry: Geometry | None = None,
        *,
        cull: bool = True,
    ) -> Field:
        """Prepare; ``where`` is a `Grid` or (g, 3) positions in metres.

        With ``cull`` off every pair is evaluated, as a yardstick.
        """
        x, n, w = (np.array(v).T.astype(np.float64) for v in (s.x, s.normal, s.w))
        top = None
        if isinstance(s.material, Bounded):
            top = s.material.ceiling((n * w).sum(axis=1, keepdims=True))
        if not isinstance(where, Grid):
            points = array("positions", where, (None, 3)).astype(np.float32)
            return Field(s, points, geometry, top, None, None)
        clusters = None
        if cull and top is not None and s.n >= WORTH:
            ends = np.concatenate([x, [where.lower, where.upper]])
            clusters = Clusters.of(x, n, float(np.linalg.norm(np.ptp(ends, axis=0))))
        return Field._on(s, where, geometry, top, clusters)

    @staticmethod
    def _on(
        s: Surfels,
        grid: Grid,
        geometry: Geometry | None,
        top: Ceiling | None,
        clusters: Clusters | None,
    ) -> Field:
        coarser = None
        if clusters is not None and np.prod(grid.shape) > COARSEST:
            factor = COARSER[2 if min(grid.shape) == 1 else 3]
            shape = [-(-m // factor) for m in grid.shape]
            coarse = Grid(grid.lower, grid.upper, (shape[0], shape[1], shape[2]))
            coarser = Field._on(s, coarse, geometry, top, clusters)
        return Field(s, grid, geometry, top, clusters, coarser)

    def __len__(self) -> int:
        return int(np.prod(self.where.shape)) if isinstance(self.where, Grid) else len(self.where)

    def limits(self, B: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """D (g, k) and L (g, k) of (n, k) radiances, as `limits` but as computed, in float32."""
        B = array("B", B, (self.surfels.n, None), least=0.0)
        k = B.shape[1]
        if not len(self):
            return np.zeros((0, k), np.float32), np.zeros((0, k), np.uint32)
        channels = 1 if self.surfels.material is None else self.surfels.material.channels
        if channels == 3 != k:
            raise ValueError(f"B has {k} columns; expected 3, as the material has")
        D, L = np.empty((k, len(self)), np.float32), np.empty((k, len(self)), np.uint32)
        for first in range(0, k, COLUMNS):
            some = slice(first, first + COLUMNS)
            d, i = self._search(B[:, some])
            D[some], L[some] = (
                np.array(d).reshape(-1, len(self)),
                np.array(i).reshape(-1, len(self)),
            )
        return D.T, L.T

    def _search(self, B: NDArray[np.float64]) -> tuple[Any, Any]:
        """D and L as Dr.Jit arrays, one radiance after another.

        What limits most is found first as if nothing occluded. Only lanes with a point that does
        not see its limiter search again, asking each time what is visible.
        """
        f = types()
        k, size = B.shape[1], len(self)
        coarse = None if self.coarser is None else self._places(self.coarser._search(B)[1])
        q = Ranking.of(self.surfels, np.maximum(B, DARKEST), self.ceiling, self.clusters)
        most, who = dr.zeros(f.Float, size * k), dr.full(f.UInt32, NO_LIMITER, size * k)
        dr.make_opaque(most, who)

        def improve(lanes: Lanes, best: Best, seen: Seen | None) -> Best:
            walks = [q.walk(lanes)]
            if coarse is not None:
                walks = [seeded(lanes, self.coarser.where.shape, coarse, k), *walks]
            return search(q.rank(lanes), walks, best, seen)

        def places(lanes: Lanes) -> list[Any]:
            return [cell + c * size for cell in lanes.cells for c in range(k)]

        def put(lanes: Lanes, best: Best) -> None:
            inside = [mask for mask in lanes.inside for _ in range(k)]
            for m, w, at, mask in zip(*best, places(lanes), inside, strict=True):
                dr.scatter(most, m, at, mask, mode=dr.ReduceMode.NoConflicts)
                dr.scatter(who, w, at, mask, mode=dr.ReduceMode.NoConflicts)

        lanes = self._lanes(k)
        cases = len(lanes.points) * k
        nothing = (
            [dr.zeros(f.Float, lanes.count) for _ in range(cases)],
            [dr.full(f.UInt32, NO_LIMITER, lanes.count) for _ in range(cases)],
        )
        best = improve(lanes, nothing, None)
        if self.geometry is None and self.surfels.flat:
            put(lanes, best)
        else:
            free = q.free(lanes, best[1], self.geometry)
            hidden = [(w != NO_LIMITER) & ~seen for seen, w in zip(free, best[1], strict=True)]
            best = (
                [dr.select(h, 0, m) for h, m in zip(hidden, best[0], strict=True)],
                [dr.select(h, NO_LIMITER, w) for h, w in zip(hidden, best[1], strict=True)],
            )
            put(lanes, best)
            again = functools.reduce(operator.or_, hidden)
            dr.eval(most, who, again)
            chosen = dr.compress(again)
            if dr.width(chosen):
                lanes = self._lanes(k, chosen)
                best = (
                    [dr.gather(f.Float, most, at) for at in places(lanes)],
                    [dr.gather(f.UInt32, who, at) for at in places(lanes)],
                )
                put(lanes, improve(lanes, best, q.seen(lanes, self.geometry)))
        dr.eval(most, who)
        found = who != NO_LIMITER
        i = dr.select(found, dr.gather(f.UInt32, q.order, who, found), NO_LIMITER)
        dark = f.Bool((DARKEST >= B).T.ravel())
        column = dr.arange(f.UInt32, size * k) // dr.opaque(f.UInt32, size) * self.surfels.n
        zero = dr.gather(f.Bool, dark, column + i, found)
        D = dr.select(zero, 0, 1 / most)
        dr.eval(D, i)
        return D, i

    def _lanes(self, k: int, chosen: Any = None) -> Lanes:
        run = max(LEAST_RUN, min(RUN, REGISTERS // k))
        if isinstance(self.where, Grid):
            return columns_of(self.where, run, chosen)
        return rows_of(self.where, run, chosen)

    def _places(self, L: Any) -> Any:
        """Where limiters stand in the clusters' order; no limiter stands anywhere."""
        f = types()
        assert self.clusters is not None
        place = np.empty(self.surfels.n + 1, np.uint32)
        place[self.clusters.order] = np.arange(self.surfels.n)
        place[-1] = 0
        return dr.gather(f.UInt32, f.UInt32(place), dr.minimum(L, self.surfels.n))
