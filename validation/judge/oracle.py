"""Fits that start at the truth: what a search that misses nothing would end at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from lightloc import Geometry, Observations, PointLights, shading, shading_gradient

STEPS = 60  # evaluations of a fit; from the truth a dozen do

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fitted:
    """Lights that a fit came to rest at, and what they leave.

    ``residual`` is (n,), in standard errors.
    """

    lights: PointLights
    residual: Array

    @property
    def chi2(self) -> float:
        return float(np.square(self.residual).sum())


def fitted(q: Observations, start: PointLights, geometry: Geometry | None, sigma: Array) -> Fitted:
    """Least squares from given lights: their number stays, ``sigma`` (n, 1) is right; one channel.

    Examples
    --------
    >>> from lightloc import Irradiance, radiance
    >>> x = np.random.default_rng(0).uniform(-1, 1, (50, 3)) * [1, 1, 0]
    >>> q = Observations(positions=x, normals=[[0, 0, 1]] * 50, radiance=[0.0] * 50,
    ...                  material=Irradiance())
    >>> q = q.with_radiance(radiance(q, PointLights([[0.2, 0.1, 0.5]], [3.0])), None)
    >>> near = PointLights([[0.25, 0.0, 0.6]], [2.0])
    >>> fitted(q, near, None, np.full((50, 1), 0.01)).lights.positions.round(4).tolist()
    [[0.2, 0.1, 0.5]]
    """
    axes = free_axes(q)
    k, d = len(start), len(axes)
    if not k:
        return Fitted(start, (q.radiance / sigma)[:, 0])

    def places(v: Array) -> Array:
        p = start.positions.copy()
        p[:, axes] = v[: k * d].reshape(k, d)
        return p

    def left(v: Array) -> Array:
        S = shading(q, places(v), geometry)[:, :, 0]
        return np.asarray((q.radiance[:, 0] - S @ v[k * d :]) / sigma[:, 0])

    def slope(v: Array) -> Array:
        return -jacobian(q, places(v), v[k * d :], geometry, sigma)

    v = np.append(start.positions[:, axes].ravel(), start.intensities[:, 0])
    end = least_squares(left, v, slope, method="lm", x_scale="jac", max_nfev=STEPS)
    return Fitted(PointLights(places(end.x), np.maximum(end.x[k * d :], 0.0)), end.fun)


def jacobian(
    q: Observations, p: Array, intensities: Array, geometry: Geometry | None, sigma: Array
) -> Array:
    """(n, k (d + 1)) B / sigma by the free coordinates of each light, then by the intensities."""
    S, gradient = shading_gradient(q, p, geometry, axes=free_axes(q))
    moved = gradient[:, :, 0, :] * intensities[None, :, None]
    return np.concatenate([moved.reshape(len(q), -1), S[:, :, 0]], axis=1) / sigma


def free_axes(q: Observations) -> NDArray[np.intp]:
    """The coordinates that lights may move along: two where points and normals lie in a plane of
    constant z."""
    flat = np.ptp(q.positions[:, 2]) == 0 and not q.normals[:, 2].any()
    return np.arange(2 if flat else 3)
