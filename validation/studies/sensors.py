"""What instruments and path tracers make of B: noise of many laws, none of which is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RELATIVE, ABSOLUTE = 1e-6, 1e-7  # of B and of its mean: what float32 leaves of exact data
SHOT = 0.02  # of sqrt(B mean B)
LEVELS = 255  # steps of 8 bits
TYPICAL = 0.01  # of B: the noise before a value is clipped or cut off
FLOOR = 0.4  # share of the points that a dark floor swallows

Array = NDArray[np.float64]
Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Reading:
    """What is read of B.

    Parameters
    ----------
    B : (n, 1) array
        The values.
    sigma : (n, 1) array
        Their true standard errors.
    tells : (n,) array of bool
        Which of them are measurements, and not a limit of the instrument.
    """

    B: Array
    sigma: Array
    tells: NDArray[np.bool_]


def _all(B: Array) -> NDArray[np.bool_]:
    return np.ones(len(B), bool)


def exact(B: Array, rng: Rng) -> Reading:
    """No noise but that of the arithmetic."""
    return Reading(B, np.hypot(RELATIVE * B, ABSOLUTE * B.mean()), _all(B))


def relative(c: float) -> Callable[[Array, Rng], Reading]:
    """A share of B, as a path tracer leaves."""

    def read(B: Array, rng: Rng) -> Reading:
        floor = c * B + ABSOLUTE * B.mean()
        return Reading(np.maximum(B + floor * rng.normal(size=B.shape), 0.0), floor, _all(B))

    return read


def shot(B: Array, rng: Rng) -> Reading:
    """In proportion to the root of B, as of counted photons."""
    sigma = SHOT * np.sqrt(B * B.mean()) + ABSOLUTE * B.mean()
    return Reading(np.maximum(B + sigma * rng.normal(size=B.shape), 0.0), sigma, _all(B))


def eight_bits(B: Array, rng: Rng) -> Reading:
    """Rounded to 255 steps, of which the brightest value has all."""
    step = B.max() / LEVELS
    rounded = step * np.round(B / step)
    return Reading(rounded, np.full(B.shape, step / np.sqrt(12)), _all(B))


def clipped(share: float) -> Callable[[Array, Rng], Reading]:
    """So many of the points read the same: the most that the instrument can."""

    def read(B: Array, rng: Rng) -> Reading:
        seen = relative(TYPICAL)(B, rng)
        top = np.quantile(seen.B, 1 - share)
        return Reading(np.minimum(seen.B, top), seen.sigma, seen.B[:, 0] < top)

    return read


def floored(B: Array, rng: Rng) -> Reading:
    """A photodiode's dark floor: what lies below reads 0."""
    seen = relative(TYPICAL)(B, rng)
    lit = np.quantile(seen.B, FLOOR) < seen.B
    return Reading(np.where(lit, seen.B, 0.0), seen.sigma, lit[:, 0])


SENSORS: Mapping[str, Callable[[Array, Rng], Reading]] = {
    "exact": exact,
    "c0.0005": relative(0.0005),
    "c0.01": relative(0.01),
    "c0.05": relative(0.05),
    "shot": shot,
    "bits": eight_bits,
    "clipped2": clipped(0.02),
    "clipped10": clipped(0.1),
    "zeros": floored,
}
