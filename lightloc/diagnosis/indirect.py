"""Indirect light that is left, or was taken away twice: dim, smooth, and in proportion to albedo.

What comes from all around is a smooth function of where a surface is and of how it faces: so much
of the light of an even surrounding, and of its slopes along the axes and along the normal.
"""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Evidence, Lit, added, fixed, pointwise

MOST = 10.0
"""Of the mean B: the most light of a surrounding."""


def indirect(lit: Lit) -> list[Departure]:
    """An even ambient term, and a smooth one."""
    evidence = lit.evidence
    if evidence.problem.ambient is not None:
        return []
    even = evidence.ambient
    if not even.any():
        return []
    return [
        departure("an even ambient light", even[:, :, None], evidence),
        departure("a smooth ambient light", even[:, :, None] * shape(evidence)[:, None], evidence),
    ]


def departure(name: str, columns: Array, evidence: Evidence) -> Departure:
    """So much of each of (n, c, u) columns; each is scaled to the mean B."""
    mean = float(np.abs(evidence.problem.radiance).mean()) or 1.0
    size = np.sqrt(np.square(columns).mean(axis=(0, 1)))
    columns = columns * np.where(size > 0, mean / np.where(size > 0, size, 1), 0)
    u = columns.shape[2]

    def said(values: Array, errors: Array) -> str:
        return f"{name} brings {100 * values[0]:.2g} ± {100 * errors[0]:.1g} % of the mean radiance"

    return Departure(
        Kind.INDIRECT,
        name,
        pointwise(added(columns)),
        lambda lit, u: columns,
        fixed(np.zeros((1, u))),
        said,
        'Options(free=("ambient",)), or indirect=, which renders interreflected light',
        fixed(np.tile([[-MOST], [MOST]], u)),
    )


def shape(evidence: Evidence) -> Array:
    """(n, u) one, the place, its squares, and the normal: each over the observations' box."""
    q, axes = evidence.q, evidence.problem.axes
    box = q.bounds
    half = np.maximum(np.ptp(box, axis=0) / 2, np.finfo(float).tiny)
    x = ((q.positions - box.mean(axis=0)) / half)[:, axes]
    return np.concatenate([np.ones((len(q), 1)), x, np.square(x), q.normals[:, axes]], axis=1)
