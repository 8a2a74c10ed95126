"""The scene transforms: I(q,p), the intensity-distance field D(p) and the limiter L(p)."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.checks import array
from lightloc.geometry import Geometry
from lightloc.observations import Observations
from lightloc.shading import shading, surfels, unoccluded, visible

NO_LIMITER = 2**32 - 1
"""The limiter's index where no observation limits a light: D is infinite there."""


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
    def points(self) -> NDArray[np.float64]:
        """(g, 3) cell centres, x slowest: ``values.reshape(grid.shape)`` indexes [x, y, z]."""
        axes = [
            low + (np.arange(n) + 0.5) * step
            for low, n, step in zip(self.lower, self.shape, self.step, strict=True)
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def intensity(
    q: Observations, positions: ArrayLike, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """I(q, p) = B(q) / S(q, p), Eq. 3, in W/sr: (n, k, c); infinite where S = 0."""
    S = shading(q, positions, geometry)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(S > 0, q.radiance[:, None, :] / S, np.inf)


def intensity_distance(
    q: Observations, positions: ArrayLike, geometry: Geometry | None = None, margin: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """D(p) = min_q I(q, p) and its limiting observation L(p), Eq. 6 and 7, exactly.

    What is the brightest that a light can be at p? Each D is an upper bound on the intensity of
    a light at p, for any number of lights.

    Args:
        positions: (g, 3) metres, as `Grid.points`.
        margin: B is raised by this many standard errors first, so that the bound holds under
            noise with that confidence.

    Returns:
        D (g, c) in W/sr, infinite where nothing limits; L (g, c), an index into ``q`` or
        `NO_LIMITER`.
    """
    f = types()
    s = surfels(q)
    points = array("positions", positions, (None, 3)).astype(np.float32)
    if not len(points):
        return np.zeros((0, q.channels)), np.zeros((0, q.channels), np.uint32)
    B = np.maximum(q.radiance + margin * q.sigma, 0.0)
    order = np.argsort(B.mean(axis=1), kind="stable").astype(np.uint32)  # dark ones limit first
    index = f.UInt32(order)
    p = f.Array3f(*(f.Float(column) for column in points.T))
    D, L = [], []
    for c in range(q.channels):
        bright = f.Float(B[:, c].astype(np.float32))
        least = dr.full(f.Float, np.inf, len(points))
        who = dr.full(f.UInt32, NO_LIMITER, len(points))
        j = f.UInt32(0)
        count = dr.opaque(f.UInt32, len(q))

        def more(j, least, who, count=count):
            return j < count

        def body(j, least, who, c=c, bright=bright):
            i = dr.gather(f.UInt32, index, j)
            S = unoccluded(s, i, p)
            S = S if dr.depth_v(S) == 1 else S[c]
            bound = dr.gather(f.Float, bright, i) / S
            better = (S > 0) & (bound < least)
            better &= visible(s, i, p, geometry, better)
            return j + 1, dr.select(better, bound, least), dr.select(better, i, who)

        j, least, who = dr.while_loop((j, least, who), more, body, labels=("j", "D", "L"))
        dr.eval(least, who)
        D.append(np.array(least, np.float64))
        L.append(np.array(who))
    return np.stack(D, axis=1), np.stack(L, axis=1)
