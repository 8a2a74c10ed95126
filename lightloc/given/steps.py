"""Whether values are whole multiples of one step, as those of a sensor or a rounded table are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEAST = 10
"""Different values of which it is asked. Those that are continuous are all within `NEAR` of whole
multiples once in a billion data sets."""

MOST = 1 << 16
"""Steps from the least to the brightest: beyond 16 bits they are those of the numbers' format."""

NEAR = 0.02
"""Of a step: how far off a whole multiple may be."""

APART = 8
"""Neighbouring values may be so many steps apart, or else are too few to tell."""

FLOAT32, FLOAT64 = 2.0**-23, 2.0**-50
"""What rounding may change a value by, as a share of the largest."""

FLOAT16 = 1 << 10
"""Steps from 0 to a number whose half float has steps as large: what more there are is its own."""


def step_of(radiance: NDArray[np.float64]) -> float:
    """The step of which all of (n, c) values are whole multiples; 0 where there is none.

    Of channels with steps of their own, the largest. Values after a gamma have no common step.

    Examples
    --------
    >>> B = np.random.default_rng(0).uniform(0, 1, (500, 1))
    >>> step_of(B), round(step_of(np.round(B * 255) / 255) * 255, 6)
    (0.0, 1.0)
    """
    lit = [B for B in radiance.T if B.any()]
    steps = [_step(np.unique(B)) for B in lit]
    return max(steps) if steps and all(steps) else 0.0


def _step(values: NDArray[np.float64]) -> float:
    """The same of sorted different values, which may all be off by a common amount."""
    single = (values == values.astype(np.float32)).all()
    rounding = (FLOAT32 if single else FLOAT64) * np.abs(values).max()
    above = values - values[0]
    gaps = np.diff(values)
    gaps = gaps[gaps > 4 * rounding]
    if len(gaps) + 1 < LEAST:
        return 0.0
    with np.errstate(over="ignore"):
        half = (values == values.astype(np.float16)).all()
    most = FLOAT16 if half else MOST
    for parts in range(1, APART + 1):
        step = _refined(above, gaps.min() / parts, 2 * rounding)
        whole = above / step
        if whole[-1] < most and (np.abs(whole - np.round(whole)) <= NEAR).all():
            return float(step)
    return 0.0


def _refined(above: NDArray[np.float64], step: float, error: float) -> float:
    """The step by least squares, over ever more of its multiples."""
    unsure = error  # of the step
    while True:
        some = above[(above > step / 2) & (above * unsure <= step * step / 4)]
        if not len(some):
            return step
        count = np.round(some / step)
        step = float((some * count).sum() / (count * count).sum())
        better = error / count.max()
        if better >= unsure / 2 or len(some) == len(above) - 1:
            return step
        unsure = better
