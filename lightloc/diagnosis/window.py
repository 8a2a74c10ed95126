"""A window: a rectangle on a side of the room that sends diffuse light into it."""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Evidence, Lit, Modelled, fixed
from lightloc.diagnosis.elsewhere import PATCHES, diffuse, ticks

POINTS = 6
"""Along each axis of a window: points that it is made of."""

SMALLEST, DELTA = 0.01, 1e-3
"""Of a side: the least half of a window, and the step of differences."""

SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")


def window(evidence: Evidence, side: int, axis: int, middle: Array) -> Departure:
    """A window about the middle of a patch: its middle, its halves, its light in each channel."""
    q, d, c = evidence.q, len(middle), evidence.q.channels
    points = ticks(POINTS, d) * 2 - 1
    scale = float(np.abs(q.radiance).mean())
    half = np.full(d, 0.5 / PATCHES)
    where = SIDES[2 * axis + side]

    def light(shapes: Array) -> Array:
        """(s, n, c) of middles and halves (s, 2 d)."""
        grid = shapes[:, None, :d] + points * shapes[:, None, d:]
        each = diffuse(q, evidence.problem, side, axis, grid.reshape(-1, d))
        return np.asarray(each.reshape(len(q), len(shapes), len(points), -1).mean(axis=2)).swapaxes(
            0, 1
        )

    first = light(np.concatenate([middle, half])[None])[0]
    unit = scale / max(float(first.mean()), 1e-300)

    def own(u: Array) -> tuple[Array, Array]:
        """What it brings, and the derivatives by its unknowns."""
        shapes, each = u[None, : 2 * d], np.zeros((len(q), c, len(u)))
        if u[2 * d :].any():
            shapes = shapes + DELTA * np.eye(2 * d + 1, 2 * d, -1)
        bright, *ahead = unit * light(shapes)
        for i, one in enumerate(ahead):
            each[:, :, i] = (one - bright) / DELTA * u[2 * d :]
        each[:, np.arange(c), 2 * d + np.arange(c)] = bright
        return bright * u[2 * d :], each

    def model(lit: Lit, u: Array) -> Modelled:
        bright, each = own(u)
        return Modelled(lit.plain.B + bright, lit.plain.by_lights, each)

    def said(u: Array, e: Array) -> str:
        return (
            f"a window in the side {where} of the room brings about "
            f"{100 * u[2 * d :].mean():.2g} ± {100 * e[2 * d :].mean():.1g} % of the mean radiance"
        )

    start = np.concatenate([middle, half, np.zeros(c)])
    low = np.concatenate([np.zeros(d), np.full(d, SMALLEST), np.zeros(c)])
    high = np.concatenate([np.ones(d), np.full(d, 0.5), np.full(c, np.inf)])
    return Departure(
        Kind.OUTSIDE,
        f"a window in {where}",
        model,
        lambda lit, u: own(u)[1],
        fixed(start[None]),
        said,
        "wider bounds, or known light from a window",
        fixed(np.array([low, high])),
    )
