"""How sure each B(q) is: standard errors for the search, and where they follow from B itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lightloc.given import Observations, Options
from lightloc.optics import reflected_ambient, surfels

LIT = 5.0
"""Standard errors by which the mean of B may differ from 0 where nothing is lit."""

DARK = 0.1
"""Of the median standard error: none is smaller, since no sensor is exact."""

Law = Callable[[NDArray[np.float64]], NDArray[np.float64]]

MEDIAN_TO_SIGMA = 1.4826
"""Standard deviation of a Gaussian over the median of its magnitude."""

SPREAD = 1.17
"""Standard error of a standard deviation that is estimated by the median, times sqrt(n) over it."""

LAWFUL = 0.02
"""Sigma is a function of B where it is predicted from other observations to within this."""

MANY = 0.9
"""Share of the observations for which that must hold."""

SHOT = 0.01
"""Sigma over sqrt(B mean B) from which an estimate starts where none is given; any would do."""


ARITHMETIC = 1e-4
"""Least level of presumed errors: the relative error of float32 shading, 1e-6, over `SHOT`."""

QUANTUM = 1 / np.sqrt(12)
"""Standard deviation of rounding to whole steps, in steps."""


def is_exact(q: Observations) -> bool:
    """Whether the observations claim to have no errors at all."""
    return q.sigma is not None and not q.step and not (q.sigma > 0).any()


def presumed(q: Observations) -> Observations:
    """The observations with some sigma, shot noise, that is right at best but for a factor."""
    B = np.maximum(q.radiance, 0)
    mean = B.mean(axis=0)
    mean = np.where(mean > 0, mean, 1.0)  # all dark: any unit serves
    return q.with_radiance(q.radiance, SHOT * np.sqrt(mean * (B + SHOT * mean)))


def is_noise(radiance: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(c,) whether the mean of (n, c) radiances differs from 0 by no more than noise about 0."""
    error = [level_of(b) / np.sqrt(len(b)) for b in radiance.T]
    return np.asarray(np.abs(radiance.mean(axis=0)) <= LIT * np.array(error))


def without_black(q: Observations) -> Observations:
    """The observations without the noise of channels in which no surface reflects anything.

    Nothing tells how large it is where sigma is unknown, and a light can't explain it anyway.
    """
    B = q.radiance
    noise = is_noise(B) & B.any(axis=0)
    if q.channels == 1 or not noise.any():
        return q
    black = noise & ~reflected_ambient(surfels(q), q.channels).any(axis=0)
    return q.with_radiance(np.where(black, 0.0, B), q.sigma) if black.any() else q


def working_sigma(q: Observations, o: Options) -> NDArray[np.float64]:
    """The observations' standard errors with the arithmetic's own on top: (n, c), above 0."""
    if is_exact(q) and o.noise != "given":
        q = presumed(q)
    sigma = np.hypot(q.known_sigma, QUANTUM * q.step)
    mean = np.abs(q.radiance).mean() or 1.0  # all dark: any unit serves
    model = o.relative * np.abs(q.radiance) + o.absolute * mean
    floor = np.maximum(DARK * np.median(sigma, axis=0), np.finfo(float).tiny)
    return np.maximum(np.hypot(sigma, model), floor)


def estimated_level(z: NDArray[np.float64], parameters: int = 0) -> float:
    """`level_of` (n, c) residuals where sigma is only presumed.

    At least the arithmetic's own error, and without those of which model and radiance are both 0:
    they are exact, whatever the noise is.
    """
    lit = z[z != 0]
    return max(ARITHMETIC, level_of(lit, parameters)) if lit.size else ARITHMETIC


def level_of(z: NDArray[np.float64], parameters: int = 0) -> float:
    """The standard deviation of residuals of any shape, from their median: outliers do not count.

    ``parameters`` is how many were fitted to them.
    """
    free = max(z.size - parameters, 1) / z.size
    return float(MEDIAN_TO_SIGMA * np.median(np.abs(z)) / np.sqrt(free))


def law_of(radiance: NDArray[np.float64], sigma: NDArray[np.float64]) -> Law | None:
    """Sigma as a function of B, where it is one: None where neighbours in B do not predict it.

    Residuals weighted by a noisy B are biased: a B that is low by chance counts for more. Where
    sigma follows from B, it is to be taken at the model's B instead. Both are (n, c), as is what
    the law takes and gives.

    Examples
    --------
    >>> B = np.random.default_rng(0).uniform(1, 9, (200, 1))
    >>> law = law_of(B, 0.1 * np.sqrt(B))
    >>> bool(np.allclose(law(np.array([[4.0]])), 0.2, rtol=1e-2))
    True
    >>> law_of(B, np.random.default_rng(1).uniform(1, 2, B.shape)) is None
    True
    """
    curves = []
    for B, e in zip(radiance.T, sigma.T, strict=True):
        order = np.argsort(B, kind="stable")
        x, y = np.log(np.maximum(B[order], np.finfo(float).tiny)), np.log(e[order])
        predicted = np.interp(x[1::2], x[::2], y[::2])
        if np.mean(np.abs(predicted - y[1::2]) < LAWFUL) < MANY:
            return None
        curves.append((x, y))

    def law(B: NDArray[np.float64]) -> NDArray[np.float64]:
        logs = np.log(np.maximum(B, np.finfo(float).tiny))
        return np.stack(
            [np.exp(np.interp(logs[:, c], x, y)) for c, (x, y) in enumerate(curves)], axis=1
        )

    return law
