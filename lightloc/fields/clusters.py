"""Which observations can limit a light here? Clusters of observations, and bounds on S / B.

Most observations are too far from a grid point, too bright or turned away to be its limiter.
A kd tree makes clusters of neighbours; of each the kernel knows a box, a cone of normals and the
largest f / B, and from these a bound on S(q, p) / B(q) for all of its observations and all points
of a lane. Where that cannot beat what the lane already has, the cluster is left out, exactly.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types

LEAF = 16  # observations in a cluster, at most (measured: 8 as fast, 32 is 15 % slower)
FAN = 4  # clusters in a node (measured: 8 and 16 are 5 to 20 % slower)
FEW = 16  # nodes at the top, at most
ROUNDING = 1e-6  # of the span: what boxes grow by, 8 roundings of float32
SLACK = 1e-4  # relative: what a bound grows by, the rounding of a BRDF in float32 included
CACHE_LINE = 16  # float32
TOUCHING = 1e-25  # a squared length: boxes that are nearer have no bound, |d|^3 being no float32
TINY = 1e-12  # a mean normal shorter than this has no direction


@dataclass(frozen=True)
class Volumes:
    """Bounds of consecutive runs of observations.

    Parameters
    ----------
    start : (m + 1,) array
        First observation of each run, and n.
    shape : (m, 11) array
        Box centre, half size, axis of the normals; how far any normal is from the axis; how far any
        observation lies behind the centre, along the axis.
    """

    start: NDArray[np.int64]
    shape: NDArray[np.float32]

    @staticmethod
    def around(
        start: NDArray[np.int64], x: NDArray[np.float64], n: NDArray[np.float64], span: float
    ) -> Volumes:
        """Bound runs of (n, 3) positions and normals; ``span`` is the size of the region."""
        first, run = start[:-1], np.repeat(np.arange(len(start) - 1), np.diff(start))
        low, high = np.minimum.reduceat(x, first), np.maximum.reduceat(x, first)
        centre = _float32((low + high) / 2)
        half = np.maximum(high - centre, centre - low) + ROUNDING * span
        axis = np.add.reduceat(n, first)
        axis = _float32(axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), TINY))
        spread = np.maximum.reduceat(np.linalg.norm(n - axis[run], axis=1), first) + ROUNDING
        behind = np.maximum.reduceat(((centre[run] - x) * axis[run]).sum(axis=1), first)
        behind += ROUNDING * span
        columns = np.column_stack([centre, half, axis, spread, behind])
        return Volumes(start, columns.astype(np.float32))

    def __len__(self) -> int:
        return len(self.shape)

    def records(self, *weights: NDArray[np.float64]) -> Any:
        """``shape`` and the largest of each (n, k) weight in each run, for `bound`."""
        most = [np.maximum.reduceat(w, self.start[:-1]) * (1 + SLACK) for w in weights]
        return records(np.column_stack([self.shape, *most]))


@dataclass(frozen=True)
class Clusters:
    """Observations in the order of a kd tree, cut into leaves, with nodes above them.

    `FAN` leaves make a node, `FAN` nodes one above these, and so on up to a few.

    Parameters
    ----------
    order : (n,) array
        From that order to the observations' own.
    levels
        The leaves, then the nodes of every level above them.
    """

    order: NDArray[np.int64]
    levels: list[Volumes]

    @staticmethod
    def of(x: NDArray[np.float64], n: NDArray[np.float64], span: float) -> Clusters:
        """Cluster (n, 3) positions with their normals; ``span`` is the size of the region."""
        x, n = _float32(x), _float32(n)
        order, start = kd_order(np.concatenate([x, n * span], axis=1), LEAF)
        x, n = x[order], n[order]
        levels = [Volumes.around(start, x, n, span)]
        while len(levels[-1]) > FEW:
            start = np.append(start[:-1:FAN], start[-1])
            levels.append(Volumes.around(start, x, n, span))
        return Clusters(order, levels)

    @functools.cached_property
    def counts(self) -> tuple[Any, list[Any]]:
        """For kernels: where each leaf starts, and the number of clusters on each level."""
        f = types()
        numbers = [f.UInt32(len(level)) for level in self.levels]
        dr.make_opaque(numbers)  # other numbers are no reason to compile again
        return f.UInt32(self.levels[0].start.astype(np.uint32)), numbers


def kd_order(
    features: NDArray[np.float64], leaf: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Halve (n, d) points along their widest axis until at most ``leaf`` are together.

    Returns the order (n,) and where in it each leaf starts, n at the end.

    Examples
    --------
    >>> order, start = kd_order(np.array([[3.0], [0.0], [2.0], [1.0]]), 2)
    >>> order.tolist(), start.tolist()
    ([1, 3, 2, 0], [0, 2, 4])
    """
    order, size = np.arange(len(features)), np.array([len(features)])
    while size.max() > leaf:
        first = np.cumsum(size) - size
        there = features[order]
        width = np.maximum.reduceat(there, first) - np.minimum.reduceat(there, first)
        node = np.repeat(np.arange(len(size)), size)
        key = np.take_along_axis(there, width.argmax(axis=1)[node][:, None], axis=1)[:, 0]
        order = order[np.lexsort((key, node))]
        size = np.stack([size // 2, size - size // 2], axis=1).ravel()
    return order, np.concatenate([[0], np.cumsum(size)])


def records(rows: NDArray[np.float64]) -> Any:
    """(m, r) numbers as one Dr.Jit array of rows as long as a power of two, to gather whole.

    Rows that share a cache line are read several times as fast as columns, if the memory is
    aligned so that Dr.Jit can tell.
    """
    m, r = rows.shape
    width = 1 << (r - 1).bit_length()
    memory = np.zeros(m * width + CACHE_LINE, np.float32)
    first = -memory.ctypes.data % (4 * CACHE_LINE) // 4
    aligned = memory[first : first + m * width]
    aligned.reshape(m, width)[:, :r] = rows
    return types().Float(aligned)


def row(table: Any, i: Any, m: int, lanes: int) -> Any:
    """Row i of a table of m `records`."""
    return dr.gather(types().ArrayXf, table, i, shape=(dr.width(table) // m, lanes))


def bound(
    volume: Any, middle: Sequence[Any], half: Sequence[Any], k: int, specular: bool
) -> list[Any]:
    """k upper bounds on S(q, p) / B(q), for q in a cluster and p in a box.

    With d from x to p: n.d <= a.d + spread |d| for the cone's axis a, and a.d is largest at a
    corner of the box of all d; |d| is smallest at the face nearest to 0. The BRDF's ceiling,
    f (n.l)_+ <= flat + cosine (n.l)_+, gives S <= flat / |d|^2 + cosine n.d / |d|^3.
    """
    centre, size, axis = volume[0:3], volume[3:6], volume[6:9]
    spread, behind, weights = volume[9], volume[10], volume[11:]
    d = [m - c for m, c in zip(middle, centre, strict=True)]
    reach = [s + h for s, h in zip(size, half, strict=True)]
    gap = [dr.maximum(dr.abs(v) - r, 0) for v, r in zip(d, reach, strict=True)]
    near2 = gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]
    near = dr.sqrt(near2)
    height = behind
    for a, v, h in zip(axis, d, half, strict=True):
        height += a * v + dr.abs(a) * h
    cosine = (dr.maximum(height, 0) + spread * near) / (near2 * near)
    result = [weights[c] * cosine for c in range(k)]
    if specular:
        result = [value + weights[k + c] / near2 for c, value in enumerate(result)]
    return [dr.select(near2 > TOUCHING, value, dr.inf) for value in result]


def _float32(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """As kernels will see it."""
    return np.asarray(v, np.float32).astype(np.float64)
