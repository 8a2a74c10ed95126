"""The search for each grid point's limiter, written once as a kernel (Eq. 6, 7; section 4.1).

A lane holds a run of grid points in registers, so that an observation is fetched once for all of
them, and k radiances, which share S. What is compared is S / B: it needs no division, and D is the
reciprocal of the largest.
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
from lightloc.ceiling import Ceiling
from lightloc.culling import Clusters, bound, records, row
from lightloc.geometry import Geometry
from lightloc.grid import Grid
from lightloc.shading import Surfels, pick, unoccluded, visible

NO_LIMITER = 2**32 - 1
"""The limiter's index where no observation limits a light: D is infinite there."""

TILE = 16  # lanes of a packet on AVX-512, half a warp: they lie together, for they branch as one
SQUARE = 4  # its side

Rank = Callable[[Any], list[Any]]
Best = tuple[list[Any], list[Any]]
Visit = Callable[[Any, Best], Best]
Walk = Callable[[Visit, Best], Best]
Seen = Callable[[Any, list[Any]], list[Any]]


@dataclass(frozen=True)
class Lanes:
    """Points to be searched, ``run`` of them a lane.

    Args:
        count: number of lanes.
        points: ``run`` times (x, y, z); those that do not change along the run are shared.
        cells: ``run`` times the index of the point.
        inside: ``run`` times whether there is such a point; where not, it repeats another.
        axis: along which a run lies.
        parents: from the shape of a coarser grid to the number of its cells along a run, and to
            each of these.
    """

    count: int
    points: list[Any]
    cells: list[Any]
    inside: list[Any]
    axis: int = 2
    parents: Callable[[tuple[int, int, int]], tuple[int, Callable[[Any], Any]]] | None = None


