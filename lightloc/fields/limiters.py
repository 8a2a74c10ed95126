"""The search for each grid point's limiter, written once as a kernel (Eq. 6, 7; section 4.1).

Where the paper takes the least B / S, the kernel keeps the observation of the largest S / B. L(p)
is the index of that observation; its point is ``q.positions[L]``.

A lane holds a block of grid points in registers, so that an observation is fetched once for all of
them, and k radiances, which share S.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr

from lightloc.backend import types
from lightloc.fields.clusters import FAN, Clusters, bound, row
from lightloc.fields.lanes import Lanes, Shape
from lightloc.fields.ranking import NO_LIMITER, Ranking, Seen

Best = tuple[list[Any], list[Any]]
"""For each (point, radiance) of a lane the largest S / B, and whose it is."""
Visit = Callable[[Any, Best], Best]
Walk = Callable[[Visit, Best], Best]


@dataclass(frozen=True)
class Found:
    """The best of g points and k radiances in memory, one radiance after another."""

    most: Any
    who: Any
    g: int
    k: int

    @staticmethod
    def empty(g: int, k: int) -> Found:
        """Memory for it, still without content."""
        f = types()
        return Found(dr.empty(f.Float, g * k), dr.empty(f.UInt32, g * k), g, k)

    def put(self, lanes: Lanes, best: Best) -> None:
        inside = [mask for mask in lanes.inside for _ in range(self.k)]
        for m, w, at, mask in zip(*best, self._places(lanes), inside, strict=True):
            dr.scatter(self.most, m, at, mask, mode=dr.ReduceMode.NoConflicts)
            dr.scatter(self.who, w, at, mask, mode=dr.ReduceMode.NoConflicts)

    def take(self, lanes: Lanes) -> Best:
        f, places = types(), self._places(lanes)
        return (
            [dr.gather(f.Float, self.most, at) for at in places],
            [dr.gather(f.UInt32, self.who, at) for at in places],
        )

    def _places(self, lanes: Lanes) -> list[Any]:
        return [cell + c * self.g for cell in lanes.cells for c in range(self.k)]


def nothing(lanes: Lanes, k: int) -> Best:
    """No observation yet."""
    f, cases = types(), len(lanes.points) * k
    return (
        [dr.zeros(f.Float, lanes.count) for _ in range(cases)],
        [dr.full(f.UInt32, NO_LIMITER, lanes.count) for _ in range(cases)],
    )


def without(best: Best, hidden: list[Any]) -> Best:
    """The same, but nothing where it is hidden."""
    most, who = best
    return (
        [dr.select(h, 0, m) for h, m in zip(hidden, most, strict=True)],
        [dr.select(h, NO_LIMITER, w) for h, w in zip(hidden, who, strict=True)],
    )


@dataclass(frozen=True)
class Seeds:
    """What was found for the cells of a coarser grid of that shape.

    Any observations would do; the better they are, the less is visited afterwards.
    """

    found: Found
    shape: Shape

    def walk(self, lanes: Lanes) -> Walk:
        """Visit those of the cell that a lane lies in."""
        f = types()
        assert lanes.parent is not None
        parent = lanes.parent(self.shape)
        k, g = f.UInt32(self.found.k), f.UInt32(self.found.g)
        dr.make_opaque(k, g)

        def walk(visit: Visit, best: Best) -> Best:
            def body(t: Any, best: Best) -> Best:
                j = dr.gather(f.UInt32, self.found.who, parent + t * g)
                return visit(dr.select(j == NO_LIMITER, 0, j), best)

            return _loop(f.UInt32(0), k, body, best)

        return walk


def search(
    q: Ranking, lanes: Lanes, best: Best, seeds: Seeds | None = None, seen: Seen | None = None
) -> Best:
    """Keep what ranks above ``best`` and is seen; everything is where None."""
    rank = q.rank(lanes)

    def visit(j: Any, best: Best) -> Best:
        most, who = best
        values = rank(j)
        better = [v > m for v, m in zip(values, most, strict=True)]
        if seen is not None:
            better = dr.if_stmt((j, better), any_of(better), seen, lambda j, better: better)
        return (
            [dr.select(b, v, m) for b, v, m in zip(better, values, most, strict=True)],
            [dr.select(b, j, w) for b, w in zip(better, who, strict=True)],
        )

    if seeds is not None:
        best = seeds.walk(lanes)(visit, best)
    through = _every(q) if q.clusters is None else _promising(q, q.clusters, lanes)
    return through(visit, best)


def _every(q: Ranking) -> Walk:
    """Through all observations."""
    f = types()
    count = dr.opaque(f.UInt32, q.s.n)
    return lambda visit, best: _loop(f.UInt32(0), count, visit, best)


def _promising(q: Ranking, clusters: Clusters, lanes: Lanes) -> Walk:
    """Through the clusters that can beat a point's best."""
    f = types()
    start, numbers = clusters.counts
    ends = lanes.points[0], lanes.points[-1]
    middle = [(a + b) / 2 for a, b in zip(*ends, strict=True)]
    half = [dr.abs(b - a) / 2 for a, b in zip(*ends, strict=True)]

    def beats(level: int, i: Any, best: Best) -> Any:
        volume = row(q.bounds[level], i, len(clusters.levels[level]), lanes.count)
        bounds = bound(volume, middle, half, q.k, q.specular)
        worst = [functools.reduce(dr.minimum, best[0][c :: q.k]) for c in range(q.k)]
        return any_of([b > w for b, w in zip(bounds, worst, strict=True)])

    def into(level: int, visit: Visit) -> Visit:
        """Visit the members of a cluster on that level, if it is worth it."""

        def cluster(i: Any, best: Best) -> Best:
            if level == 0:
                first, end, inner = (
                    dr.gather(f.UInt32, start, i),
                    dr.gather(f.UInt32, start, i + 1),
                    visit,
                )
            else:
                first, end = i * FAN, dr.minimum(i * FAN + FAN, numbers[level - 1])
                inner = into(level - 1, visit)
            return _loop(first, dr.select(beats(level, i, best), end, first), inner, best)

        return cluster

    top = len(clusters.levels) - 1
    return lambda visit, best: _loop(f.UInt32(0), numbers[top], into(top, visit), best)


def _loop(first: Any, end: Any, body: Callable[[Any, Best], Best], best: Best) -> Best:
    """for i in range(first, end): best = body(i, best)."""
    _, best = dr.while_loop(
        (first, best), lambda i, best: i < end, lambda i, best: (i + 1, body(i, best))
    )
    return best


def any_of(masks: Sequence[Any]) -> Any:
    return functools.reduce(operator.or_, masks)
