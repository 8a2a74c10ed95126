"""Light from elsewhere: through a window, or from beyond the region that was searched.

A window is a diffuse patch on a side of the box of what is observed; what is far is a point of
that direction. Those that explain most are taken, one after the other.
"""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, added, fixed, pointwise
from lightloc.diagnosis.joint import left, lost, whitened

MOST = 4
"""Patches and directions that are taken together."""

WHERE = 2
"""Unknowns that a choice of place stands for."""


def outside(lit: Lit) -> list[Departure]:
    """One source beyond the region, and up to four."""
    evidence = lit.evidence
    columns = evidence.elsewhere
    if not columns.shape[1]:
        return []
    taken = greedy(lit, columns)
    return [departure(columns[:, taken[:few]], few) for few in sorted({1, len(taken)}) if few]


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
    evidence, plain = lit.evidence, lit.plain
    z = left(evidence, plain.B)
    _, weight = lost(evidence, z)
    root = np.sqrt(weight)
    atoms = (columns / evidence.problem.sigma[:, None] * root[:, None]).swapaxes(1, 2)
    atoms = atoms.reshape(z.size, -1)
    J = (whitened(evidence, plain) * root[:, :, None]).reshape(z.size, -1)
    size = np.linalg.norm(J, axis=0)
    basis = np.linalg.qr(J[:, size > 0] / size[size > 0])[0]
    energy = np.square(atoms).sum(axis=0)
    rest, taken = (z * root).ravel(), list[int]()
    while len(taken) < MOST:
        own = atoms - basis @ (basis.T @ atoms)
        free = np.square(own).sum(axis=0)
        a = own.T @ (rest - basis @ (basis.T @ rest))
        good = (a > 0) & (free > 1e-3 * energy)
        gain = np.where(good, a**2 / np.where(good, free, 1), 0)
        best = int(np.argmax(gain))
        if not gain[best]:
            break
        taken.append(best)
        basis = np.concatenate([basis, own[:, best : best + 1] / np.sqrt(free[best])], axis=1)
    return taken