def rows_of(points: NDArray[np.float32], run: int, chosen: Any = None) -> Lanes:
    """Any (g, 3) positions, consecutive ones together; ``chosen`` lanes alone, where given."""
    f = types()
    last = dr.opaque(f.UInt32, len(points) - 1)
    table = [f.Float(np.ascontiguousarray(column)) for column in points.T]
    lane = dr.arange(f.UInt32, -(-len(points) // run)) if chosen is None else chosen
    first = lane * run
    cells = [dr.minimum(first + r, last) for r in range(run)]
    return Lanes(
        dr.width(lane),
        [[dr.gather(f.Float, column, cell) for column in table] for cell in cells],
        cells,
        [first + r <= last for r in range(run)],
    )


def columns_of(grid: Grid, run: int, chosen: Any = None) -> Lanes:
    """A grid's points, runs of them along z, or along y where it is one cell deep.

    ``chosen`` lanes alone, where it is given.
    """
    f = types()
    w = 2 if grid.shape[2] > 1 else 1
    u, v = (a for a in range(3) if a != w)
    tile = (TILE, 1) if grid.shape[v] == 1 else (SQUARE, SQUARE)
    blocks = [-(-grid.shape[a] // t) for a, t in ((u, tile[0]), (v, tile[1]), (w, run))]
    count = blocks[0] * blocks[1] * blocks[2] * TILE
    size, bv, bw = [f.UInt32(n) for n in grid.shape], f.UInt32(blocks[1]), f.UInt32(blocks[2])
    dr.make_opaque(size, bv, bw)  # other shapes are no reason to compile again
    axes = [f.Float(axis.astype(np.float32)) for axis in grid.axes]

    lane = dr.arange(f.UInt32, count) if chosen is None else chosen
    block, within = lane // TILE, lane % TILE
    at: list[Any] = [None, None, None]
    first = block % bw * run
    block = block // bw
    at[v] = block % bv * tile[1] + within % tile[1]
    at[u] = block // bv * tile[0] + within // tile[1]
    whole = (at[u] < size[u]) & (at[v] < size[v])
    for a in (u, v):
        at[a] = dr.minimum(at[a], size[a] - 1)
    shared = {a: dr.gather(f.Float, axes[a], at[a]) for a in (u, v)}
    points, cells, inside = [], [], []
    for r in range(run):
        at[w] = dr.minimum(first + r, size[w] - 1)
        there = {**shared, w: dr.gather(f.Float, axes[w], at[w])}
        points.append([there[a] for a in range(3)])
        cells.append((at[0] * size[1] + at[1]) * size[2] + at[2])
        inside.append(whole & (first + r < size[w]))

    def parents(shape: tuple[int, int, int]) -> tuple[int, Callable[[Any], Any]]:
        steps = max(1, round(run * shape[w] / grid.shape[w]))
        parts, *coarse = (f.UInt32(m) for m in (2 * steps, *shape))
        dr.make_opaque(parts, coarse)

        def parent(step: Any) -> Any:
            middle = dr.minimum(first + run * (2 * step + 1) // parts, size[w] - 1)
            x, y, z = (
                dr.minimum((middle if a == w else at[a]) * m // size[a], m - 1)
                for a, m in enumerate(coarse)
            )
            return (x * coarse[1] + y) * coarse[2] + z

        return steps, parent

    return Lanes(dr.width(lane), points, cells, inside, w, parents)


@dataclass(frozen=True)
class Ranking:
    """Surfels with k radiances, in the order in which they are visited.

    Args:
        table: `records` of what a visit needs beside the surfel: position, normal and f / B where
            f is constant, else 1 / B.
        bounds: `Volumes.records` of the clusters' leaves and nodes, where there are clusters.
        specular: whether these hold the bounds of lobes too.
    """

    s: Surfels
    k: int
    order: Any
    table: Any
    constant: bool
    clusters: Clusters | None
    bounds: list[Any]
    specular: bool

    @staticmethod
    def of(
        s: Surfels, B: NDArray[np.float64], top: Ceiling | None, clusters: Clusters | None
    ) -> Ranking:
        """Rank by (n, k) radiances above 0."""
        constant = top is not None and top.attained
        if clusters is not None:
            order = clusters.order
        else:
            order = np.argsort(B.mean(axis=1), kind="stable")  # dark ones limit first
        rows, bounds, specular = 1 / B[order], [], False
        if top is not None:
            if constant:
                surface = np.column_stack([np.array(s.x).T, np.array(s.normal).T])[order]
                rows = np.column_stack([surface, (top.cosine / B)[order]])
            if clusters is not None:
                specular = bool(top.flat.any())
                shares = [(top.cosine / B)[order]]
                if specular:
                    shares.append((top.flat / B)[order])
                bounds = [v.records(*shares) for v in (clusters.leaves, clusters.nodes)]
        index = types().UInt32(order.astype(np.uint32))
        return Ranking(s, B.shape[1], index, records(rows), constant, clusters, bounds, specular)

    def rank(self, lanes: Lanes) -> Rank:
        """S / B of one observation, for the lane's points and, in each, the radiances."""
        return self._constant(lanes) if self.constant else self._scattered(lanes)

    def _constant(self, lanes: Lanes) -> Rank:
        axes = [a for a in range(3) if a != lanes.axis] + [lanes.axis]

        def rank(j: Any) -> list[Any]:
            q = row(self.table, j, self.s.n, lanes.count)
            values = []
            for p in lanes.points:
                d = [p[a] - q[a] for a in axes]
                height, d2 = _dot([q[3 + a] for a in axes], d), _dot(d, d)
                S = height / (d2 * dr.sqrt(d2))
                values += [S * q[6 + c] for c in range(self.k)]
            return values

        return rank

    def _scattered(self, lanes: Lanes) -> Rank:
        f = types()

        def rank(j: Any) -> list[Any]:
            i = dr.gather(f.UInt32, self.order, j)
            weight = row(self.table, j, self.s.n, lanes.count)
            values = []
            for p in lanes.points:
                S = unoccluded(self.s, i, f.Array3f(*p))
                S = [S] * self.k if dr.depth_v(S) == 1 else S
                values += [S[c] * weight[c] for c in range(self.k)]
            return values

        return rank

    def free(self, lanes: Lanes, who: list[Any], geometry: Geometry | None) -> list[Any]:
        """Whether each (point, radiance) sees the observation found for it."""
        f = types()
        result = []
        for case, j in enumerate(who):
            found = j != NO_LIMITER
            i = dr.gather(f.UInt32, self.order, j, found)
            p = f.Array3f(*lanes.points[case // self.k])
            result.append(visible(self.s, i, p, geometry, found))
        return result

    def seen(self, lanes: Lanes, geometry: Geometry | None) -> Seen:
        """Which of the lane's (point, radiance) pairs do see observation j, of those that ask."""
        f = types()

        def seen(j: Any, better: list[Any]) -> list[Any]:
            i = dr.gather(f.UInt32, self.order, j)
            start, x, facet = (pick(v, i) for v in (self.s.start, self.s.x, self.s.facet))
            result = []
            for r, p in enumerate(lanes.points):
                at = f.Array3f(*p)
                mine = better[r * self.k : (r + 1) * self.k]
                asks = functools.reduce(operator.or_, mine)
                if not self.s.flat:
                    asks &= dr.dot(facet, at - x) > 0

                def look(start: Any, at: Any, asks: Any) -> Any:
                    return geometry.visible(start, at, asks) if geometry else asks

                free = dr.if_stmt((start, at, asks), asks, look, lambda start, at, asks: asks)
                result += [b & free for b in mine]
            return result

        return seen

    def walk(self, lanes: Lanes) -> Walk:
        """Through all observations, or through the clusters that can beat a point's best."""
        return self._every() if self.clusters is None else self._promising(self.clusters, lanes)

    def _every(self) -> Walk:
        f = types()
        count = dr.opaque(f.UInt32, self.s.n)

        def walk(visit: Visit, best: Best) -> Best:
            _, best = dr.while_loop(
                (f.UInt32(0), best),
                lambda j, best: j < count,
                lambda j, best: (j + 1, visit(j, best)),
            )
            return best

        return walk

    def _promising(self, clusters: Clusters, lanes: Lanes) -> Walk:
        f = types()
        start = f.UInt32(clusters.leaves.start.astype(np.uint32))
        numbers = (len(clusters.leaves), len(clusters.nodes), clusters.fan)
        leaves, nodes, fan = (f.UInt32(v) for v in numbers)
        dr.make_opaque(leaves, nodes, fan)
        ends = lanes.points[0], lanes.points[-1]
        middle = [(a + b) / 2 for a, b in zip(*ends, strict=True)]
        half = [dr.abs(b - a) / 2 for a, b in zip(*ends, strict=True)]

        def beats(level: int, i: Any, best: Best) -> Any:
            volume = row(self.bounds[level], i, numbers[level], lanes.count)
            bounds = bound(volume, middle, half, self.k, self.specular)
            worst = [functools.reduce(dr.minimum, best[0][c :: self.k]) for c in range(self.k)]
            some = [b > w for b, w in zip(bounds, worst, strict=True)]
            return functools.reduce(operator.or_, some)

        def walk(visit: Visit, best: Best) -> Best:
            def node(i: Any, best: Best) -> tuple[Any, Best]:
                first = i * fan
                past = dr.minimum(first + fan, leaves)
                past = dr.select(beats(1, i, best), past, first)

                def leaf(i: Any, best: Best) -> tuple[Any, Best]:
                    j = dr.gather(f.UInt32, start, i)
                    end = dr.select(beats(0, i, best), dr.gather(f.UInt32, start, i + 1), j)
                    _, best = dr.while_loop(
                        (j, best), lambda j, best: j < end, lambda j, best: (j + 1, visit(j, best))
                    )
                    return i + 1, best

                _, best = dr.while_loop((first, best), lambda i, best: i < past, leaf)
                return i + 1, best

            _, best = dr.while_loop((f.UInt32(0), best), lambda i, best: i < nodes, node)
            return best

        return walk


def seeded(lanes: Lanes, shape: tuple[int, int, int], table: Any, k: int) -> Walk:
    """Visit what limits the coarser cells that a lane lies in.

    ``table`` holds an observation for each cell of a grid of that shape and each radiance. Any
    will do; the better they are, the less is visited afterwards.
    """
    f = types()
    assert lanes.parents is not None
    steps, parent = lanes.parents(shape)
    count, columns, cells = f.UInt32(steps * k), f.UInt32(k), f.UInt32(int(np.prod(shape)))
    dr.make_opaque(count, columns, cells)

    def walk(visit: Visit, best: Best) -> Best:
        def body(t: Any, best: Best) -> tuple[Any, Best]:
            at = parent(t // columns) + t % columns * cells
            return t + 1, visit(dr.gather(f.UInt32, table, at), best)

        _, best = dr.while_loop((f.UInt32(0), best), lambda t, best: t < count, body)
        return best

    return walk


def search(rank: Rank, walks: Sequence[Walk], best: Best, seen: Seen | None = None) -> Best:
    """The largest S / B and its observation, for each point and radiance of a lane.

    Args:
        best: what is known before.
        seen: asked before an observation counts; everything is visible where None.
    """

    def visit(j: Any, best: Best) -> Best:
        most, who = best
        values = rank(j)
        better = [v > m for v, m in zip(values, most, strict=True)]
        if seen is not None:
            some = functools.reduce(operator.or_, better)
            better = dr.if_stmt((j, better), some, seen, lambda j, better: better)
        return (
            [dr.select(b, v, m) for b, v, m in zip(better, values, most, strict=True)],
            [dr.select(b, j, w) for b, w in zip(better, who, strict=True)],
        )

    for walk in walks:
        best = walk(visit, best)
    return best


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """a . b with the part last added last: what a run shares is computed once a lane."""
    return dr.fma(a[2], b[2], dr.fma(a[1], b[1], a[0] * b[0]))
