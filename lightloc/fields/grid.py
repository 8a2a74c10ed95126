"""A regular grid of possible light positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import array


@dataclass(frozen=True)
class Grid:
    """A regular grid of possible light positions, one cell deep in 2D.

    Args:
        lower, upper: (3,) corners of the region, metres; cells lie inside it.
        shape: number of cells along x, y, z.

    >>> Grid([0, 0, 0], [2, 1, 0], (4, 2, 1)).points[0].tolist()
    [0.25, 0.25, 0.0]
    """

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", array("Grid.lower", self.lower, (3,)))
        object.__setattr__(self, "upper", array("Grid.upper", self.upper, (3,)))
        object.__setattr__(self, "shape", tuple(int(n) for n in self.shape))
        if (self.upper < self.lower).any() or min(self.shape) < 1:
            raise ValueError("Grid needs upper >= lower and at least one cell along each axis")

    @staticmethod
    def over(bounds: ArrayLike, cells: int) -> Grid:
        """About ``cells`` cubic cells over (2, 3) bounds; flat where the bounds are flat."""
        lower, upper = np.asarray(bounds, float)
        size = upper - lower
        solid = size > 1e-9 * size.max()
        step = (np.prod(size[solid]) / cells) ** (1 / solid.sum())
        shape = [
            max(1, round(s / step)) if full else 1 for s, full in zip(size, solid, strict=True)
        ]
        return Grid(lower, upper, (shape[0], shape[1], shape[2]))

    @staticmethod
    def around(centre: ArrayLike, reach: ArrayLike, bounds: ArrayLike, cells: int) -> Grid:
        """``cells`` along each axis within ``reach`` of a centre, cut off at the bounds."""
        low, high = np.asarray(bounds, float)
        middle, half = np.asarray(centre, float), np.asarray(reach, float)
        lower = np.clip(middle - half, low, high)
        upper = np.clip(middle + half, low, high)
        x, y, z = (cells if size > 0 else 1 for size in upper - lower)
        return Grid(lower, upper, (x, y, z))

    @property
    def step(self) -> NDArray[np.float64]:
        """(3,) distance between neighbours, metres."""
        return (self.upper - self.lower) / self.shape

    @property
    def axes(self) -> list[NDArray[np.float64]]:
        """Cell centres along x, y and z, metres."""
        return [
            low + (np.arange(n) + 0.5) * step
            for low, n, step in zip(self.lower, self.shape, self.step, strict=True)
        ]

    @property
    def points(self) -> NDArray[np.float64]:
        """(g, 3) cell centres, x slowest: ``values.reshape(grid.shape)`` indexes [x, y, z]."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, 3)
