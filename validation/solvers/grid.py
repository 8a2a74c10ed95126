"""Non-negative least squares over a light in each cell of a grid; clusters of cells are lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.optimize import nnls

from lightloc import Geometry, Grid, Observations, remove_indirect, shading

CELLS, SAMPLE = 10**3, 2048  # more cells than observations split a light
DIM, FAINT = 1e-3, 1e-2  # of all the light: a cell that joins nothing, a cluster that is no light
DARK = 0.3  # of the median standard error: none counts as smaller


def solve(
    q: Observations, geometry: Geometry | None, bounds: object = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (k, 3) and intensities (k, c); ``bounds`` are those of the observations if None."""
    box = [q.positions.min(axis=0), q.positions.max(axis=0)] if bounds is None else bounds
    q = remove_indirect(q, geometry) if q.interreflected and geometry else q
    some = q.at(np.random.default_rng(0).permutation(len(q))[:SAMPLE])
    sigma = errors(some)
    grid = Grid.over(np.asarray(box, float), CELLS)
    cells = fitted(some, shading(some, grid.points, geometry), sigma)
    bright = cells.mean(axis=1)
    named, count = label((bright > DIM * bright.sum()).reshape(grid.shape), np.ones((3, 3, 3)))
    groups = [named.ravel() == i for i in range(1, count + 1)]
    groups = [group for group in groups if bright[group].sum() >= FAINT * bright.sum()]
    places = [bright[group] @ grid.points[group] / bright[group].sum() for group in groups]
    positions = np.array(places).reshape(-1, 3)
    return positions, fitted(some, shading(some, positions, geometry), sigma)


def fitted(
    q: Observations, S: NDArray[np.float64], sigma: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(g, c) intensities of lights whose shading is (n, g, c), none below 0."""
    each = [
        nnls(S[:, :, min(c, S.shape[2] - 1)] / sigma[:, c, None], q.radiance[:, c] / sigma[:, c])[0]
        for c in range(q.channels)
    ]
    return np.stack(each, axis=1)


def errors(q: Observations) -> NDArray[np.float64]:
    """(n, c) standard errors, those that are 0 or nearly so raised; all alike where unknown."""
    if q.sigma is None or not q.sigma.any():
        return np.full(q.radiance.shape, 1e-3 * float(np.abs(q.radiance).mean()) or 1.0)
    return np.maximum(q.sigma, DARK * np.median(q.sigma, axis=0))
