"""Positions and intensities from all of B, where the indirect part was rendered with noise.

B = sum I (S + H), where H is what a light of intensity 1 brings by way of the surfaces. A noisy H
as a regressor pulls intensities astray, as errors in variables do: the noise in H correlates with
itself. What it adds to the normal equations is known from its standard error, and is taken out
again (Fuller, Measurement Error Models, 1987, section 2.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, eigh, solve_triangular

from lightloc.fit import (
    AT_HAND,
    POLISH_FALL,
    Bound,
    Descents,
    Indirect,
    Problem,
    Unknown,
    cauchy,
    descend,
    jacobian,
    nonnegative,
    robust,
)
from lightloc.given import Observations, PointLights
from lightloc.optics import shading

REFITS = 4
"""The error of the rendering and the weights depend on the intensities: settled after three."""

NOISE_TAKEN = 0.8
"""Most of what any direction of the normal equations holds that may be taken out for noise."""

STEPS = 12
"""Evaluations of a refit; three or four are enough where the start is near."""

FLAT = 1e-12
"""Of the normal equations' diagonal: what nothing tells gets an error without bounds."""


@dataclass(frozen=True, eq=False)
class Split:
    """B(q) as the light of some lights: straight from them, and by way of the surfaces.

    Parameters
    ----------
    q
        The n observations.
    straight, around : (n, k, c) array
        S and H of each light at intensity 1, m^-2 sr^-1.
    error : (n, k, c) array
        Standard error of ``around``, independent from light to light.
    outlier
        Standard errors beyond which a residual counts less and less.
    """

    q: Observations
    straight: NDArray[np.float64]
    around: NDArray[np.float64]
    error: NDArray[np.float64]
    outlier: float

    def rows(self, order: NDArray[np.intp]) -> Split:
        """The lights in another order."""
        straight, around, error = self.straight, self.around, self.error
        return replace(
            self, straight=straight[:, order], around=around[:, order], error=error[:, order]
        )

    def sigma(self, intensities: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) standard error of B less the rendered part."""
        rendered = np.square(self.error * intensities).sum(axis=1)
        return above_zero(np.sqrt(np.square(self.q.known_sigma) + rendered))

    def residual(self, intensities: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) in standard errors."""
        model = ((self.straight + self.around) * intensities).sum(axis=1)
        return (self.q.radiance - model) / self.sigma(intensities)

    def cost(self, intensities: NDArray[np.float64]) -> float:
        """Robust chi-square."""
        return robust(self.residual(intensities), self.outlier)

    def weight(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) in 0..1, of Cauchy's loss, or of a wider one while most residuals are large."""
        return cauchy(z, self.scale(z))[1]

    def scale(self, z: NDArray[np.float64]) -> float:
        """Standard errors beyond which a residual counts less and less."""
        return max(self.outlier, float(np.median(np.abs(z))))

    def noise(self, sigma: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, c) what the error of ``around`` adds to the normal equations' diagonal."""
        return np.einsum("nkc,nc->kc", np.square(self.error), weight / np.square(sigma))

    def intensities(self) -> NDArray[np.float64]:
        """(k, c) by non-negative least squares from direct and indirect light together."""
        whole = self.straight + self.around
        _, k, channels = whole.shape
        I = np.zeros((k, channels))
        weight = np.ones_like(self.q.radiance)
        for _ in range(REFITS):
            sigma = self.sigma(I)
            for c in range(channels):
                A = whole[:, :, c] * (np.sqrt(weight[:, c]) / sigma[:, c])[:, None]
                b = self.q.radiance[:, c] * np.sqrt(weight[:, c]) / sigma[:, c]
                lit = A.any(axis=0)
                A = A[:, lit]
                M = A.T @ A
                M -= np.diag(taken(M, self.noise(sigma, weight)[lit, c]))
                root = cholesky(M, lower=True)
                I[:, c] = 0.0
                I[lit, c] = nonnegative(root.T, solve_triangular(root, A.T @ b, lower=True))
            weight = self.weight(self.residual(I))
        return I

    def direct(self, intensities: NDArray[np.float64]) -> Observations:
        """What is left for the search: B less the rendered part, with the error of both."""
        B = self.q.radiance - (self.around * intensities).sum(axis=1)
        return self.q.with_radiance(B, self.sigma(intensities), interreflected=False)


