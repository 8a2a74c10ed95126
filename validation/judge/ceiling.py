"""The Cramér-Rao ceiling: how often the best unbiased estimator would be within tolerances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from lightloc import Bound, PointLights

DRAWS = 4000  # of the Gaussian: a probability of one half is then known to 0.008
SEED = 2018


def within(
    spread: NDArray[np.float64],
    radius: float,
    intensity: NDArray[np.float64],
    draws: int = DRAWS,
    seed: int = SEED,
) -> float:
    """The probability that a Gaussian error has every light within the tolerances.

    0 where the data leave something free. By Monte Carlo: with n draws the error is sqrt(p (1 - p)
    / n).

    Parameters
    ----------
    spread : (m, m) array
        Covariance in the order of `lightloc.Bound`, with one channel.
    radius
        What the position's error may be, metres.
    intensity : (k,) array
        What each intensity's may be, W/sr.
    draws
        Number of Gaussian errors.
    seed
        Their seed.

    Examples
    --------
    >>> one_percent = np.array([0.01])
    >>> within(1e-6 * np.eye(3), 0.01, one_percent), within(np.eye(3), 0.01, one_percent)
    (1.0, 0.0)
    """
    if not np.isfinite(spread).all():
        return 0.0
    k = len(intensity)
    size = np.sqrt(np.maximum(np.diag(spread), np.finfo(float).tiny))  # metres and W/sr mix badly
    value, vector = np.linalg.eigh(spread / np.outer(size, size))
    root = vector * np.sqrt(np.maximum(value, 0.0))
    error = np.random.default_rng(seed).normal(size=(draws, len(spread))) @ root.T * size
    far = np.linalg.norm(error[:, :-k].reshape(draws, k, -1), axis=2)
    near = (far <= radius) & (np.abs(error[:, -k:]) <= intensity)
    return float(near.all(axis=1).mean())


def countable(bound: Bound, lights: PointLights, gain: float) -> float:
    """The probability that every light, by itself, gains so much in chi-square.

    With errors at the bound the root of a light's gain is its intensity over that one's error, and
    a standard Gaussian about it.

    Examples
    --------
    >>> sure = Bound.of(np.diag([1.0, 1.0, 1.0, 0.01]), np.arange(3), 1, 1)
    >>> countable(sure, PointLights([[0, 0, 1]], [0.5]), gain=25.0)
    0.5
    """
    with np.errstate(divide="ignore"):
        z = lights.intensities / bound.intensity
    return float(norm.cdf(z - np.sqrt(gain)).prod())
