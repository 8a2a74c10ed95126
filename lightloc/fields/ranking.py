"""S / B of an observation at the points of a lane, and whether they see it.

What is compared is S / B: it needs no division, and D is the reciprocal of the largest.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.brdf import Ceiling
from lightloc.fields.clusters import Clusters, records, row
from lightloc.fields.lanes import Lanes
from lightloc.given import Geometry
from lightloc.optics import Surfels, pick, unoccluded, visible

NO_LIMITER = 2**32 - 1
"""The limiter's index where no observation limits a light: D is infinite there."""

Seen = Callable[[Any, list[Any]], list[Any]]
"""Of the (point, radiance) pairs that ask, those that do see an observation."""

DARKEST = 1e-30  # W sr^-1 m^-2: up to this B is 0, and so is D; 1 / B stays finite in float32


@dataclass(frozen=True)
class Ranking:
    """Surfels with k radiances, in the order in which they are visited.

    Parameters
    ----------
    s
        The surfels.
    k
        Number of radiances.
    order : (n,) array
        From that order to the surfels' own.
    table
        `records` of what a visit needs: where f is constant position, normal and f / B, else 1 / B
        alone.
    constant
        Whether f is.
    clusters
        Those of the observations, if there are any.
    bounds
        `Volumes.records` of the clusters, level by level, where there are any.
    specular
        Whether these hold the bounds of lobes too.
    """

    s: Surfels
    k: int
    order: NDArray[np.int64]
    table: Any
    constant: bool
    clusters: Clusters | None
    bounds: list[Any]
    specular: bool

    @staticmethod
    def of(
        s: Surfels,
        surface: NDArray[np.float32],
        B: NDArray[np.float64],
        top: Ceiling | None,
        clusters: Clusters | None,
    ) -> Ranking:
        """Rank by (n, k) radiances; ``surface`` (n, 6) is the surfels' positions and normals."""
        B = np.maximum(B, DARKEST)
        if clusters is not None:
            order = clusters.order
        else:
            order = np.argsort(B.mean(axis=1), kind="stable")  # dark ones limit first
        constant = top is not None and top.attained
        rows, shares, bounds = 1 / B[order], [], []
        if top is not None and (constant or clusters is not None):
            shares = [(part / B)[order] for part in (top.cosine, top.flat)]
            shares = shares if top.flat.any() else shares[:1]
        if constant:
            rows = np.column_stack([surface[order], shares[0]])
        if clusters is not None:
            bounds = [level.records(*shares) for level in clusters.levels]
        k, specular = B.shape[1], len(shares) == 2
        return Ranking(s, k, order, records(rows), constant, clusters, bounds, specular)

    @functools.cached_property
    def index(self) -> Any:
        """``order`` for kernels."""
        return types().UInt32(self.order.astype(np.uint32))

    def rank(self, lanes: Lanes) -> Callable[[Any], list[Any]]:
        """S / B of one observation, for each (point, radiance) of the lane."""
        f = types()

        def constant(j: Any) -> list[Any]:
            q = row(self.table, j, self.s.n, lanes.count)
            values = []
            for p in lanes.points:
                d = [p[a] - q[a] for a in lanes.axes]
                height, d2 = _dot([q[3 + a] for a in lanes.axes], d), _dot(d, d)
                S = height / (d2 * dr.sqrt(d2))
                values += [S * q[6 + c] for c in range(self.k)]
            return values

        def scattered(j: Any) -> list[Any]:
            i = dr.gather(f.UInt32, self.index, j)
            weight = row(self.table, j, self.s.n, lanes.count)
            values = []
            for p in lanes.points:
                S = unoccluded(self.s, i, f.Array3f(*p))
                S = [S] * self.k if dr.depth_v(S) == 1 else S
                values += [S[c] * weight[c] for c in range(self.k)]
            return values

        return constant if self.constant else scattered

    def hidden(self, lanes: Lanes, who: list[Any], geometry: Geometry | None) -> list[Any]:
        """Whether each (point, radiance) does not see the observation that was found for it."""
        f = types()
        result = []
        for case, j in enumerate(who):
            found = j != NO_LIMITER
            i = dr.gather(f.UInt32, self.index, j, found)
            p = f.Array3f(*lanes.points[case // self.k])
            result.append(found & ~visible(self.s, i, p, geometry, found))
        return result

    def seen(self, lanes: Lanes, geometry: Geometry | None) -> Seen:
        """Which of the (point, radiance) pairs that ask do see observation j."""
        f = types()

        def look(origin: Any, p: Any, asks: Any) -> Any:
            return asks if geometry is None else geometry.visible(origin, p, asks)

        def seen(j: Any, asking: list[Any]) -> list[Any]:
            i = dr.gather(f.UInt32, self.index, j)
            origin, x, facet = (pick(v, i) for v in (self.s.origin, self.s.x, self.s.facet))
            result = []
            for r, point in enumerate(lanes.points):
                p, mine = f.Array3f(*point), asking[r * self.k : (r + 1) * self.k]
                asks = functools.reduce(operator.or_, mine) & (dr.dot(facet, p - x) > 0)
                free = dr.if_stmt((origin, p, asks), asks, look, lambda origin, p, asks: asks)
                result += [b & free for b in mine]
            return result

        return seen


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """a . b with the last part added last: what a lane's points share is computed once."""
    return dr.fma(a[2], b[2], dr.fma(a[1], b[1], a[0] * b[0]))
