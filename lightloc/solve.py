"""Lights from residuals: intensities are linear, positions by Levenberg-Marquardt.

A `Fit` is a value: lights, their residuals in standard errors, and their robust cost. Rows of a
Jacobian are (observation, channel) pairs; columns are the free coordinates of each light, then
intensities.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from lightloc.geometry import Geometry
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.shading import Surfels, radiance, shading, shading_gradient, surfels

INSIDE = 1e-6
"""Starts lie this share of the region inside its bounds: a start on a bound does not move."""

FREE = 1e-12
"""A parameter with less than this share in a direction that the data leave free has none in it."""


@dataclass(frozen=True)
class Problem:
    """B(q), its standard errors and everything the fits share."""

    surfels: Surfels
    radiance: NDArray[np.float64]  # (n, c)
    sigma: NDArray[np.float64]  # (n, c), > 0
    geometry: Geometry | None
    bounds: NDArray[np.float64]  # (2, 3)

    @staticmethod
    def of(q: Observations, sigma: NDArray, geometry: Geometry | None, bounds: NDArray) -> Problem:
        return Problem(surfels(q), q.radiance, sigma, geometry, bounds)

    @property
    def axes(self) -> NDArray[np.intp]:
        """The coordinates that lights may move along: two of them in a 2D scene."""
        size = self.bounds[1] - self.bounds[0]
        return np.flatnonzero(size > 1e-9 * size.max())

    @property
    def rows(self) -> int:
        return self.radiance.size

    def rows_of(self, some: NDArray[np.intp]) -> Problem:
        """The same problem posed by some of its observations."""
        return replace(
            self,
            surfels=self.surfels.take(some),
            radiance=self.radiance[some],
            sigma=self.sigma[some],
        )


@dataclass(frozen=True)
class Fit:
    """Lights that were fitted, with chi-square (robust where it was asked for)."""

    lights: PointLights
    residual: NDArray[np.float64]  # (n, c), (B - model) / sigma
    cost: float

    def __len__(self) -> int:
        return len(self.lights)


def robust(z: NDArray, scale: float) -> float:
    """Sum of Cauchy's loss: z^2 near zero, growing like a logarithm beyond ``scale``."""
    return float((scale**2 * np.log1p((z / scale) ** 2)).sum())


def no_lights(problem: Problem, scale: float) -> Fit:
    z = problem.radiance / problem.sigma
    lights = PointLights(np.zeros((0, 3)), np.zeros((0, z.shape[1])))
    return Fit(lights, z, robust(z, scale))


def residuals(problem: Problem, lights: PointLights) -> NDArray[np.float64]:
    """(B - model) / sigma: (n, c)."""
    return (problem.radiance - radiance(problem.surfels, lights, problem.geometry)) / problem.sigma


def intensities(problem: Problem, positions: NDArray) -> NDArray[np.float64]:
    """Non-negative least squares for the (k, c) intensities of lights at (k, 3) positions."""
    S = shading(problem.surfels, positions, problem.geometry)
    c = problem.radiance.shape[1]
    result = np.zeros((len(positions), c))
    for channel in range(c):
        A = S[:, :, min(channel, S.shape[2] - 1)] / problem.sigma[:, channel, None]
        result[:, channel] = nnls(A, problem.radiance[:, channel] / problem.sigma[:, channel])[0]
    return result


def refine(problem: Problem, lights: PointLights, scale: float, evaluations: int = 60) -> Fit:
    """Polish positions and intensities together from where ``lights`` are.

    Exact derivatives through the BRDF, true visibility, bounds from the region, and Cauchy's
    loss beyond ``scale`` standard errors, so that the few observations that a shadow's edge
    leaves on the wrong side do not hold a light back.
    """
    model = _Model(problem, len(lights))
    lower, upper = model.limits()
    start = np.clip(model.pack(lights), lower + INSIDE * model.width, upper - INSIDE * model.width)
    found = least_squares(
        model.residual,
        start,
        model.jacobian,
        bounds=(lower, upper),
        x_scale="jac",
        loss="cauchy",
        f_scale=scale,
        max_nfev=evaluations,
        ftol=1e-6,
        xtol=1e-8,
        gtol=1e-8,
    )
    if not np.isfinite(found.x).all():
        raise FloatingPointError("the refinement left the finite numbers")
    z = -model.residual(found.x).reshape(problem.radiance.shape)
    return Fit(model.unpack(found.x), z, robust(z, scale))


