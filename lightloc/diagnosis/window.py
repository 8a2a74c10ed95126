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

    def light(shape: Array) -> Array:
        """(n, c) of middle and halves."""
        grid = shape[:d] + points * shape[d:]
        return np.asarray(diffuse(q, evidence.problem, side, axis, grid).mean(axis=1))

    first = light(np.concatenate([middle, half]))
    unit = scale / max(float(first.mean()), 1e-300)

    def own(u: Array) -> tuple[Array, Array]:
        """What it brings, and the derivatives by its unknowns."""
        bright = unit * light(u[: 2 * d])
        each = np.zeros((len(q), c, len(u)))
        for i in range(2 * d if u[2 * d :].any() else 0):
            ahead = u[: 2 * d] + DELTA * (np.arange(2 * d) == i)
            each[:, :, i] = (unit * light(ahead) - bright) / DELTA * u[2 * d :]
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
