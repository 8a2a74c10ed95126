"""The optimality certificate: is there any place where one more light would explain something?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary, Left
from lightloc.certainty import jacobian
from lightloc.lights import PointLights
from lightloc.moves import zoomed
from lightloc.options import Options
from lightloc.polish import FEW
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
    gains = dictionary.gains(_left(sampled, lights, o))
    left = _left(problem, lights, o)
    best, where = 0.0, dictionary.points[0]
    for peak in dictionary.peaks(gains, PEAKS):
        p, gain = zoomed(problem, dictionary.points[peak], dictionary.grid.step, left, o)
        if gain > best:
            best, where = gain, p
    return float(np.sqrt(best)), where


def _left(problem: Problem, lights: PointLights, o: Options) -> Left:
    """What is left beside all that the fit has adapted to: the lights' own derivatives."""
    z = residuals(problem, lights)
    tangent = whitened(problem, lights.positions[:0])  # an ambient term
    if len(lights):
        J = jacobian(problem, lights).transpose(1, 2, 0)
        tangent = np.concatenate([J, tangent], axis=1)
    trust = np.where(np.abs(z) > o.outlier, 0.0, 1 / (1 + np.square(z / o.outlier)))
    if (trust == 0).mean() > FEW: trust = 1 / (1 + np.square(z / o.outlier))
    return Left.beside(tangent, z, trust)
