"""Geometry: shadows that are not where it puts them, since something was moved, added or left out.

What such a shadow leaves is all or nothing: a light is seen where it was believed hidden, or the
other way round. So whatever is far off is asked whether it is right with one light turned on or
off there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled, fixed
from lightloc.diagnosis.joint import left
from lightloc.fit import cauchy
from lightloc.given import with_facing
from lightloc.optics import slopes

NAME = "the shadows"

GAIN = 12.0
"""Loss that an observation must gain by it, for a light to be turned on or off there."""

NEAR = 0.25
"""Of its former residual, that it may then leave where that is more than the loss's scale."""

SHARE = 0.01
"""Least share of the observations: fewer may lie anywhere."""

CHARGED = 8
"""Unknowns that each of them is charged for: noise gains less than `GAIN` by them."""

NEIGHBOURS, TOGETHER = 6, 0.3
"""Of an observation that is turned, so many are looked at; of them, as a mean, so many must be
turned too: a shadow is no dust."""


def shadows(lit: Lit) -> list[Departure]:
    """Lights that are seen, or hidden, where the geometry says otherwise."""
    if not len(lit.lights):
        return []
    bare = unshadowed(lit)
    turned = flipped(lit, bare[0])
    count = int(turned.any(axis=1).sum())
    if count < SHARE * len(turned) or not is_patchy(lit, turned):
        return []
    hidden = float((turned & (lit.seen.T > 0)).any(axis=1).mean())
    lightened = float((turned & (lit.seen.T == 0)).any(axis=1).mean())

    def model(lit: Lit, u: Array) -> Modelled:
        if not len(lit.lights):
            return lit.plain
        S, slope = unshadowed(lit)
        same = turned.shape[1] == len(lit.lights)  # else lights were left out, or added
        other = turned if same else flipped(lit, S)
        seen = np.where(other, 1 - lit.seen.T, lit.seen.T)[:, :, None]
        return lit.summed(S * seen, slope * seen[..., None])

    def said(u: Array, e: Array) -> str:
        parts = [
            f"{100 * share:.2g} % of the observations are {what} by a light that the geometry "
            f"{otherwise}"
            for share, what, otherwise in (
                (hidden, "not reached", "lets through: something is missing in it, or was moved"),
                (lightened, "reached", "hides: something in it is not there, or was moved"),
            )
            if share > 0
        ]
        return "; ".join(parts)

    n, c = lit.evidence.problem.radiance.shape
    return [
        Departure(
            Kind.GEOMETRY,
            NAME,
            model,
            lambda lit, u: np.zeros((n, c, 0)),
            fixed(np.zeros((1, 0))),
            said,
            "a geometry with what throws these shadows where it stands",
            fixed(np.zeros((2, 0))),
            none=0,
            rank=CHARGED * count,
        )
    ]


def unshadowed(lit: Lit) -> tuple[Array, Array]:
    """S (n, k, c) and its slope (n, k, c, d) where nothing occludes."""
    problem, k = lit.evidence.problem, len(lit.lights)
    n, c, d = (*problem.radiance.shape, len(problem.axes))
    S, slope = slopes(problem.surfels, lit.lights.positions, problem.axes)
    return (
        np.broadcast_to(S.transpose(2, 1, 0), (n, k, c)).astype(float),
        np.broadcast_to(slope.transpose(3, 2, 0, 1), (n, k, c, d)).astype(float),
    )


def flipped(lit: Lit, S: Array) -> NDArray[np.bool_]:
    """(n, k) the one light of each observation that is to be turned on or off, if any is."""
    evidence = lit.evidence
    B, sigma = lit.plain.B, evidence.problem.sigma
    scale = evidence.criterion.likelihood.scale
    z = left(evidence, B)
    change = np.where(lit.seen.T > 0, -1.0, 1.0)[:, :, None] * S * lit.lights.intensities
    other = z[:, None] - change / sigma[:, None]  # (n, k, c)
    before, after = (cauchy(each, scale)[0].sum(axis=-1) for each in (z, other))
    best = np.argmin(after, axis=1)
    rows = np.arange(len(z))
    far, there = np.abs(z).max(axis=1), np.abs(other[rows, best]).max(axis=1)
    good = (far > scale) & (before - after[rows, best] > GAIN)
    good &= there < np.maximum(scale, NEAR * far)
    turned = np.zeros(after.shape, bool)
    turned[rows[good], best[good]] = True
    return turned


def is_patchy(lit: Lit, turned: NDArray[np.bool_]) -> bool:
    """Whether observations that are turned lie beside others that are, of the same light."""
    q = lit.evidence.q
    near = with_facing(q)
    some = turned.any(axis=1)
    _, index = cKDTree(near).query(near[some], min(NEIGHBOURS + 1, len(near)))
    own = turned[some].argmax(axis=1)
    return bool(turned[index[:, 1:], own[:, None]].mean() > TOGETHER)
