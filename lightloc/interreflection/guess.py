"""First guesses at direct light, where footnote 1 can't be or need not be exact."""

from __future__ import annotations

import numpy as np

from lightloc.given import Observations

DARKEST = 0.05
"""Share of the readings that are taken for lit by surfaces alone."""

UNEVEN = 0.5
"""How much that light may differ from place to place, as a share."""


def less_background(q: Observations) -> Observations:
    """A first guess at the direct part of irradiance: without what even the darkest points have.

    Other readings tell nothing of it, since no surface's radiance is known.
    """
    level = np.quantile(q.radiance, DARKEST, axis=0)
    sigma = np.hypot(q.known_sigma, UNEVEN * level)
    return q.with_radiance(q.radiance - level, sigma, interreflected=False)
