"""Whether the lights of a case moved between two runs by more than their errors allow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from validation.records import FoundLight, Result

LEAST = 1e-6
"""Of the diagonal, and of an intensity: differences below are those of arithmetic."""


@dataclass(frozen=True)
class Moved:
    """The largest difference of a value of a found light, in standard errors of that difference.

    Parameters
    ----------
    light
        The true light that it was matched with, from 1.
    what
        "position" or "intensity".
    z
        The difference over its standard error.
    values
        How many values were compared.
    nearer
        Whether the later run is nearer to the truth.
    """

    light: int
    what: str
    z: float
    values: int
    nearer: bool

    def p(self, all_values: int) -> float:
        """The probability of one so large by chance, among so many values."""
        return float(min(1.0, 2 * norm.sf(self.z) * all_values))


def moved(before: Result, after: Result) -> Moved | None:
    """The largest difference, of lights that both runs matched; None where nothing can be compared.

    A value counts where both runs state its error, whatever the correlation of the two.
    """
    every = list(differences(before, after))
    if not every:
        return None
    z, light, what, nearer = max(every)
    return Moved(light, what, z, len(every), nearer)


def differences(before: Result, after: Result) -> Iterator[tuple[float, int, str, bool]]:
    """(z, light, what, whether nearer to the truth) of each value of each light."""
    assert before.lights and after.lights and before.comparison and after.comparison
    old = {pair.true: before.lights.found[pair.found] for pair in before.comparison.pairs}
    new = {pair.true: after.lights.found[pair.found] for pair in after.comparison.pairs}
    for true in sorted(old.keys() & new.keys()):
        right = after.lights.true[true]
        bright = max((abs(value) for value in right.intensity if value is not None), default=0.0)
        least = {"position": LEAST * (after.diagonal or 0.0), "intensity": LEAST * bright}
        truth = [*right.position, *right.intensity]
        for one, two, t in zip(values(old[true]), values(new[true]), truth, strict=False):
            (what, x, ex), (_, y, ey) = one, two
            if x is None or y is None or ex is None or ey is None or t is None:
                continue
            error = float(np.sqrt(ex**2 + ey**2 + least[what] ** 2))
            if error:
                yield abs(x - y) / error, true + 1, what, abs(y - t) < abs(x - t)


def values(light: FoundLight) -> list[tuple[str, float | None, float | None]]:
    """(what, value, error) of its position and its intensity."""
    unknown = [None] * len(light.intensity)
    errors = [*light.position_error, *(light.intensity_error or unknown)]
    names = ["position"] * 3 + ["intensity"] * len(light.intensity)
    return list(zip(names, [*light.position, *light.intensity], errors, strict=True))
