"""The law of the noise, where nobody knows it: estimated from what a fit leaves, outliers apart.

The variance of B is read^2 + shot M + (relative M)^2, where M is the model's B: never the noisy B
itself, since a B that is low by chance would count for more. A share of the observations may be
off by far more than that. Both follow from the residuals by expectation maximization: each step
takes every residual for noise with the probability that it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RELATIVE, ABSOLUTE = 1e-6, 1e-7
"""Of B and of its mean: errors of the arithmetic, which no law falls below."""

MOST_OUTLIERS = 0.2
"""Share of the observations that may be off by more than noise; beyond it lights are missing."""

FAR = 5.0
"""Standard errors that outliers are off by at least, in the root of the mean square."""

STEPS, SETTLED = 60, 1e-3
"""Steps of the expectation maximization, at most; the change of a logarithm that ends it."""

MEDIAN_TO_SIGMA = 1.4826
"""Standard deviation of a Gaussian over the median of its magnitude."""

LARGEST = 4096
"""Residuals that a law is estimated from, at most: it is then known to 1 %."""

RATHER = 0.5
"""Probability of being noise below which a residual is rather an outlier."""

TINY = np.finfo(float).tiny

ALL, ONE, TWO = np.ones((1, 3)), np.eye(3), 1 - np.eye(3)
"""Which of the three terms a law may have, by their number. One that is there by chance alone would
bend the law where little tells it: each must gain the logarithm of the number of residuals
(Schwarz's criterion)."""


@dataclass(frozen=True, eq=False)
class Law:
    """How large the noise of B is, channel by channel.

    Parameters
    ----------
    variance : (c, 3) array
        Coefficients of 1, M and M^2, where M is the model's radiance.
    error : (c, 3) array
        Their standard errors.
    floor : (c,) array
        Mean radiance, of which the arithmetic's own error is a share.
    share : (c,) array
        Of the observations that are outliers, 0 to `MOST_OUTLIERS`.
    spread : (c,) array
        Standard deviation of these, W sr^-1 m^-2.
    cost : float
        Minus twice the logarithm of the likelihood, per residual.
    """

    variance: NDArray[np.float64]
    error: NDArray[np.float64]
    floor: NDArray[np.float64]
    share: NDArray[np.float64]
    spread: NDArray[np.float64]
    cost: float

    def sigma(self, model: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) standard errors of B where the model is (n, c), W sr^-1 m^-2."""
        M = np.maximum(model, 0)
        v = self.variance.T
        own = np.square(arithmetic(M, self.floor))
        return np.sqrt(own + v[0] + v[1] * M + v[2] * np.square(M))

    def is_noise(
        self, left: NDArray[np.float64], model: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(n, c) the probability that each of (n, c) residuals of radiance is of the noise."""
        variance = np.square(self.sigma(model))
        wide = variance + np.square(self.spread)
        odds = np.log(variance / wide) / 2 + np.square(left) * (1 / variance - 1 / wide) / 2
        share = np.clip(self.share, TINY, None)
        return np.asarray(1 / (1 + share / (1 - share) * np.exp(np.minimum(odds, 700))))


def arithmetic(B: NDArray[np.float64], mean: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, c) standard errors of the arithmetic where B is (n, c), of (c,) means; or one channel."""
    return np.asarray(np.hypot(RELATIVE * B, ABSOLUTE * mean))


def law_left(
    left: NDArray[np.float64],
    model: NDArray[np.float64],
    parameters: int = 0,
    known: NDArray[np.float64] | None = None,
) -> Law:
    """The likeliest law of (n, c) residuals B - M of a model M, fitted with ``parameters``.

    Where both are 0 the observation is exact, whatever the noise is, and tells nothing of it.
    ``known`` (n, c) are standard errors of something else that is in the residuals.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> M = rng.uniform(0.1, 1, (2000, 1))
    >>> left = 0.05 * M * rng.normal(size=M.shape)
    >>> left[:100] += rng.uniform(0.5, 1, (100, 1))
    >>> law = law_left(left, M)
    >>> np.round(law.sigma(np.ones((1, 1))), 3).tolist(), np.round(law.share, 2).tolist()
    ([[0.05]], [0.06])
    """
    n, c = left.shape
    some = np.linspace(0, n - 1, min(n, LARGEST)).astype(int)
    stretch = np.sqrt(n / max(n - parameters / c, 1))
    known = np.zeros_like(left) if known is None else known
    each = [
        _of_channel(stretch * r, np.maximum(M, 0), np.square(more))
        for r, M, more in zip(left[some].T, model[some].T, known[some].T, strict=True)
    ]
    variance, error, floor, share, spread, cost = (np.array(one) for one in zip(*each, strict=True))
    floor = np.where(floor > 0, floor, floor.max() or 1.0)  # a dark channel has errors too
    return Law(variance, error, floor, share, spread, float(cost.sum() / max(some.size * c, 1)))


def outside(z: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """The share of outliers among residuals in standard errors of any shape; which are noise.

    Returns
    -------
    share : float
        0 to `MOST_OUTLIERS`.
    core : array
        The probability that each residual is of the noise.

    Examples
    --------
    >>> z = np.random.default_rng(0).normal(size=1000)
    >>> z[:50] += 30
    >>> share, core = outside(z)
    >>> round(share, 3), int((core[:50] < 0.5).sum())
    (0.056, 50)
    """
    squares = np.square(z)
    share, wide = MOST_OUTLIERS / 4, FAR**2
    core = np.ones_like(squares)
    for _ in range(STEPS):
        noise = np.log1p(-share) - squares / 2
        far = np.log(max(share, TINY)) - np.log1p(wide) / 2 - squares / (1 + wide) / 2
        core = np.exp(noise - np.logaddexp(noise, far))
        before, share = share, min(MOST_OUTLIERS, float((1 - core).mean()))
        wide = max(FAR**2, float(((1 - core) * squares).sum() / max((1 - core).sum(), TINY)))
        if abs(share - before) < SETTLED * share + TINY:
            break
    return share, core


Channel = tuple[NDArray[np.float64], NDArray[np.float64], float, float, float, float]
Maximum = tuple[float, NDArray[np.float64], float, float, NDArray[np.float64]]


def _of_channel(
    left: NDArray[np.float64], M: NDArray[np.float64], known: NDArray[np.float64]
) -> Channel:
    """Variance, its error, floor, share, spread and cost of one channel."""
    mean = float(M.mean()) or float(np.abs(left).mean())
    told = (left != 0) | (M != 0)
    squares, M = np.square(left[told]), M[told]
    if not squares.size or not mean:
        return np.zeros(3), np.full(3, np.inf), mean, 0.0, 0.0, 0.0
    x = np.stack([np.full_like(M, mean**2), M * mean, np.square(M)])
    own = known[told] + np.square(arithmetic(M, mean))

    def likeliest(every: NDArray[np.float64], so_far: Sequence[Maximum] = ()) -> Maximum:
        laws = [*so_far, *(_maximized(squares, x, own, terms) for terms in every)]
        return min(laws, key=lambda one: one[0] + np.log(squares.size) * np.count_nonzero(one[1]))

    best = likeliest(np.concatenate([ONE, ALL]))
    if best[1].all():
        best = likeliest(TWO, [best])
    cost, v, share, spread, core = best
    variance = own + v @ x
    fisher = (x * (core / np.square(variance) / 2)) @ x.T
    size = np.sqrt(np.maximum(np.diag(fisher), TINY))
    error = np.sqrt(np.diag(np.linalg.pinv(fisher / np.outer(size, size), hermitian=True))) / size
    unit = np.array([mean**2, mean, 1.0])
    return v * unit, error * unit, mean, share, float(np.sqrt(spread)), cost


def _maximized(
    squares: NDArray[np.float64],
    x: NDArray[np.float64],
    own: NDArray[np.float64],
    start: NDArray[np.float64],
) -> Maximum:
    """Cost, v, share and variance of outliers, and which residuals are noise, from one start.

    Terms that begin at 0 stay there.
    """
    typical = start @ x
    lit = typical > 0  # a light's noise tells nothing where no light is
    size = np.median(squares[lit] / typical[lit]) if lit.any() else 0.0
    v = start * MEDIAN_TO_SIGMA**2 * size
    share, wide = MOST_OUTLIERS / 4, FAR**2 * float((own + v @ x).mean())
    cost, core = np.inf, np.ones_like(squares)
    for _ in range(STEPS):
        variance = own + v @ x
        wide = max(wide, FAR**2 * float(variance.mean()))
        total = variance + wide
        noise = np.log1p(-share) - (np.log(variance) + squares / variance) / 2
        far = np.log(max(share, TINY)) - (np.log(total) + squares / total) / 2
        either = np.logaddexp(noise, far)
        before, cost = cost, -2 * float(either.sum())
        core = np.exp(noise - either)
        if before - cost < SETTLED:
            break
        outside = 1 - core
        share = min(MOST_OUTLIERS, float(outside.mean()))
        wide = float(outside @ squares) / max(float(outside.sum()), TINY)
        gain = x @ (core * squares / np.square(variance))
        v = v * np.sqrt(gain / np.maximum(x @ (core / variance), TINY))
    return cost, v, share, wide, core
