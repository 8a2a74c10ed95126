"""How sure: Fisher information, the Cramér-Rao bound, and what could be two lights instead of one.

Parameters are the free coordinates of each light, then the intensities; visibility is held
constant, so what the edges of shadows tell on top is not counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.fit.problem import Problem
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics import shading_gradient
from lightloc.reprs import short

FREE = 1e-12
"""A parameter with less than this share in a direction that the data leave free has none in it."""

NEARBY = 1e-3
"""Of the longest side: the step of the differences that second derivatives are made of."""

TOLD_APART = 5.0
"""Standard errors by which two lights must differ from one to be seen as two."""


@dataclass(frozen=True, eq=False)
class Bound:
    """The least standard errors that any unbiased estimate can have.

    Parameters
    ----------
    position : (k, 3) array
        Standard errors of the positions, in the unit of length; 0 along an axis that is not free.
    intensity : (k, c) array
        Standard errors of the intensities, W/sr.
    covariance : (m, m) array
        Covariance of the free coordinates of each light, in the unit of length, then of the
        intensities, W/sr.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Bound
    >>> Bound.of(np.diag([4.0, 9.0, 16.0, 25.0]), np.arange(3), 1, 1).position.tolist()
    [[2.0, 3.0, 4.0]]
    """

    position: NDArray[np.float64]
    intensity: NDArray[np.float64]
    covariance: NDArray[np.float64]

    __repr__ = short

    @staticmethod
    def of(covariance: NDArray[np.float64], axes: NDArray[np.intp], k: int, c: int) -> Bound:
        """Take the standard errors of k lights of c channels from their covariance.

        Parameters
        ----------
        covariance : (m, m) array
            Covariance of the free coordinates of each light, in the unit of length, then of the
            intensities, W/sr; m = k (d + c).
        axes : (d,) array of int
            Coordinates that are free: 0, 1, 2 for x, y, z.
        k, c : int
            Number of lights, and of channels.

        Returns
        -------
        Bound
            The roots of its diagonal, and the covariance itself.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Bound
        >>> flat = Bound.of(np.diag([4.0, 9.0, 25.0]), np.array([0, 1]), 1, 1)
        >>> flat.position.tolist(), flat.intensity.tolist()
        ([[2.0, 3.0, 0.0]], [[5.0]])
        """
        error = np.sqrt(np.maximum(np.diag(covariance), 0))
        first = k * len(axes)
        position = np.zeros((k, 3))
        position[:, axes] = error[:first].reshape(k, len(axes))
        return Bound(position, error[first:].reshape(k, c), covariance)


def cramer_rao(q: Observations, lights: PointLights, geometry: Geometry | None = None) -> Bound:
    """Cramér-Rao bound at given lights, from the observations' sigma.

    Visibility is held constant: what the edges of shadows tell on top is not counted.

    Parameters
    ----------
    q : Observations
        The observations, with errors; their radiance is not looked at.
    lights : PointLights
        The lights.
    geometry : Geometry, optional
        What occludes; nothing does where None.

    Returns
    -------
    Bound
        Standard errors in the unit of length and W/sr, and their covariance; infinite where the
        data leave something free. In a 2D scene, whose points and normals all lie in a plane of
        constant z, z is held.

    Raises
    ------
    ValueError
        If a sigma is 0.

    Examples
    --------
    The bound is in proportion to sigma:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, PointLights, cramer_rao
    >>> floor = np.random.default_rng(0).uniform(-2, 2, (500, 3)) * [1, 1, 0]
    >>> up, lights = np.tile([0.0, 0.0, 1.0], (500, 1)), PointLights([[0, 0, 1]], [9.0])
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(500),
    ...                  sigma=0.01, material=Lambert(albedo=0.5))
    >>> one, two = cramer_rao(q, lights), cramer_rao(q.with_radiance(0, sigma=0.02), lights)
    >>> bool(np.allclose(two.position, 2 * one.position)), one.position.max().round(4).item()
    (True, 0.0015)
    """
    if not (q.known_sigma > 0).all():
        raise ValueError("the Cramér-Rao bound needs a sigma above 0 at every observation")
    everywhere = q.bounds + np.array([[-1.0], [1.0]])
    if np.ptp(q.positions[:, 2]) == 0 and not q.normals[:, 2].any():  # a 2D scene
        everywhere[:, 2] = q.positions[0, 2]
    return errors_at(Problem.of(q, q.known_sigma, geometry, everywhere, double=True), lights)


def errors_at(
    problem: Problem, lights: PointLights, around: NDArray[np.float64] | None = None
) -> Bound:
    """`cramer_rao` of a problem; ``around`` (n, k, c) as in `jacobian`."""
    spread = covariance(problem, lights, around)
    return Bound.of(spread, problem.axes, *lights.intensities.shape)


def jacobian(
    problem: Problem, lights: PointLights, around: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Derivatives of the model over sigma: (c, n, k d + k c), the ambient term taken out.

    ``around`` (n, k, c) is what a light of intensity 1 brings by way of the surfaces, if that is
    to tell intensities too. What it tells of positions is left out: it is smooth.
    """
    S, gradient = shading_gradient(
        problem.surfels, lights.positions, problem.geometry, axes=problem.axes
    )
    (n, c), k, d = problem.radiance.shape, len(lights), len(problem.axes)
    S = (S if around is None else S + around) / problem.sigma[:, None]
    gradient = np.broadcast_to(gradient, (n, k, c, d)) / problem.sigma[:, None, :, None]
    J = np.zeros((c, n, k * (d + c)))
    J[:, :, : k * d] = np.einsum("nkcd,kc->cnkd", gradient, lights.intensities).reshape(c, n, k * d)
    for channel in range(c):
        J[channel][:, k * d + np.arange(k) * c + channel] = S[:, :, channel]
    if problem.nuisance is not None:
        u = problem.nuisance[:, :, None]
        J = J - u * (u * J).sum(axis=1, keepdims=True)
    return J


