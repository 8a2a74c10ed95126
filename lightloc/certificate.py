"""The optimality certificate: is there any place where one more light would explain something?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary
from lightloc.certainty import jacobian
from lightloc.lights import PointLights
from lightloc.moves import zoomed
from lightloc.options import Options
from lightloc.solve import Problem, residuals, whitened

PEAKS = 12
"""Local maxima over the coarse grid that are followed to their tops, over all observations."""


def certificate(
    problem: Problem,
    sampled: Problem,
    dictionary: Dictionary,
    lights: PointLights,
    o: Options,
) -> tuple[float, NDArray[np.float64]]:
    """The largest normalized correlation of the residual with a further light, anywhere.

    max over p of a / sqrt(b), where a is the residual's correlation with S(., p) / sigma and b
    what is left of that atom's energy beside the lights' own derivatives: the gain in chi-square
    is its square. By chance alone it reaches about sqrt(2 ln m) over m independent places.

    Args:
        problem: with all observations.
        sampled: some of them, over which ``dictionary`` was made.

    Returns standard errors (over several channels, the root of the sum of squares), and p.
    """
    tangent = [_tangent(p, lights) for p in (sampled, problem)]
    z = residuals(sampled, lights)
    weight = 1 / (1 + np.square(z / o.outlier))
    gains = dictionary.gains(z, tangent[0], weight)
    z = residuals(problem, lights)
    weight = 1 / (1 + np.square(z / o.outlier))
    best, where = 0.0, dictionary.points[0]
    for peak in dictionary.peaks(gains, PEAKS):
        p, reach = dictionary.points[peak], dictionary.grid.step
        p, gain = zoomed(problem, p, reach, z, tangent[1], weight, o)
        if gain > best:
            best, where = gain, p
    return float(np.sqrt(best)), where


def _tangent(problem: Problem, lights: PointLights) -> NDArray:
    """What the fit has adapted to: (n, k d + ..., c)."""
    if not len(lights):
        return whitened(problem, lights.positions)
    J = jacobian(problem, lights).transpose(1, 2, 0)
    return np.concatenate([J, whitened(problem, lights.positions[:0])], axis=1)
