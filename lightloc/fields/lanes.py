"""Grid points as kernels see them: a small block of them on each lane, lanes in compact tiles."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.fields.grid import Grid

TILE = 16  # lanes of a packet on AVX-512, half a warp: they branch as one, so they lie together

Shape = tuple[int, int, int]


@dataclass(frozen=True)
class Lanes:
    """Points to be searched, some of them on each lane.

    Parameters
    ----------
    count
        Number of lanes.
    points
        (x, y, z) of each of a lane's points, shared by those that have the same; the first and the
        last are corners of their box.
    cells
        The index of each.
    inside
        Whether there is such a point; where not, it repeats another.
    axes
        0, 1, 2 in the order of how many different coordinates a lane has, fewest first.
    parent
        From the shape of a coarser grid to the cell that a lane lies in.
    """

    count: int
    points: list[list[Any]]
    cells: list[Any]
    inside: list[Any]
    axes: list[int]
    parent: Callable[[Shape], Any] | None = None


def rows_of(points: NDArray[np.float32], run: int, chosen: Any = None) -> Lanes:
    """Any (g, 3) positions, ``run`` consecutive ones a lane; ``chosen`` lanes, where given."""
    f = types()
    last = dr.opaque(f.UInt32, len(points) - 1)
    table = [f.Float(np.ascontiguousarray(column)) for column in points.T]
    lane = dr.arange(f.UInt32, -(-len(points) // run)) if chosen is None else chosen
    cells = [dr.minimum(lane * run + r, last) for r in range(run)]
    return Lanes(
        dr.width(lane),
        [[dr.gather(f.Float, column, cell) for column in table] for cell in cells],
        cells,
        [lane * run + r <= last for r in range(run)],
        [0, 1, 2],
    )


def blocks_of(grid: Grid, run: int, chosen: Any = None) -> Lanes:
    """A grid's points, compact blocks of ``run`` a lane; ``chosen`` lanes, where given."""
    f = types()
    block = doubled([1, 1, 1], run, grid)
    tile = [t // b for t, b in zip(doubled(block, TILE, grid), block, strict=True)]
    tiles = [-(-m // (b * t)) for m, b, t in zip(grid.shape, block, tile, strict=True)]
    size, number = [[f.UInt32(m) for m in v] for v in (grid.shape, tiles)]
    dr.make_opaque(size, number)  # other shapes are no reason to compile again
    centres = [f.Float(axis.astype(np.float32)) for axis in grid.axes]

    rest = dr.arange(f.UInt32, int(np.prod(tiles)) * TILE) if chosen is None else chosen
    count = dr.width(rest)
    first: list[Any] = [0, 0, 0]
    for parts, steps in (
        (tile, block),
        (number, [t * b for t, b in zip(tile, block, strict=True)]),
    ):
        for a in (2, 1, 0):
            first[a] = first[a] + rest % parts[a] * steps[a]
            rest = rest // parts[a]
    beside = [[first[a] + s for s in range(block[a])] for a in range(3)]
    inside = [[i < size[a] for i in beside[a]] for a in range(3)]
    cell = [[dr.minimum(i, size[a] - 1) for i in beside[a]] for a in range(3)]
    place = [[dr.gather(f.Float, centres[a], i) for i in cell[a]] for a in range(3)]

    def parent(shape: Shape) -> Any:
        coarse = [f.UInt32(m) for m in shape]
        dr.make_opaque(coarse)
        x, y, z = (
            dr.minimum(cell[a][block[a] // 2] * m // size[a], m - 1) for a, m in enumerate(coarse)
        )
        return (x * coarse[1] + y) * coarse[2] + z

    every = list(itertools.product(*(range(b) for b in block)))
    return Lanes(
        count,
        [[place[a][s] for a, s in enumerate(which)] for which in every],
        [(cell[0][i] * size[1] + cell[1][j]) * size[2] + cell[2][k] for i, j, k in every],
        [inside[0][i] & inside[1][j] & inside[2][k] for i, j, k in every],
        [int(a) for a in np.argsort(block, kind="stable")],
        parent,
    )


def doubled(start: ArrayLike, times: int, grid: Grid) -> list[int]:
    """Cells (3,) of a block that has become ``times`` as large, each time along its shortest side.

    ``times`` is a power of two. Sides grow no further than the grid goes, unless they must.

    Examples
    --------
    >>> doubled([1, 1, 1], 8, Grid([0, 0, 0], [3, 3, 3], (30, 30, 30)))
    [2, 2, 2]
    >>> doubled([1, 1, 1], 8, Grid([0, 0, 0], [3, 3, 0], (30, 30, 1)))
    [2, 4, 1]
    """
    block = np.array(start)
    while times > 1:
        short = np.where(
            block < grid.shape, block * np.maximum(grid.step, np.finfo(float).tiny), np.inf
        )
        axis = 2 - int(np.argmin(short[::-1] if np.isfinite(short).any() else block[::-1]))
        block[axis] *= 2
        times //= 2
    return [int(b) for b in block]
