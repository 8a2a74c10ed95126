"""Encoding: what is seen is no multiple of radiance but a power of it, as pictures for screens are.

A scale is not told from the lights' own: B = m (M / m)^g, m being the mean of what is seen.
"""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, fixed, pointwise, slope_of

STARTS = (1.0, 1 / 2.2, 2.2)
"""Exponents from which one is fitted: none, and those of pictures taken for radiance or back."""

LIMITS = (0.2, 5.0)

DARK = 1e-4
"""Of the mean: a power of less has no slope that could be used."""


def encodings(lit: Lit) -> list[Departure]:
    """A gamma."""
    B = lit.evidence.problem.radiance
    mean = float(np.abs(B).mean())
    if not mean or not (B > 0).any():
        return []

    def change(M: Array, u: Array) -> tuple[Array, Array, Array]:
        return power(M, u, mean)

    return [
        Departure(
            Kind.ENCODING,
            "the encoding",
            pointwise(change),
            slope_of(change),
            fixed(np.array(STARTS)[:, None]),
            lambda u, e: (
                f"values are radiance to the power of {u[0]:.3f} ± {e[0]:.1g}, so that intensities "
                "are told but for a common factor"
            ),
            'Options(free=("gamma",)), or decode the values first',
            fixed(np.array(LIMITS)[:, None]),
        )
    ]


def power(M: Array, u: Array, mean: float) -> tuple[Array, Array, Array]:
    """M (n, c) to the power of u, and the derivatives by both."""
    share, g = np.maximum(M / mean, DARK), u[0]
    raised = mean * share**g
    lit = DARK * mean < M
    B = np.where(lit, raised, M * (DARK ** (g - 1)))
    slope = np.where(lit, g * share ** (g - 1), DARK ** (g - 1))
    by_gamma = np.where(lit, raised, B) * np.log(share)
    return B, slope, by_gamma[:, :, None]
