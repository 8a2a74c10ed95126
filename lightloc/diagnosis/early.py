"""Whether a search goes astray: where a departure explains with few lights what many do not.

Light after light adapts to an error of the model, the more so where nobody knows the noise and
what they leave passes for it. A first look at the fewest lights ends that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightloc.deadline import is_over
from lightloc.diagnosis.choice import price, promises
from lightloc.diagnosis.departure import Evidence
from lightloc.diagnosis.joint import left, lost
from lightloc.diagnosis.kinds import MAKERS
from lightloc.diagnosis.wide import wide
from lightloc.fit import Criterion, Fit, estimated_level
from lightloc.given import Observations

FEWEST = (1, 2, 3)
"""Lights that a departure is asked beside."""

ASKED = tuple(maker for maker in MAKERS if maker is not wide)
"""Departures that are asked: not that lights are wide, as two near each other seem to be."""

BY_FAR = 0.4
"""Share of what many lights leave that a departure beside few leaves at most, to first order. Where
lights are still missing it leaves 0.66 of it and more, where the model is wrong 0.08 to 0.33
(measured)."""

SAMPLE = 512
"""Observations that are asked."""


def astray(q: Observations, criterion: Criterion, fits: Sequence[Fit], best: Fit) -> bool:
    """Whether a departure, beside the fewest lights, promises to leave far less than the best fit.

    ``q`` are the observations that the fits are to.
    """
    some = np.sort(np.random.default_rng(0).permutation(len(q))[:SAMPLE])
    sigma = best.problem.sigma * estimated_level(best.residual)
    evidence = Evidence(q, replace(best.problem, sigma=sigma), criterion).rows_of(some)
    most = BY_FAR * lost(evidence, left(evidence, evidence.lit(best.lights).plain.B))[0]
    for fit in fits:
        if len(fit) in FEWEST and not is_over():
            for one in promises(evidence, fit.lights, ASKED):
                if one.cost + price(evidence, one.departure, len(one.unknowns)) < most:
                    return True
    return False
