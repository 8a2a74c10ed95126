"""The search's chi-square, step by step, as a small drawing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.records import Step
from validation.report.axes import Tick, log_bar, round_numbers
from validation.report.words import number

WIDTH, HEIGHT = 420.0, 190.0  # of the plotted area, in CSS pixels
MARGIN = 0.06  # of a side, kept free around the points
STEP_TICKS = 8


@dataclass(frozen=True)
class Point:
    """A step of the search: where it is drawn, and what it was."""

    x: float
    y: float
    lights: int | None
    text: str


@dataclass(frozen=True)
class Curve:
    """Chi-square against the step, logarithmic where every value is above zero."""

    width: float
    height: float
    line: str
    points: list[Point]
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    logarithmic: bool


def curve(history: Sequence[Step]) -> Curve | None:
    """Lay out a search's chi-square; None where fewer than two steps have one."""
    known = [
        (index, step, step.chi2)
        for index, step in enumerate(history, start=1)
        if step.chi2 is not None
    ]
    if len(known) < 2:
        return None
    logarithmic = all(chi2 > 0 for _, _, chi2 in known)
    heights = [math.log10(chi2) if logarithmic else chi2 for _, _, chi2 in known]
    low, high = min(heights), max(heights)
    if high - low < 1e-9:
        low, high = low - 0.5, high + 0.5
    room = MARGIN * (high - low)
    low, high = low - room, high + room
    steps = len(history)

    def across(index: float) -> float:
        return round(WIDTH * (MARGIN + (1 - 2 * MARGIN) * (index - 1) / max(steps - 1, 1)), 2)

    def up(share: float) -> float:
        return round(HEIGHT * (1 - share), 2)

    points = []
    for (index, step, chi2), level in zip(known, heights, strict=True):
        lights = "" if step.lights is None else f", {step.lights} lights"
        text = f"step {index}, {step.step}{lights}: χ² = {number(chi2, 4)}"
        points.append(Point(across(index), up((level - low) / (high - low)), step.lights, text))
    if logarithmic:
        y_ticks = [Tick(up(tick.at), tick.text) for tick in log_bar(low, high)]
    else:
        marks = round_numbers(low, high)
        y_ticks = [Tick(up((mark - low) / (high - low)), number(mark)) for mark in marks]
    stride = max(1, -(-steps // STEP_TICKS))
    x_ticks = [Tick(across(index), str(index)) for index in range(1, steps + 1, stride)]
    line = "M" + "L".join(f"{point.x} {point.y}" for point in points)
    return Curve(WIDTH, HEIGHT, line, points, x_ticks, y_ticks, logarithmic)
