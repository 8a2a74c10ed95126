"""The optimality certificate: is there any place where one more light would explain something?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import Likelihood, Problem, residuals
from lightloc.given import PointLights
from lightloc.search.dictionary import Dictionary, Left, gains_at

PEAKS = 4
"""Local maxima over the coarse grid that are followed to their tops, over the sample."""


def certificate(
    problem: Problem,
    sampled: Problem,
    dictionary: Dictionary,
    lights: PointLights,
    likelihood: Likelihood,
) -> tuple[float, NDArray[np.float64]]:
    """The largest normalized correlation of the residual with a further light, anywhere.

    max over p of a / sqrt(b), where a is the residual's correlation with S(., p) / sigma and b what
    is left of that atom's energy beside the lights' own derivatives: the gain in chi-square is its
    square. By chance alone it reaches about sqrt(2 ln m) over m independent places.

    Parameters
    ----------
    problem
        With all observations.
    sampled
        Some of them, over which ``dictionary`` was made.
    dictionary
        The positions that are asked first.
    lights
        Those that are there.
    likelihood
        Of the residuals.

    Returns
    -------
    correlation : float
        Standard errors (over several channels, the root of the sum of squares).
    p : (3,) array
        Where it is reached, in the unit of length.
    """
    tops = dictionary.tops(sampled, beside(sampled, lights, likelihood), PEAKS)
    if not len(tops):
        return 0.0, dictionary.points[0]
    gains = gains_at(problem, tops, beside(problem, lights, likelihood))
    best = int(np.argmax(gains))
    return float(np.sqrt(gains[best])), tops[best]


def beside(problem: Problem, lights: PointLights, likelihood: Likelihood) -> Left:
    """What is left beside all that the fit has adapted to."""
    z = residuals(problem, lights)
    return Left.beside(problem, lights, z, likelihood.trust(z))
