"""What a table's cell is made of: figures over the scenes of a row, and goals for them."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import beta

from validation.jobs import Ended

NOTHING = "–"
MANY = 100  # scenes of which a rate is told to three digits
Fields = dict[str, Any]  # of a trial, None where a number was not finite
Keep = Callable[[Fields], bool]


@dataclass(frozen=True)
class Figure:
    """A number over scenes, its standard error where that is known, and both as text."""

    value: float | None
    text: str
    error: float | None = None


@dataclass(frozen=True)
class Goal:
    """What a figure must keep to, and how a reader is told.

    Without ``met`` it is only what stands beside the figure.
    """

    text: str
    met: Callable[[float], bool] | None = None


def at_least(limit: float) -> Goal:
    return Goal(f"≥ {limit:g}".replace("-", "−"), lambda value: value >= limit)


def reaches(published: float, digits: int = 2) -> Goal:
    """At least a figure that was published with so many digits behind the point."""
    return Goal(f"{published:.{digits}f}", lambda value: round(value, digits) >= published)


def below(limit: float) -> Goal:
    return Goal(f"< {limit:g}", lambda value: value < limit)


def at_most(limit: float) -> Goal:
    return Goal(f"≤ {limit:g}", lambda value: value <= limit)


def between(low: float, high: float) -> Goal:
    return Goal(f"{low:g} to {high:g}", lambda value: low <= value <= high)


def none() -> Goal:
    return Goal("0", lambda value: value == 0)


NO_FIGURE = Figure(None, NOTHING)

# Each of these takes the scenes of a row that have ended and returns a figure.
Measured = Callable[[Sequence[Ended]], Figure]


def records(scenes: Iterable[Ended]) -> list[Fields]:
    """The records of the scenes that did not crash."""
    return [scene.record for scene in scenes if scene.record is not None]


def rate(hits: int, of: int) -> Figure:
    """A share with its binomial error.

    Examples
    --------
    >>> rate(9, 10).text, round(rate(9, 10).error, 3), rate(0, 0).text
    ('0.90', 0.095, '–')
    """
    if not of:
        return NO_FIGURE
    p = hits / of
    return Figure(p, f"{p:.2f}", math.sqrt(p * (1 - p) / of))


def share(of: Keep, among: Keep = lambda record: True) -> Measured:
    """The share of scenes; a crashed one counts as missing it, unless only some are asked of."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        every = records(scenes)
        asked = [record for record in every if among(record)]
        all_asked = len(asked) == len(every)
        count = len(scenes) if all_asked else len(asked)
        figure = rate(sum(map(of, asked)), count)
        if all_asked or figure.value is None:
            return figure
        return Figure(figure.value, f"{figure.text} of {count}", figure.error)

    return measure


def bounded(of: Keep, among: Keep = lambda record: True) -> Measured:
    """`share` with its bounds by Clopper and Pearson, which hold the rate in 95 % of all runs."""
    measured = share(of, among)

    def measure(scenes: Sequence[Ended]) -> Figure:
        figure = measured(scenes)
        asked = [record for record in records(scenes) if among(record)]
        if figure.value is None:
            return figure
        count = len(scenes) if len(asked) == len(records(scenes)) else len(asked)
        low, high = clopper_pearson(round(figure.value * count), count)
        digits = 2 if count < MANY else 3
        text = f"{figure.value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"
        text += f" of {count}" * (count < len(scenes))
        return Figure(figure.value, text, figure.error)

    return measure


def clopper_pearson(hits: int, of: int, level: float = 0.95) -> tuple[float, float]:
    """Bounds of a rate: at neither would as few or as many hits be likelier than (1 - level) / 2.

    Examples
    --------
    >>> [round(bound, 4) for bound in clopper_pearson(0, 10)]
    [0.0, 0.3085]
    >>> [round(bound, 3) for bound in clopper_pearson(9, 10)]
    [0.555, 0.997]
    """
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, hits, of - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, of - hits)) if hits < of else 1.0
    return low, high


def mean(field: str) -> Measured:
    """The mean of a field over the scenes; of a crashed one it is 0."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        if not scenes:
            return NO_FIGURE
        value = sum(record[field] for record in records(scenes)) / len(scenes)
        return Figure(value, f"{value:.2f}")

    return measure


def total(field: str) -> Measured:
    """The sum of a field over the scenes."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        values = [record[field] for record in records(scenes)]
        return Figure(sum(values), str(sum(values))) if values else NO_FIGURE

    return measure


def typical(
    field: str, figure: Callable[[Sequence[float]], float] = statistics.median, unit: str = ""
) -> Measured:
    """The median (or other ``figure``) of a field over the scenes that have it."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        known = [record[field] for record in records(scenes) if record[field] is not None]
        if not known:
            return NO_FIGURE
        value = figure(known)
        return Figure(value, f"{_brief(value)}{unit}")

    return measure


def duration(
    figure: Callable[[Sequence[float]], float] = statistics.median, field: str = "seconds"
) -> Measured:
    """Seconds of a search."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        known = [record[field] for record in records(scenes)]
        return Figure(figure(known), seconds(figure(known))) if known else NO_FIGURE

    return measure


def seconds(value: float) -> str:
    """Seconds for a narrow cell.

    Examples
    --------
    >>> [seconds(value) for value in (0.0214, 0.318, 2.5, 83.4, 442.0)]
    ['0.021', '0.32', '2.5', '83', '442']
    """
    if value < 1:
        return f"{value:.2g}"
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def tally(field: str) -> Measured:
    """How many scenes have each value of a field, or each of a list, the most frequent first."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        counts: Counter[str] = Counter()
        for record in records(scenes):
            value = record[field]
            counts.update(value if isinstance(value, list) else [value])
        said = ", ".join(f"{count} {name}" for name, count in counts.most_common())
        return Figure(None, said or NOTHING)

    return measure


def worst(values: Sequence[float]) -> float:
    """A row's worst but for one scene in twenty: the 95th percentile.

    Examples
    --------
    >>> round(worst(range(101)), 9)
    95.0
    """
    return float(np.quantile(values, 0.95))


def _brief(value: float) -> str:
    return f"{value:.2g}" if abs(value) < 100 else f"{value:.0f}"
