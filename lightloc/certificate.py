"""The optimality certificate: is there any place where one more light would explain something?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary, Left, atoms_at, gains_of
from lightloc.certainty import jacobian
from lightloc.criterion import Likelihood
from lightloc.lights import PointLights
from lightloc.noise import level_of
from lightloc.solve import Fit, Problem, residuals, whitened

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

    max over p of a / sqrt(b), where a is the residual's correlation with S(., p) / sigma and b
    what is left of that atom's energy beside the lights' own derivatives: the gain in chi-square
    is its square. By chance alone it reaches about sqrt(2 ln m) over m independent places.

    Args:
        problem: with all observations.
        sampled: some of them, over which ``dictionary`` was made.

    Returns standard errors (over several channels, the root of the sum of squares), and p.
    """
    seen = left_of(sampled, lights, likelihood)
    tops = dictionary.tops(sampled, seen, PEAKS)
    if not len(tops):
        return 0.0, dictionary.points[0]
    atoms = atoms_at(problem, tops)
    gains = gains_of(atoms, np.square(atoms), left_of(problem, lights, likelihood))
    best = int(np.argmax(gains))
    return float(np.sqrt(gains[best])), tops[best]


def certificate_of(
    fit: Fit, whole: Problem, tight: Problem, dictionary: Dictionary, over: Problem, o: Likelihood
) -> tuple[float, NDArray[np.float64]]:
    """`certificate` of a fit to ``whole``, in units of what it leaves if that is more.

    Args:
        tight: some observations of ``whole``.
        dictionary: over ``over``, the same with other errors.
    """
    level = max(1.0, level_of(fit.residual)) if len(fit) else 1.0
    own, sampled = (replace(p, sigma=p.sigma * level) for p in (whole, tight))
    return certificate(own, sampled, dictionary.under(over, sampled), fit.lights, o)


def left_of(problem: Problem, lights: PointLights, likelihood: Likelihood) -> Left:
    """What is left beside all that the fit has adapted to: the lights' own derivatives."""
    z = residuals(problem, lights)
    tangent = whitened(problem, lights.positions[:0])  # an ambient term
    if len(lights):
        J = jacobian(problem, lights).transpose(1, 2, 0)
        tangent = np.concatenate([J, tangent], axis=1)
    return Left.beside(tangent, z, likelihood.trust(z), problem.surfels.double)
