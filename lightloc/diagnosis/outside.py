"""Light from elsewhere: through a window, or from beyond the region that was searched.

A window is a diffuse patch on a side of the box of what is observed; what is far is a point of
that direction. Those that explain most are taken, one after the other.
"""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, added, fixed, pointwise
from lightloc.diagnosis.joint import ground_of
from lightloc.diagnosis.window import window

MOST = 4
"""Patches and directions that are taken together."""

ALONE = 1e-3
"""Share of a source that lights and sources before it can't take up, at least."""

WHERE = 2
"""Unknowns that a choice of place stands for."""


def outside(lit: Lit) -> list[Departure]:
    """One source beyond the region, up to four, and a window where the first is a patch."""
    evidence, elsewhere = lit.evidence, lit.evidence.elsewhere
    if not elsewhere.patches:
        return []
    taken = greedy(lit, elsewhere.columns)
    few = sorted({min(1, len(taken)), len(taken)} - {0})
    found = [departure(elsewhere.columns[:, taken[:n]], n) for n in few]
    first = next((elsewhere.patches[i] for i in taken if elsewhere.patches[i]), None)
    return [*found, window(evidence, *first)] if first else found


def departure(columns: Array, few: int) -> Departure:
    """So much, in each channel, of (n, few, c) columns of the mean of B."""
    n, _, c = columns.shape
    each = np.zeros((n, c, few * c))
    for channel in range(c):
        each[:, channel, channel::c] = columns[:, :, channel]
    name = "a source elsewhere" if few == 1 else "several sources elsewhere"

    def said(u: Array, e: Array) -> str:
        share, error = 100 * u.sum() / c, 100 * np.sqrt(np.square(e).sum()) / c
        return f"{name} brings {share:.2g} ± {error:.1g} % of the mean radiance"

    return Departure(
        Kind.OUTSIDE,
        name,
        pointwise(added(each)),
        lambda lit, u: each,
        fixed(np.zeros((1, few * c))),
        said,
        "wider bounds, or known light from a window",
        fixed(np.stack([np.zeros(few * c), np.full(few * c, np.inf)])),
        rank=few * (c + WHERE),
    )


def greedy(lit: Lit, columns: Array) -> list[int]:
    """Which of (n, s, c) columns explain most of what lights leave: at most `MOST`, the best first.

    Beside all that the lights can adapt.
    """
    ground = ground_of(lit)
    atoms = columns.swapaxes(1, 2)
    whole = atoms / lit.evidence.problem.sigma[:, :, None] * ground.root[:, :, None]
    energy, own, rest = np.square(whole).sum(axis=(0, 1)), ground.beside(atoms), ground.rest
    taken = list[int]()
    while len(taken) < MOST:
        free, a = np.square(own).sum(axis=0), own.T @ rest
        good = (a > 0) & (free > ALONE * energy)
        gain = np.where(good, a**2 / np.where(good, free, 1), 0)
        best = int(np.argmax(gain))
        if not gain[best]:
            break
        taken.append(best)
        along = own[:, best] / np.sqrt(free[best])
        rest = rest - along * (along @ rest)
        own = own - along[:, None] * (along @ own)
    return taken
