"""A regular grid of possible light positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import array
from lightloc.reprs import short


@dataclass(frozen=True)
class Grid:
    """A regular grid of possible light positions, one cell deep in 2D.

    Parameters
    ----------
    lower, upper : (3,) array_like
        Corners of the region, in the unit of length; the cells fill it.
    shape : (int, int, int)
        Number of cells along x, y, z, each at least 1.

    Raises
    ------
    ValueError
        If a corner is not three finite numbers, an upper coordinate is less than the lower one, or
        there is no cell along an axis.

    Examples
    --------
    Positions are the centres of the cells:

    >>> from lightloc import Grid
    >>> Grid([0, 0, 0], [2, 1, 0], (4, 2, 1)).points[0].tolist()
    [0.25, 0.25, 0.0]
    """

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    shape: tuple[int, int, int]

    __repr__ = short

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", array("Grid.lower", self.lower, (3,)))
        object.__setattr__(self, "upper", array("Grid.upper", self.upper, (3,)))
        object.__setattr__(self, "shape", tuple(int(n) for n in self.shape))
        if (self.upper < self.lower).any() or min(self.shape) < 1:
            raise ValueError("Grid needs upper >= lower and at least one cell along each axis")

    @staticmethod
    def over(bounds: ArrayLike, cells: int) -> Grid:
        """Lay about so many cubic cells over a region, one deep along an axis without extent.

        Parameters
        ----------
        bounds : (2, 3) array_like
            Lower and upper corner of the region, in the unit of length.
        cells : int
            Number of cells, about.

        Returns
        -------
        Grid
            The grid.

        Raises
        ------
        ValueError
            If an upper coordinate is less than the lower one.

        Examples
        --------
        >>> from lightloc import Grid
        >>> [Grid.over([[0, 0, 0], [2, 1, depth]], 200 * 10**depth).shape for depth in (0, 1)]
        [(20, 10, 1), (20, 10, 10)]
        """
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
        """Lay a grid about a centre, cut off at the bounds.

        Parameters
        ----------
        centre : (3,) array_like
            Middle of the grid, in the unit of length.
        reach : (3,) array_like
            How far it extends from there to either side, in the unit of length.
        bounds : (2, 3) array_like
            Lower and upper corner of the region that it keeps to, in the unit of length.
        cells : int
            Number of cells along each axis; 1 along an axis without extent.

        Returns
        -------
        Grid
            The grid.

        Raises
        ------
        ValueError
            If there is no cell.

        Examples
        --------
        >>> from lightloc import Grid
        >>> near = Grid.around([0.9, 0.5, 0], [0.2, 0.2, 0.2], [[0, 0, 0], [1, 1, 0]], 5)
        >>> near.lower.round(6).tolist(), near.upper.round(6).tolist(), near.shape
        ([0.7, 0.3, 0.0], [1.0, 0.7, 0.0], (5, 5, 1))
        """
        low, high = np.asarray(bounds, float)
        middle, half = np.asarray(centre, float), np.asarray(reach, float)
        lower = np.clip(middle - half, low, high)
        upper = np.clip(middle + half, low, high)
        x, y, z = (cells if size > 0 else 1 for size in upper - lower)
        return Grid(lower, upper, (x, y, z))

    @property
    def step(self) -> NDArray[np.float64]:
        """(3,) distance between the centres of neighbouring cells, in the unit of length."""
        return (self.upper - self.lower) / self.shape

    @property
    def axes(self) -> list[NDArray[np.float64]]:
        """Cell centres along x, y and z: three arrays, as long as ``shape`` says."""
        return [
            low + (np.arange(n) + 0.5) * step
            for low, n, step in zip(self.lower, self.shape, self.step, strict=True)
        ]

    @property
    def points(self) -> NDArray[np.float64]:
        """(g, 3) cell centres, in the order of ``values.reshape(grid.shape)[x, y, z]``."""
        return np.stack(np.meshgrid(*self.axes, indexing="ij"), axis=-1).reshape(-1, 3)
