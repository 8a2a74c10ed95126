"""One light more: what noise alone lets it gain, and where it would gain most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Observations, PointLights, shading
from validation.judge.oracle import jacobian

DRAWS = 400  # of noise: a chance of 5 % is then known to 1 %
SEEN = 1e-3  # of a column's length, left by what other lights take up of it

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Further:
    """Places that a further light may have, and what it adds there.

    Parameters
    ----------
    places : (g, 3) array
        Where it may be.
    columns : (n, g) array
        What it adds there in standard errors, but for what the lights' own unknowns take up: of
        length 1.
    length : (g,) array
        What a light of intensity 1 adds, in standard errors.
    basis : (n, u) array
        An orthonormal basis of what the lights' unknowns take up.
    """

    places: Array
    columns: Array
    length: Array
    basis: Array

    @staticmethod
    def of(
        q: Observations, lights: PointLights, geometry: Geometry | None, sigma: Array, places: Array
    ) -> Further:
        """Beside given lights, of one channel; ``sigma`` is (n, 1)."""
        J = jacobian(q, lights.positions, lights.intensities[:, 0], geometry, sigma)
        basis = np.linalg.qr(J / np.maximum(np.linalg.norm(J, axis=0), 1e-300))[0]
        S = shading(q, places, geometry)[:, :, 0] / sigma
        left = S - basis @ (basis.T @ S)
        length = np.linalg.norm(left, axis=0)
        told = length > SEEN * np.linalg.norm(S, axis=0)
        return Further(places[told], left[:, told] / length[told], length[told], basis)

    def gain(self, alpha: float, rng: np.random.Generator) -> float:
        """The gain in chi-square that a further light has under noise alone with that chance."""
        z = rng.normal(size=(len(self.columns), DRAWS))
        most = (self.columns.T @ (z - self.basis @ (self.basis.T @ z))).max(axis=0)
        return float(np.quantile(np.square(np.maximum(most, 0.0)), 1 - alpha))

    def best(self, residual: Array) -> PointLights:
        """The light that explains most of an (n,) residual, in standard errors."""
        along = self.columns.T @ residual
        i = int(along.argmax())
        return PointLights(self.places[[i]], [max(float(along[i] / self.length[i]), 0.0)])