def covariance(problem: Problem, lights: PointLights) -> NDArray[np.float64]:
    """Covariance of (free coordinates of each light, then intensities) from the Fisher information.

    From an SVD of the whitened Jacobian; directions that the data leave free get infinity.
    """
    model = _Model(problem, len(lights))
    J = model.jacobian(model.pack(lights))
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    _, s, Vt = np.linalg.svd(J / size, full_matrices=False)
    seen = s > s.max(initial=0) * J.shape[0] * np.finfo(float).eps
    inverse = np.where(seen, 1 / np.where(seen, s, 1) ** 2, np.inf)
    share = Vt[:, :, None] * Vt[:, None, :]
    share[(np.abs(share) < FREE) & ~seen[:, None, None]] = 0.0
    with np.errstate(invalid="ignore"):
        spread = np.where(share == 0, 0, share * inverse[:, None, None])
        return np.nansum(spread, axis=0) / np.outer(size, size)


class _Model:
    """Residuals and Jacobian over the packed parameters; S and its gradient in one launch."""

    def __init__(self, problem: Problem, k: int) -> None:
        self.problem, self.k, self.axes = problem, k, problem.axes
        self.c = problem.radiance.shape[1]
        self.at: NDArray | None = None

    @property
    def width(self) -> NDArray:
        size = (self.problem.bounds[1] - self.problem.bounds[0])[self.axes]
        return np.concatenate([np.tile(size, self.k), np.ones(self.k * self.c)])

    def limits(self) -> tuple[NDArray, NDArray]:
        low, high = self.problem.bounds[:, self.axes]
        many = self.k * self.c
        return (
            np.concatenate([np.tile(low, self.k), np.full(many, -INSIDE)]),
            np.concatenate([np.tile(high, self.k), np.full(many, np.inf)]),
        )

    def pack(self, lights: PointLights) -> NDArray:
        return np.concatenate([lights.positions[:, self.axes].ravel(), lights.intensities.ravel()])

    def unpack(self, x: NDArray) -> PointLights:
        positions, I = self._split(x)
        return PointLights(positions, np.maximum(I, 0.0))

    def _split(self, x: NDArray) -> tuple[NDArray, NDArray]:
        d = len(self.axes)
        positions = np.tile(self.problem.bounds[0], (self.k, 1))
        positions[:, self.axes] = x[: self.k * d].reshape(self.k, d)
        return positions, x[self.k * d :].reshape(self.k, self.c)

    def _evaluate(self, x: NDArray) -> None:
        if self.at is not None and np.array_equal(self.at, x):
            return
        positions, _ = self._split(x)
        S, gradient = shading_gradient(self.problem.surfels, positions, self.problem.geometry)
        shape = (*S.shape[:2], self.c)
        self.S = np.broadcast_to(S, shape)
        self.gradient = np.broadcast_to(gradient[..., self.axes], (*shape, len(self.axes)))
        self.at = x.copy()

    def residual(self, x: NDArray) -> NDArray:
        self._evaluate(x)
        _, I = self._split(x)
        model = np.einsum("nkc,kc->nc", self.S, I)
        return ((model - self.problem.radiance) / self.problem.sigma).ravel()

    def jacobian(self, x: NDArray) -> NDArray:
        self._evaluate(x)
        _, I = self._split(x)
        n, k, c, d = self.gradient.shape
        weight = 1 / self.problem.sigma
        moved = np.einsum("nkcd,kc,nc->nckd", self.gradient, I, weight).reshape(n * c, k * d)
        brighter = np.einsum("nkc,nc,ce->ncke", self.S, weight, np.eye(c)).reshape(n * c, k * c)
        return np.concatenate([moved, brighter], axis=1)
