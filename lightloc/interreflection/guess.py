"""First guesses at direct light, where footnote 1 can't be or need not be exact."""

from __future__ import annotations

import numpy as np

from lightloc.given import Geometry, Observations
from lightloc.interreflection.footnote_1 import indirect

DARKEST = 0.05
"""Share of the readings that are taken for lit by surfaces alone."""

UNEVEN = 0.5
"""How much that light may differ from place to place, as a share."""

GUESSED = 0.02
"""Error of what is gathered where it is only a guess, as a share: a light stands out of more."""


def less_background(q: Observations) -> Observations:
    """A first guess at the direct part of irradiance: without what even the darkest points have.

    Other readings tell nothing of it, since no surface's radiance is known.
    """
    level = np.quantile(q.radiance, DARKEST, axis=0)
    sigma = np.hypot(q.known_sigma, UNEVEN * level)
    return q.with_radiance(q.radiance - level, sigma, interreflected=False)


def about_direct(q: Observations, geometry: Geometry, seed: int = 0) -> Observations:
    """A first guess by footnote 1, whose errors need not be known well.

    Raises ValueError where sigma is unknown.
    """
    more, error = indirect(q, geometry, seed)
    sigma = np.sqrt(np.square(q.known_sigma) + np.square(error) + np.square(GUESSED * more))
    return q.with_radiance(q.radiance - more, sigma, interreflected=False)


def guessed(q: Observations, geometry: Geometry | None, seed: int = 0) -> Observations:
    """About what is direct, where interreflected light is rendered later."""
    if q.quantity == "irradiance" or geometry is None:
        return less_background(q)
    return about_direct(q, geometry, seed)
