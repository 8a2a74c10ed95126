"""Highlights: lobes that are rougher or smoother than was given, or not known of at all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Kind
from lightloc.diagnosis.coat import INDEX, inside
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled, fixed
from lightloc.diagnosis.lobe import Lobe, passed, passed_slope, shine, shine_slope

ROUGHER = (0.2, 5.0)
"""Factors on a roughness."""

ALPHAS, GLOSSY = (0.08, 0.2, 0.45), (0.02, 0.9)
"""Roughnesses from which an unknown lobe is fitted, and their limits."""

BRIGHT, LOST = 20.0, 1.5
"""Most strength of a lobe, and of what it takes from the base, in those of plastic."""

FACTORS = (0.05, 20.0)
"""Of the albedo below it."""

DELTA = 1e-3
"""Relative step of a difference by a roughness."""


def roughness(lobes: list[Lobe]) -> Departure:
    """All lobes rougher, or smoother, by one factor, and coats with them."""

    def value(lit: Lit, factor: float) -> Array:
        S = lit.brought[0]
        total = S
        for lobe in lobes:
            here, there = shine(lit, lobe), shine(lit, lobe.rougher(factor))
            total = total + there - here + (S - here) * (ratio(lit, lobe, factor) - 1)[:, :, None]
        return total

    def model(lit: Lit, u: Array) -> Modelled:
        S, slope = lit.brought
        along = slope
        for lobe in lobes:
            rougher, share = lobe.rougher(u[0]), ratio(lit, lobe, u[0])
            here, there = shine_slope(lit, lobe), shine_slope(lit, rougher)
            turn = within(lobe, u[0])[..., None] * passed_slope(lit, rougher.alpha)
            turn = turn - share[..., None] * passed_slope(lit, lobe.alpha)
            turn = np.where(lobe.coats[:, None, None], turn / passed(lit, lobe.alpha)[..., None], 0)
            base = S - shine(lit, lobe)
            along = along + there - here + (slope - here) * (share - 1)[:, :, None, None]
            along = along + base[:, :, :, None] * turn[:, :, None]
        return lit.summed(value(lit, u[0]), along, columns(lit, u))

    def columns(lit: Lit, u: Array) -> Array:
        by = (value(lit, u[0] * (1 + DELTA)) - value(lit, u[0])) / (DELTA * u[0])
        return np.einsum("nkc,kc->nc", by, lit.lights.intensities)[:, :, None]

    return Departure(
        Kind.MATERIAL,
        "the roughness",
        model,
        columns,
        fixed(np.array([[1.0], [0.6], [1.6]])),
        lambda u, e: f"highlights are {u[0]:.3f} ± {e[0]:.1g} times as rough as was given",
        "another roughness",
        fixed(np.array(ROUGHER)[:, None]),
    )


def ratio(lit: Lit, lobe: Lobe, factor: float) -> Array:
    """(n, k) what a coat so many times as rough lets through, in what it does as it is."""
    if not lobe.coats.any():
        return np.ones((len(lobe.alpha), len(lit.lights)))
    there, here = passed(lit, lobe.alpha * factor), passed(lit, lobe.alpha)
    return np.where(lobe.coats[:, None], within(lobe, factor) * there / here, 1.0)


def within(lobe: Lobe, factor: float) -> Array:
    """(n, 1) the same of what is reflected back and forth below the coat."""
    return ((1 - inside(lobe.alpha)) / (1 - inside(lobe.alpha * factor)))[:, None]


def gloss(words: str, on: NDArray[np.bool_]) -> Departure:
    """A coat that was not known of, as that of plastic.

    Unknown are the strength of its highlight, its roughness, how far it takes light from the base
    and, where it does not cover all, the albedo of what it covers.
    """
    n, whole = len(on), bool(on.all())
    mask = on[:, None].astype(float)  # n, 1
    some = slice(3 if whole else 4)

    def lobe(alpha: float) -> Lobe:
        return Lobe(np.full(n, alpha), np.ones((n, 1)), np.full(n, INDEX))

    def left(alpha: float) -> Array:
        """(n, 1, 1) what a coat leaves of a base, but for `passed`."""
        return (mask / (1 - inside(np.full(n, alpha))[:, None]))[:, None]

    def value(lit: Lit, u: Array) -> tuple[Array, Array, Array]:
        """S with the coat, its highlight for each unit of strength, and what it takes."""
        S, bright = lit.brought[0], shine(lit, lobe(u[1])) * mask[:, None]
        loss = S * (passed(lit, lobe(u[1]).alpha)[:, :, None] * left(u[1]) - mask[:, None])
        factor = np.where(on, 1.0 if whole else u[3], 1.0)[:, None, None]
        return factor * (S + u[2] * loss) + u[0] * bright, bright, factor * loss

    def columns(lit: Lit, u: Array) -> Array:
        S, bright, loss = value(lit, u)
        more = u * np.where(np.arange(len(u)) == 1, 1 + DELTA, 1.0)
        none = not (u[0] or u[2])
        by_alpha = np.zeros_like(S) if none else (value(lit, more)[0] - S) / (DELTA * u[1])
        under = (S - u[0] * bright) / (1.0 if whole else u[3]) * on[:, None, None]
        each = np.stack([bright, by_alpha, loss, under][some], axis=-1)
        return np.einsum("nkcu,kc->ncu", each, lit.lights.intensities)

    def model(lit: Lit, u: Array) -> Modelled:
        S, slope = lit.brought
        along = shine_slope(lit, lobe(u[1])) * mask[:, None, :, None]
        share = passed(lit, lobe(u[1]).alpha)[:, :, None] * left(u[1]) - mask[:, None]
        turn = passed_slope(lit, lobe(u[1]).alpha)[:, :, None] * left(u[1])[..., None]
        factor = np.where(on, 1.0 if whole else u[3], 1.0)[:, None, None, None]
        below = slope * (1 + u[2] * share[..., None]) + u[2] * S[..., None] * turn
        return lit.summed(value(lit, u)[0], factor * below + u[0] * along, columns(lit, u))

    def said(u: Array, e: Array) -> str:
        return (
            f"highlights{words} are missing, of roughness {u[1]:.2g} ± {e[1]:.1g} and "
            f"{u[0]:.2g} ± {e[0]:.1g} times as bright as plastic's"
        )

    starts = [[0.0, alpha, 0.0, 1.0][some] for alpha in ALPHAS]
    starts.append([1.0, ALPHAS[1], 1.0, 1.0][some])
    low, high = [0.0, GLOSSY[0], 0.0, FACTORS[0]], [BRIGHT, GLOSSY[1], LOST, FACTORS[1]]
    return Departure(
        Kind.MATERIAL,
        f"a highlight{words}",
        model,
        columns,
        fixed(np.array(starts)),
        said,
        "a Plastic, or a Sum with a lobe",
        fixed(np.array([low[some], high[some]])),
        none=len(ALPHAS),
    )
