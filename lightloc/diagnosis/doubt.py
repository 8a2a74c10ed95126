"""Errors where the model does not explain: what is left is alike at neighbours, and adds up.

The observations are taken in patches. How far the pull of one patch on the lights differs from that
of another says how far the lights may be off (the sandwich estimate of statistics, by clusters).
"""

from __future__ import annotations

import numpy as np
from scipy.cluster.vq import kmeans2, vq

from lightloc.diagnosis.covered import joined
from lightloc.diagnosis.departure import Array, Evidence
from lightloc.diagnosis.joint import Joint, covariance, lost, modelled, whitened
from lightloc.given import with_facing

MANY = 0.03
"""Share of outliers from which errors are those that patches show even where the rest is explained:
outliers may be at one place, and others beside them that are less far off."""

PATCHES = 24
"""So many patches of observations, at most a tenth of their number."""

SAMPLE = 4096
"""Observations, at most, that the patches are made of; all then fall into one."""


def doubtful(evidence: Evidence, joint: Joint, noise: float) -> Array:
    """The covariance of lights and a departure's unknowns, no less than noise alone would have."""
    own = covariance(evidence, joint)
    if not np.isfinite(own).all():
        return noise**2 * own
    one = modelled(evidence, joint.lights, joint.departure, joint.unknowns)
    _, weight = lost(evidence, joint.residual)
    pulls = np.einsum("ncu,nc->nu", whitened(evidence, one), weight * joint.residual)
    q = evidence.q
    near = with_facing(q)
    count = max(2, min(PATCHES, len(q) // 10))
    some = near[:: len(q) // SAMPLE + 1]
    middles, _ = kmeans2(some, count, seed=0, minit="++")
    patch, _ = vq(near, middles)
    sums = np.zeros((count, pulls.shape[1]))
    np.add.at(sums, patch, pulls)
    step = sums @ own
    return joined(noise**2 * own, count / (count - 1) * step.T @ step)
