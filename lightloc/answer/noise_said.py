"""The noise that was estimated, in a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lightloc.answer.basis import Noise, NoiseLaw

TELLING = 0.05
"""Share of the variance from which on a term is told, at some B of those seen."""

SEEN = (0.05, 0.5, 0.95)
"""Quantiles of B that stand for them."""


def noise_said(noise: Noise, B: NDArray[np.float64], sigma: NDArray[np.float64]) -> str:
    """How large noise was found to be, of (n, c) B with errors; nothing where it was given.

    In the terms of its law where that is known, else as it is at most B.
    """
    if noise.law is NoiseLaw.GIVEN:
        return ""
    rows = np.isfinite(B).all(axis=1)
    lit = [(b[b > 0], e[b > 0]) for b, e in zip(B[rows].T, sigma[rows].T, strict=True)]
    if not all(len(b) for b, _ in lit):
        return ""
    unknown = np.full(len(lit), np.nan)
    law = [np.asarray(getattr(noise, name, unknown)) for name in ("read", "shot", "relative")]
    if np.isfinite(law).all():
        typical = np.array([np.quantile(b, SEEN) for b, _ in lit])  # c, 3
        parts = terms(law[0], law[1], law[2], typical)
    else:
        parts = [f"{listed([100 * float(np.median(e / b)) for b, e in lit])} % of B"]
    return f"Noise, estimated: {', and '.join(parts)}." if parts else ""


def terms(
    read: NDArray[np.float64],
    shot: NDArray[np.float64],
    relative: NDArray[np.float64],
    B: NDArray[np.float64],
) -> list[str]:
    """The terms of a law that tell at some of (c, m) B: its variance is read^2 + shot B +
    (relative B)^2, and its coefficients are (c,).

    Examples
    --------
    >>> B = np.array([[0.01, 0.1, 1.0]])
    >>> terms(np.array([0.002]), np.array([0.0]), np.array([0.009]), B)
    ['0.9 % of B', '0.002 at least']
    """
    read, shot, relative = (np.asarray(a, float)[:, None] for a in (read, shot, relative))
    parts = np.stack([np.square(relative * B), shot * B, np.square(read) + 0 * B])
    share = parts / np.maximum(parts.sum(axis=0), np.finfo(float).tiny)
    said = (
        f"{listed(100 * relative[:, 0])} % of B",
        f"{listed(np.sqrt(shot[:, 0]))} times the root of B",
        f"{listed(read[:, 0])} at least",
    )
    return [term for term, s in zip(said, share, strict=True) if s.max() > TELLING]


def listed(values: Sequence[float] | NDArray[np.float64]) -> str:
    """A number, or the three of the channels where they differ as printed."""
    words = [f"{value:.2g}" for value in values]
    return words[0] if len(set(words)) == 1 else " / ".join(words)
