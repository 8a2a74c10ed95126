"""How long the scenes took, row by row, on one logarithmic axis beside the paper's figures."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.report.axes import Tick, log_bar

WIDTH, BAND = 700.0, 30.0  # of the plotted area and of a row, in CSS pixels
SPREAD = 0.62  # of a band that the dots fill
MARGIN = 0.03  # of the width, kept free at both ends
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples spread the dots evenly, the same every time


@dataclass(frozen=True)
class Dot:
    """A scene: where it is drawn, whether its lights were recovered, and its name."""

    x: float
    y: float
    solved: bool
    text: str


@dataclass(frozen=True)
class Strip:
    """A row's dots; ``median`` is ours, ``paper`` the paper's median and longest."""

    name: str
    y: float
    dots: list[Dot]
    median: float | None
    paper: list[float]


@dataclass(frozen=True)
class Runtimes:
    """The whole drawing, in CSS pixels."""

    width: float
    height: float
    band: float
    strips: list[Strip]
    ticks: list[Tick]


def runtimes(
    rows: Sequence[tuple[str, Sequence[tuple[str, float, bool]], float | None, Sequence[float]]],
) -> Runtimes | None:
    """Lay out rows of (name, [(scene, seconds, solved), ...], our median, the paper's figures).

    None where no scene has a runtime above zero.
    """
    ours = [taken for _, scenes, _, _ in rows for _, taken, _ in scenes if taken > 0]
    if not ours:
        return None
    every = ours + [value for _, _, _, paper in rows for value in paper if value > 0]
    low, high = math.log10(min(every)), math.log10(max(every))
    if high - low < 1e-9:
        low, high = low - 0.5, high + 0.5

    def across(value: float) -> float:
        share = (math.log10(value) - low) / (high - low)
        return round(WIDTH * (MARGIN + (1 - 2 * MARGIN) * share), 2)

    strips = []
    for number, (name, scenes, median, paper) in enumerate(rows):
        top = number * BAND
        dots = [
            Dot(
                across(taken),
                round(top + BAND * _height(index), 2),
                solved,
                f"{scene}: {taken:g} s",
            )
            for index, (scene, taken, solved) in enumerate(scenes)
            if taken > 0
        ]
        strips.append(
            Strip(
                name,
                top,
                dots,
                across(median) if median else None,
                [across(value) for value in paper if value > 0],
            )
        )
    ticks = [Tick(across(10 ** (low + t.at * (high - low))), t.text) for t in log_bar(low, high)]
    return Runtimes(WIDTH, BAND * len(rows), BAND, strips, ticks)


def _height(index: int) -> float:
    return 0.5 + SPREAD * ((index * GOLDEN) % 1 - 0.5)
