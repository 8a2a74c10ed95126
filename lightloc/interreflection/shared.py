"""Errors that neighbours share: what they do to lights does not average out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Localization, judged
from lightloc.fit import Bound, Problem, covariance_of, jacobian
from lightloc.given import Options


def with_shared(
    found: Localization, problem: Problem, shared: NDArray[np.float64], o: Options
) -> Localization:
    """The answer with standard errors that hold errors of a known shape and unknown size too.

    Each of ``shared`` (s, n, c), W sr^-1 m^-2, is one standard error of a cause of its own, which
    moves B at all observations together. It moves the lights by M^-1 J' b, in standard errors of
    B, and the squares of that add up to their covariance. Where lights are wide, or something is
    left free, the answer stands as it is.
    """
    lights = found.lights
    if not len(lights) or found.width.any() or not np.isfinite(found.covariance).all():
        return found
    posed = replace(problem, radiance=found.direct, sigma=found.sigma)
    J = jacobian(posed, lights)
    J = J.reshape(-1, J.shape[2])
    b = (shared / found.sigma).transpose(2, 1, 0).reshape(len(J), -1)
    moved = covariance_of(J) @ (J.T @ b)
    errors = Bound.of(found.covariance + moved @ moved.T, problem.axes, *lights.intensities.shape)
    now = replace(
        found,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=errors.covariance,
    )
    return judged(now, posed, o)
