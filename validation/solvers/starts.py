"""Levenberg-Marquardt (scipy's) from random places, with ever more lights, while BIC falls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from lightloc import Geometry, Observations, remove_indirect, shading, shading_gradient
from validation.solvers.grid import errors, fitted

MOST, STARTS, SAMPLE = 6, 12, 600
SOFT = 3.0  # standard errors from which a residual counts less


def solve(
    q: Observations, geometry: Geometry | None, bounds: object = None, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (k, 3) and intensities (k, c); ``bounds`` are those of the observations if None."""
    box = [q.positions.min(axis=0), q.positions.max(axis=0)] if bounds is None else bounds
    q = remove_indirect(q, geometry) if q.interreflected and geometry else q
    low, high = np.asarray(box, float)
    rng = np.random.default_rng(seed)
    some = q.at(rng.permutation(len(q))[:SAMPLE])
    sigma, n = errors(some), some.radiance.size
    best, score = (np.zeros((0, 3)), np.zeros((0, q.channels))), np.inf
    for k in range(1, MOST + 1):
        tries = []
        for _ in range(STARTS):
            places = rng.uniform(low, high, (k, 3))
            places[: min(k - 1, len(best[0]))] = best[0][: k - 1]  # what explained so far, and one
            tries.append(descended(some, geometry, sigma, places, (low, high)))
        cost, lights = min(tries, key=lambda one: one[0])
        charged = cost + k * (3 + q.channels) * np.log(n)
        if charged >= score:
            break
        best, score = lights, charged
    return best


def descended(
    q: Observations,
    geometry: Geometry | None,
    sigma: NDArray[np.float64],
    places: NDArray[np.float64],
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[float, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Chi-square and lights at the end of a descent from places."""
    k, c = len(places), q.channels
    first = fitted(q, shading(q, places, geometry), sigma)
    unit = max(float(first.max()), 1e-12)
    low = np.concatenate([np.tile(box[0], k), np.zeros(k * c)])
    high = np.concatenate([np.tile(box[1], k), np.full(k * c, np.inf)])

    def parts(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return x[: 3 * k].reshape(k, 3), unit * x[3 * k :].reshape(k, c)

    def left(x: NDArray[np.float64]) -> NDArray[np.float64]:
        p, I = parts(x)
        return np.asarray(((shading(q, p, geometry) * I).sum(axis=1) - q.radiance) / sigma).ravel()

    def slope(x: NDArray[np.float64]) -> NDArray[np.float64]:
        p, I = parts(x)
        S, gradient = shading_gradient(q, p, geometry)
        by_place = np.einsum("nkcd,kc->nckd", gradient, I).reshape(len(q), c, 3 * k)
        by_light = np.einsum("nkc,ce->nekc", np.broadcast_to(S, (len(q), k, c)), np.eye(c))
        J = np.concatenate([by_place, unit * by_light.reshape(len(q), c, k * c)], axis=2)
        return np.asarray(J / sigma[:, :, None]).reshape(-1, J.shape[2])

    start = np.clip(np.concatenate([places.ravel(), (first / unit).ravel()]), low, high)
    end = least_squares(left, start, slope, (low, high), loss="cauchy", f_scale=SOFT, max_nfev=60)
    return 2 * float(end.cost), parts(end.x)
