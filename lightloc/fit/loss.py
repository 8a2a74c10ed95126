"""The robust loss: whatever is far off counts less and less."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def cauchy(
    z: NDArray[np.floating], scale: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cauchy's loss of residuals, and the weight in 0..1 that each has in a least-squares step.

    The loss is z^2 near zero and grows like a logarithm beyond ``scale``; where that is infinite it
    is the square.

    Parameters
    ----------
    z : array
        Residuals in standard errors, of any shape.
    scale : array_like
        Standard errors, of any shape that broadcasts with it.

    Returns
    -------
    loss, weight : array
        Of their common shape.

    Examples
    --------
    >>> loss, weight = cauchy(np.array([0.001, 5.0]), 5.0)
    >>> loss.round(4).tolist(), weight.round(4).tolist()
    ([0.0, 17.3287], [1.0, 0.5])
    """
    scale = np.asarray(scale, np.float64)
    with np.errstate(invalid="ignore"):
        far = np.square(z / scale)
        loss = np.where(np.isinf(scale), np.square(z), scale**2 * np.log1p(far))
    return loss, 1 / (1 + far)


def robust(z: NDArray[np.floating], scale: float) -> float:
    """Sum of Cauchy's loss of residuals of any shape, in standard errors as its scale.

    Examples
    --------
    >>> robust(np.array([1e-3]), 5.0) == robust(np.array([-1e-3]), 5.0) < 1.0001e-6
    True
    """
    return float(cauchy(z, scale)[0].sum())