def covariance(
    problem: Problem, lights: PointLights, around: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Covariance of (free coordinates of each light, then intensities) from the Fisher information.

    From an SVD of the whitened Jacobian; directions that the data leave free get infinity.
    """
    if not len(lights):
        return np.zeros((0, 0))
    J = jacobian(problem, lights, around)
    return covariance_of(J.reshape(-1, J.shape[2]))


def covariance_of(J: NDArray[np.float64]) -> NDArray[np.float64]:
    """(u, u) covariance of the unknowns of a whitened Jacobian (rows, u), from its SVD."""
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    lacking = max(0, J.shape[1] - len(J))  # rows of zeros, where there are more parameters
    _, s, Vt = np.linalg.svd(np.pad(J / size, [(0, lacking), (0, 0)]), full_matrices=False)
    seen = s > s.max(initial=0) * max(J.shape) * np.finfo(float).eps
    inverse = np.where(seen, 1 / np.where(seen, s, 1) ** 2, np.inf)
    share = Vt[:, :, None] * Vt[:, None, :]
    share[(np.abs(share) < FREE) & ~seen[:, None, None]] = 0.0
    with np.errstate(invalid="ignore"):
        spread = np.where(share == 0, 0, share * inverse[:, None, None])
        return np.nansum(spread, axis=0) / np.outer(size, size)


def inseparable(lights: PointLights, error: NDArray[np.float64]) -> tuple[tuple[int, int], ...]:
    """Pairs of lights nearer to each other than twice their joint standard error.

    ``error`` is (k, 3), in the unit of length.
    """
    pairs = []
    for a in range(len(lights)):
        for b in range(a + 1, len(lights)):
            apart = np.linalg.norm(lights.positions[a] - lights.positions[b])
            if apart < 2 * np.hypot(np.linalg.norm(error[a]), np.linalg.norm(error[b])):
                pairs.append((a, b))
    return tuple(pairs)


def resolution(problem: Problem, lights: PointLights) -> NDArray[np.float64]:
    """How near two lights may be and still look like the one that was found: (k,) lengths.

    Two halves at p - h and p + h look like one light but for I (h.H.h) / 2, H being S's second
    derivatives in p; what the other parameters cannot take up of that must reach `TOLD_APART`
    standard errors. The worst direction counts; infinite where nothing tells.
    """
    k, d, axes = len(lights), len(problem.axes), problem.axes
    if not d:
        return np.full(k, np.nan)
    if not k:
        return np.zeros(0)
    h = NEARBY * problem.size
    moves = np.zeros((2 * d, 3))
    moves[np.arange(2 * d), np.tile(axes, 2)] = np.repeat([h, -h], d)
    around = (lights.positions[:, None] + moves).reshape(-1, 3)
    _, gradient = shading_gradient(problem.surfels, around, problem.geometry, axes=axes)
    n, c = problem.radiance.shape
    gradient = np.broadcast_to(gradient, (n, k * 2 * d, c, d)).reshape(n, k, 2, d, c, d)
    basis = _span(jacobian(problem, lights).reshape(c * n, -1))
    row, column = np.triu_indices(d)
    along = _directions(d)
    along = along[:, row] * along[:, column] * np.where(row == column, 1, 2)
    result = np.full(k, np.inf)
    for i in range(k):
        second = (gradient[:, i, 0] - gradient[:, i, 1]) / (2 * h)  # n, d, c, d
        second = (second[:, row, :, column] + second[:, column, :, row]) / 2  # pairs, n, c
        bent = second * (lights.intensities[i] / 2 / problem.sigma)
        seen = bent.swapaxes(1, 2).reshape(len(row), -1).T
        left = np.linalg.qr(seen - basis @ (basis.T @ seen), mode="r") @ along.T
        with np.errstate(divide="ignore"):
            result[i] = 2 * np.sqrt(TOLD_APART / np.linalg.norm(left, axis=0).min())
    return result


def _span(J: NDArray[np.float64]) -> NDArray[np.float64]:
    """An orthonormal basis of J's columns."""
    size = np.linalg.norm(J, axis=0)
    U, s, _ = np.linalg.svd(J[:, size > 0] / size[size > 0], full_matrices=False)
    return U[:, s > s.max(initial=0) * max(J.shape) * np.finfo(float).eps]


def _directions(d: int) -> NDArray[np.float64]:
    """Directions over half of the circle or the sphere: (u, d)."""
    if d == 1:
        return np.ones((1, 1))
    if d == 2:
        angle = np.arange(12) / 12 * np.pi
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = 1 - (np.arange(24) + 0.5) / 24
    angle, ring = np.arange(24) * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
