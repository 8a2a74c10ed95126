"""By which errors fits are compared: of one size, or by a law, and with outliers among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from lightloc.fit.law import MOST_OUTLIERS
from lightloc.fit.loss import cauchy
from lightloc.fit.problem import Fit

AT_LEAST = 4.0
"""Outliers that are always thought possible, so that none is taken for a light."""

SHARP = 0.05
"""Of a step: errors of the model that are always thought possible, beside those of rounding."""


@dataclass(frozen=True, eq=False)
class Errors:
    """What residuals are measured by.

    Parameters
    ----------
    level : float or (n, c) array
        Standard errors, as a multiple of those that the residuals are in.
    scale
        Beyond so many of them a residual counts less and less (Cauchy's loss), unless the next two
        say what outliers are like.
    share : (c,) array, optional
        Of the observations that are outliers.
    wide : (n, c) array, optional
        Variance of these, in standard errors.
    step : (n, c) array, optional
        By which values are rounded, in standard errors.
    """

    level: float | NDArray[np.float64]
    scale: float
    share: NDArray[np.float64] | None = None
    wide: NDArray[np.float64] | None = None
    step: NDArray[np.float64] | None = None

    @staticmethod
    def of_law(fit: Fit, scale: float) -> Errors:
        """The law of what a fit leaves."""
        sigma = fit.sigma
        least = min(AT_LEAST / len(sigma), MOST_OUTLIERS)
        share = np.maximum(fit.law.share, least)
        return Errors(
            sigma / fit.problem.sigma,
            scale,
            share,
            1 + np.square(fit.law.spread / sigma),
            fit.problem.step / sigma if fit.problem.step else None,
        )

    def loss(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) how unlikely each is: z^2 near zero, far less far off."""
        z = residual / self.level
        if self.share is None or self.wide is None:
            return cauchy(z, self.scale)[0]
        own = np.square(z) / 2 if self.step is None else rounded(z, self.step)
        noise = np.log1p(-self.share) - own
        far = np.log(self.share) - np.log(self.wide) / 2 - np.square(z) / self.wide / 2
        return np.asarray(-2 * np.logaddexp(noise, far))

    def cost(self, residual: NDArray[np.float64]) -> float:
        """The sum of that."""
        return float(self.loss(residual).sum())


def rounded(z: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minus the logarithm of the density at z, of unit variance, of what is rounded by steps.

    Anything within half a step is as good: no light is needed that explains it. Beside a Gaussian
    of unit variance at 0, as z^2 / 2 is.

    Examples
    --------
    >>> z = np.array([0.0, 1.0, 1.6, 4.0])
    >>> rounded(z, np.full(4, 0.1)).round(2).tolist()
    [0.0, 0.5, 1.28, 8.0]
    >>> rounded(z, np.full(4, np.sqrt(12))).round(2).tolist()
    [0.32, 0.32, 0.58, 89.55]
    """
    rest = np.sqrt(np.maximum(1 - np.square(step) / 12, np.square(SHARP * step)))
    near = log_ndtr((step / 2 - np.abs(z)) / rest)
    far = log_ndtr((-step / 2 - np.abs(z)) / rest)
    share = near + np.log(-np.expm1(far - near))
    return np.asarray(np.log(step / np.sqrt(2 * np.pi)) - share)
