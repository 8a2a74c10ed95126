"""Figure 4: what noise does to the limiters of one scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import Scene, close_up
from validation.rooms import rooms

LIGHTS, NUMBER = 3, 35  # of section 6.1's rooms: its leftmost light is near the middle
K = 0.05  # the noise (section 6.1)
CLOSE = 20  # cells: a close-up is 41 x 41
REACH = 12  # cells: the neighbourhood is 25 x 25

TITLE = "Limiters without and with noise"
PAPER = (
    "L(p) of one scene without noise (a) and with it (b). About the leftmost light, near the "
    "middle of the room, two cells of constant L take over the whole region; no vote that means "
    "anything can be counted there."
)


@dataclass(frozen=True, eq=False)
class Data:
    """The same room seen twice."""

    clean: Scene
    noisy: Scene

    @property
    def leftmost(self) -> np.ndarray:
        """(3,) the light that is looked at."""
        lights = self.clean.lights.positions
        return np.asarray(lights[lights[:, 0].argmin()])

    def colours(self) -> tuple[int, int]:
        """Unique limiters about that light, without and with noise."""
        p = self.leftmost
        return self.clean.colour_count(p, REACH), self.noisy.colour_count(p, REACH)

    def two_largest(self) -> tuple[float, float]:
        """The share of the neighbourhood that its two commonest limiters hold, of each."""
        shares = []
        for scene in (self.clean, self.noisy):
            near = scene.neighbourhood(self.leftmost, REACH)
            counts = np.unique(near, return_counts=True)[1]
            shares.append(float(np.sort(counts)[-2:].sum() / near.size))
        return shares[0], shares[1]


def data() -> Data:
    room = rooms(LIGHTS, count=NUMBER + 1)[NUMBER]
    return Data(Scene.of(room), Scene.of(room, noise=K, seed=NUMBER))


def drawing(watch: Callable[[float], None]) -> Drawing:
    d = data()
    figure = draw.canvas(11.0, 9.4, f"Figure 4. {TITLE}")
    panels: Any = figure.subplots(2, 2, height_ratios=(1.6, 1))
    names = ("(a) L(p), no noise", f"(b) L(p), noise of k = {K:g}")
    for (axes, close), scene, name, count in zip(
        panels.T, (d.clean, d.noisy), names, d.colours(), strict=True
    ):
        draw.limiters(axes, scene.fields[1], scene.grid, scene.colours)
        draw.walls(axes, scene.q, scene.colours)
        draw.plane(axes, f"{name}: {count} colours in the frame")
        draw.true(axes, scene.lights.positions)
        reach = (REACH + 0.5) * float(scene.grid.step[0])
        axes.add_patch(draw.frame(d.leftmost, reach))
        close_up(close, scene, d.leftmost, (REACH, CLOSE))
        close.set_title("close-up, every other limiter darker", fontsize=10)
    draw.legend(figure, panels[0, 0])
    before, after = d.two_largest()
    ours = (
        f"Room {d.clean.room.name} of our data set. In {2 * REACH + 1} x {2 * REACH + 1} cells "
        f"about the leftmost light (the frame) there are {d.colours()[0]} limiters without noise "
        f"and {d.colours()[1]} with it; the two commonest hold {before:.0%} and {after:.0%} of "
        "these cells."
    )
    watch(1.0)
    return Drawing(4, TITLE, PAPER, ours, figure)
