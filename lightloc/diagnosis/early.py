"""Whether a search goes astray: where a departure explains with few lights what many do not.

Where nobody knows the noise, what an error of the model leaves passes for noise, and a search goes
on by its law, light after light. A first look at the fewest lights ends that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightloc.diagnosis.choice import price, promises
from lightloc.diagnosis.departure import Evidence
from lightloc.diagnosis.joint import left, lost
from lightloc.diagnosis.kinds import MAKERS
from lightloc.fit import Criterion, Fit, Problem, estimated_level
from lightloc.given import Observations

MANY, FEWEST = 4, (1, 2, 3)
"""Lights from which on it is asked, and those that a departure is asked beside."""

SAMPLE = 512
"""Observations that are asked."""


def astray(
    q: Observations, problem: Problem, criterion: Criterion, fits: Sequence[Fit], best: Fit
) -> bool:
    """Whether a departure, beside the fewest lights, promises to leave less than the best fit.

    ``q`` are the observations that ``problem`` poses.
    """
    if len(best) < MANY:
        return False
    some = np.sort(np.random.default_rng(0).permutation(len(q))[:SAMPLE])
    sigma = problem.sigma * estimated_level(best.residual)
    evidence = Evidence(q, replace(problem, sigma=sigma), criterion).rows_of(some)
    most = lost(evidence, left(evidence, evidence.lit(best.lights).plain.B))[0]
    for fit in fits:
        if len(fit) in FEWEST:
            for one in promises(evidence, fit.lights, MAKERS):
                if one.cost + price(evidence, one.departure, len(one.unknowns)) < most:
                    return True
    return False