def taken(G: NDArray[np.float64], noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """What may be taken out of normal equations' (u, u) diagonal, of the ``noise`` (u,) in it.

    Where nothing would be left in some direction, as much as leaves a fifth.

    Examples
    --------
    >>> taken(np.diag([4.0, 5.0]), np.array([1.0, 2.0])).tolist()
    [1.0, 2.0]
    >>> taken(np.eye(2), np.array([0.0, 1.0])).round(9).tolist()
    [0.0, 0.8]
    """
    if not noise.any():
        return noise
    size = np.sqrt(np.diag(G))
    scaled = G / np.outer(size, size)
    worst = eigh(np.diag(noise / size**2), scaled, eigvals_only=True)[-1]
    return min(1.0, NOISE_TAKEN / worst) * noise


def together(
    split: Split, lights: PointLights, problem: Problem
) -> tuple[PointLights, Split, Bound]:
    """Refine positions and intensities on all of B, H being held.

    That H changes with the position is left out of the steps but not of their end: where H is
    rendered anew until nothing moves, the residual is that of all light.

    Parameters
    ----------
    split
        Of lights nearby, in the same order.
    lights
        Where to begin.
    problem
        Over the observations; its radiance and its sigma are not used.

    Returns
    -------
    lights : PointLights
        Refined.
    split : Split
        B as their light.
    errors : Bound
        Their standard errors.
    """
    if problem.places is not None:  # in the order of what was rendered for each
        problem = replace(problem, places=lights.positions)
    for _ in range(REFITS):
        split = replace(split, straight=straight(problem, lights))
        _, noise = normal(split, lights, problem)
        sigma = split.sigma(lights.intensities)
        there = descend(
            replace(problem, radiance=split.q.radiance, sigma=sigma),
            Descents.at(lights),
            steps=STEPS,
            loss=split.scale(split.residual(lights.intensities)),
            unknown=Unknown.POSITIVE,
            damping=AT_HAND,
            fall=POLISH_FALL[0],
            indirect=Indirect(split.around, noise),
        )
        lights = there.lights
    split = replace(split, straight=straight(problem, lights))
    return lights, split, spread(split, lights, problem)


def normal(
    split: Split, lights: PointLights, problem: Problem
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The normal equations over all coordinates, then all intensities; of it, what is noise.

    Returns (u, u), and (k, c) of the intensities' diagonal.
    """
    I = lights.intensities
    sigma, weight = split.sigma(I), split.weight(split.residual(I))
    J = jacobian(replace(problem, sigma=sigma), lights, split.around)
    G = np.einsum("cnu,cnv->uv", J * weight.T[:, :, None], J, optimize=True)
    G += FLAT * G.max() * np.eye(len(G))
    noise = np.zeros(len(G))
    noise[-I.size :] = split.noise(sigma, weight).ravel()
    return G, taken(G, noise)[-I.size :].reshape(I.shape)


def spread(split: Split, lights: PointLights, problem: Problem) -> Bound:
    """The lights' standard errors, infinite for intensities that bring no light at all.

    With normal equations M that are free of the noise in H and G that hold it, the covariance is
    M^-1 G M^-1.
    """
    G, noise = normal(split, lights, problem)
    M = G.copy()
    own = np.arange(len(G) - noise.size, len(G))
    M[own, own] -= noise.ravel()
    inverse = np.linalg.inv(M)
    errors = Bound.of(inverse @ G @ inverse, problem.axes, *lights.intensities.shape)
    black = ~(split.straight + split.around).any(axis=0)
    return replace(errors, intensity=np.where(black, np.inf, errors.intensity))


def straight(problem: Problem, lights: PointLights) -> NDArray[np.float64]:
    """S at the lights: (n, k, c), m^-2 sr^-1."""
    return shading(problem.surfels, lights.positions, problem.geometry)


def above_zero(value: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.maximum(value, np.finfo(float).tiny)
