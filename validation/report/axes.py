"""Axes of the report's drawings: from metres to the drawing's units, and ticks at round numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from validation.report.words import number

LARGEST = (320.0, 340.0)  # a slice's picture fits into this, in the drawing's units (CSS pixels)
FRAME = 9.0  # thickness of the limiter's frame
TICKS_MOST = 6
DECADES_FEW = 1.5  # a bar of fewer decades gets ticks at 1, 2 and 5 too


class Tick(NamedTuple):
    """A tick: where, in the drawing's units or as a share of the bar, and what is written."""

    at: float
    text: str


@dataclass(frozen=True)
class Axes:
    """A map of the floor: metres in, units of the drawing out, with y upwards."""

    xmin: float
    xmax: float
    ymin: float
    ymax: float
    scale: float

    @classmethod
    def around(cls, extent: Sequence[float] | NDArray[np.floating]) -> "Axes":
        """Return axes for (xmin, xmax, ymin, ymax) in metres.

        Raises
        ------
            ValueError: the extent is empty.
        """
        xmin, xmax, ymin, ymax = (float(value) for value in extent)
        if xmax <= xmin or ymax <= ymin:
            raise ValueError(f"the extent {xmin}, {xmax}, {ymin}, {ymax} is empty")
        scale = min(LARGEST[0] / (xmax - xmin), LARGEST[1] / (ymax - ymin))
        return cls(xmin, xmax, ymin, ymax, scale)

    @property
    def width(self) -> float:
        """Width of the picture, in the drawing's units."""
        return round((self.xmax - self.xmin) * self.scale, 2)

    @property
    def depth(self) -> float:
        """Height of the picture, in the drawing's units."""
        return round((self.ymax - self.ymin) * self.scale, 2)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a place lies in the drawing."""
        return round((x - self.xmin) * self.scale, 2), round((self.ymax - y) * self.scale, 2)

    def path(self, segments: NDArray[np.floating]) -> str:
        """Return segments (n, 2, 2) in metres as an SVG path."""
        ends = [(self.at(*start), self.at(*end)) for start, end in segments]
        return "".join(f"M{a[0]} {a[1]}L{b[0]} {b[1]}" for a, b in ends)

    @property
    def x_ticks(self) -> list[Tick]:
        """Ticks along x."""
        return [Tick(self.at(x, 0)[0], number(x)) for x in round_numbers(self.xmin, self.xmax)]

    @property
    def y_ticks(self) -> list[Tick]:
        """Ticks along y."""
        return [Tick(self.at(0, y)[1], number(y)) for y in round_numbers(self.ymin, self.ymax)]

    def frame(
        self, colour: Callable[[tuple[float, float]], str], steps: int
    ) -> list[dict[str, Any]]:
        """Return rectangles around the picture, coloured as the walls behind them."""
        patches: list[dict[str, Any]] = []
        for step in range(steps):
            middle = (step + 0.5) / steps
            x = self.xmin + middle * (self.xmax - self.xmin)
            y = self.ymax - middle * (self.ymax - self.ymin)
            wide, deep = self.width / steps, self.depth / steps
            across, down = round(step * wide, 2), round(step * deep, 2)
            # A little wider than the step, so that no seam shows between the patches.
            wide, deep = round(wide + 0.6, 2), round(deep + 0.6, 2)
            patches += [
                _patch(across, -FRAME, wide, FRAME, colour((x, self.ymax))),
                _patch(across, self.depth, wide, FRAME, colour((x, self.ymin))),
                _patch(-FRAME, down, FRAME, deep, colour((self.xmin, y))),
                _patch(self.width, down, FRAME, deep, colour((self.xmax, y))),
            ]
        return patches


def round_numbers(low: float, high: float) -> list[float]:
    """Return a few round numbers between two ends."""
    ticks = MaxNLocator(nbins=TICKS_MOST, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    slack = 1e-9 * (high - low)
    inside = [float(round(tick, 9)) for tick in ticks if low - slack <= tick <= high + slack]
    return [tick + 0.0 for tick in inside]  # no minus zero


def linear_bar(low: float, high: float) -> list[Tick]:
    """Return ticks of a colour bar, as shares of its length."""
    if high <= low:
        return [Tick(0.5, number(low))]
    return [Tick(_share(tick, low, high), number(tick)) for tick in round_numbers(low, high)]


def log_bar(low: float, high: float) -> list[Tick]:
    """Return ticks of a logarithmic bar between two powers of ten, as shares of its length."""
    steps = (1, 2, 5) if high - low < DECADES_FEW else (1,)
    stride = max(1, int(np.ceil((high - low) / TICKS_MOST)))
    powers = range(int(np.floor(low)), int(np.ceil(high)) + 1)
    values = [step * 10.0**power for power in powers if power % stride == 0 for step in steps]
    inside = [value for value in values if low <= np.log10(value) <= high]
    if len(inside) < 2:  # the bar is short: write its ends
        inside = [float(10**low), float(10**high)]
    return [Tick(_share(float(np.log10(value)), low, high), number(value)) for value in inside]


def _share(value: float, low: float, high: float) -> float:
    return round((value - low) / (high - low), 4)


def _patch(x: float, y: float, wide: float, deep: float, fill: str) -> dict[str, Any]:
    return {"x": x, "y": y, "wide": wide, "deep": deep, "fill": fill}
