"""What is fitted to what: B(q) with its errors, lights, and the residuals that they leave."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear, nnls

from lightloc.fit.law import Law, law_left
from lightloc.fit.loss import robust
from lightloc.fit.pattern import neighbours
from lightloc.fit.subtracted import Subtracted
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics import Surfels, radiance, shading, surfels


@dataclass(frozen=True)
class Problem:
    """B(q), its standard errors and everything the fits share.

    Parameters
    ----------
    surfels
        The n observations.
    radiance, sigma : (n, c) array
        B and its standard errors, above 0, W sr^-1 m^-2.
    geometry
        What occludes; nothing does where None.
    bounds : (2, 3) array
        Corners of the region that may hold lights, in the unit of length.
    ambient : (n, c) array, optional
        Radiance of the same dim light from everywhere (section 6.3), whose amount every fit solves
        for; None where there is none.
    unit : str
        Of length, for sentences.
    step
        By which radiance is rounded; 0 where it is not.
    subtracted
        What is no longer in ``radiance``; nothing where None.
    places : (k, 3) array, optional
        Where all lights are held; None where they may move.
    """

    surfels: Surfels
    radiance: NDArray[np.float64]
    sigma: NDArray[np.float64]
    geometry: Geometry | None
    bounds: NDArray[np.float64]
    ambient: NDArray[np.float64] | None = None
    unit: str = "m"
    step: float = 0.0
    subtracted: Subtracted | None = None
    places: NDArray[np.float64] | None = None

    @staticmethod
    def of(
        q: Observations,
        sigma: NDArray[np.float64],
        geometry: Geometry | None,
        bounds: NDArray[np.float64],
        *,
        double: bool = False,
        ambient: NDArray[np.float64] | None = None,
    ) -> Problem:
        """Pose the problem; with ``double``, kernels compute in 64 bits."""
        return Problem(
            surfels(q, geometry, double=double),
            q.radiance,
            sigma,
            geometry,
            bounds,
            ambient,
            q.unit,
            q.step,
        )

    @cached_property
    def axes(self) -> NDArray[np.intp]:
        """The coordinates that lights may move along: two of them in a 2D scene."""
        if self.places is not None:
            return np.zeros(0, np.intp)
        size = self.bounds[1] - self.bounds[0]
        return np.flatnonzero(size > 1e-9 * size.max())

    @cached_property
    def rows(self) -> int:
        """The number of residuals that tell: none in a channel that is black everywhere."""
        lit = int(self.radiance.any(axis=0).sum())
        return len(self.radiance) * (lit or self.radiance.shape[1])

    @property
    def size(self) -> float:
        """The region's longest side, in the unit of length."""
        return float(np.ptp(self.bounds, axis=0).max())

    @property
    def measure(self) -> float:
        """An intensity near that which leaves a radiance of 1 across the region: a power of 4.

        In its units numbers over a search's grid fit float32 whatever the unit of length.
        """
        return float(4.0 ** np.round(np.log2(self.size)))

    @cached_property
    def neighbours(self) -> NDArray[np.intp]:
        """(m, 2) pairs of observations that lie near each other and face the same way."""
        s = self.surfels
        return neighbours(*(np.array(v, np.float64).reshape(3, -1).T for v in (s.x, s.normal)))

    @cached_property
    def nuisance(self) -> NDArray[np.float64] | None:
        """(c, n) the ambient term in standard errors, of unit length in each channel."""
        if self.ambient is None:
            return None
        u = (self.ambient / self.sigma).T
        return u / np.maximum(np.linalg.norm(u, axis=1, keepdims=True), np.finfo(float).tiny)

    def without_ambient(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Residuals (n, c) with as much ambient light as explains them best."""
        if self.nuisance is None:
            return z
        u = self.nuisance.T
        return z - u * (u * z).sum(axis=0)

    def rows_of(self, some: NDArray[np.intp]) -> Problem:
        """The same problem posed by some of its observations."""
        return replace(
            self,
            surfels=self.surfels.take(some),
            radiance=self.radiance[some],
            sigma=self.sigma[some],
            ambient=None if self.ambient is None else self.ambient[some],
            subtracted=None if self.subtracted is None else self.subtracted.rows_of(some),
        )

    def law_of(self, model: NDArray[np.float64], left: NDArray[np.float64], parameters: int) -> Law:
        """The likeliest law of what a (n, c) model, fitted with so many parameters, leaves."""
        if self.subtracted is None:
            return law_left(left, model, parameters)
        whole = model + self.subtracted.radiance
        return law_left(left, whole, parameters, self.subtracted.error)

    def errors_by(self, law: Law, model: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) standard errors of B by a law of its noise, where the model is (n, c).

        As they were in a channel in which nothing tells it.
        """
        if self.subtracted is None:
            noise = law.sigma(model)
            return np.where(noise > 0, noise, self.sigma)
        noise = law.sigma(model + self.subtracted.radiance)
        return np.hypot(noise, self.subtracted.error)


@dataclass(frozen=True, eq=False)
class Fit:
    """Lights that were fitted, with chi-square (robust where it was asked for)."""

    lights: PointLights
    residual: NDArray[np.float64]  # (n, c), (B - model) / sigma
    cost: float
    problem: Problem

    @cached_property
    def law(self) -> Law:
        """The law of the noise that is left, if it is noise."""
        left = self.residual * self.problem.sigma
        each = len(self.problem.axes) + self.lights.channels
        return self.problem.law_of(self.model, left, len(self) * each)

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(n, c) standard errors by that law."""
        return self.problem.errors_by(self.law, self.model)

    @property
    def model(self) -> NDArray[np.float64]:
        """(n, c) radiance by the lights."""
        return self.problem.radiance - self.residual * self.problem.sigma

    def __len__(self) -> int:
        return len(self.lights)


def no_lights(problem: Problem, scale: float) -> Fit:
    """The fit of darkness; ``scale`` is Cauchy's, standard errors."""
    return fit_of(problem, PointLights(np.zeros((0, 3)), problem.radiance[:0]), scale)


def fit_of(problem: Problem, lights: PointLights, scale: float) -> Fit:
    """The fit of lights as they are; ``scale`` is Cauchy's, standard errors."""
    z = residuals(problem, lights)
    return Fit(lights, z, robust(z, scale), problem)


def residuals(problem: Problem, lights: PointLights) -> NDArray[np.float64]:
    """(B - model) / sigma: (n, c), standard errors."""
    model = radiance(problem.surfels, lights, problem.geometry)
    return problem.without_ambient((problem.radiance - model) / problem.sigma)


def whitened(problem: Problem, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """What is linear in B / sigma: S / sigma at (k, 3) positions, and any ambient term.

    Returns (n, k or k + 1, c).
    """
    n, c = problem.radiance.shape
    columns = np.zeros((n, 0, c))
    if len(positions):
        S = shading(problem.surfels, positions, problem.geometry)
        columns = np.broadcast_to(S, (n, len(positions), c)) / problem.sigma[:, None, :]
    if problem.ambient is None:
        return columns
    return np.concatenate([columns, (problem.ambient / problem.sigma)[:, None]], axis=1)


def amounts(problem: Problem, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Non-negative least squares for what is linear: (k or k + 1, c) of `whitened`'s columns.

    Intensities in W/sr at (k, 3) positions in the unit of length, then that of any ambient term.
    """
    A, b = whitened(problem, positions), problem.radiance / problem.sigma
    channels = [nonnegative(A[:, :, c], b[:, c]) for c in range(b.shape[1])]
    return np.stack(channels, axis=1)


def nonnegative(A: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """The (k,) x >= 0 of least |A x - b|, A being (n, k).

    Where two dozen columns are nearly alike, the active set may go round in circles; an interior
    method then comes near enough.
    """
    if not A.size:  # SciPy's would crash
        return np.zeros(A.shape[1])
    try:
        return nnls(A, b)[0]
    except RuntimeError:
        return lsq_linear(A, b, bounds=(0, np.inf), method="trf").x


def intensities(problem: Problem, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Non-negative least squares for the (k, c) intensities of lights at (k, 3) positions."""
    return amounts(problem, positions)[: len(positions)]
