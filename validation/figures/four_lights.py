"""Figure 2: votes find three of four lights, and the refinement the fourth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import PointLights
from lightloc.paper import State
from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import Scene, apart, close_up
from validation.rooms import rooms

LIGHTS, NUMBER = 4, 46  # of section 6.1's rooms: three peaks at lights, one light without any
REACH = 5  # cells: a neighbourhood is 11 x 11
CLOSE = 16  # cells: a close-up is 33 x 33
INNER = 0.15  # of the side: the place away from the lights lies so far from the walls
ITERATIONS = 100  # about what that scene takes

TITLE = "Four lights: three are voted for at once, the fourth after some iterations"
PAPER = (
    "Four lights (red) in a diffuse room: D(p) (a) and L(p) (b). Close to a light the limiters "
    "of a neighbourhood have about 25 colours (c, top), away from lights only 5 (c, bottom). V(p) "
    "counts them; its peaks are the first candidates, three green circles (d). The votes after "
    "some iterations show the fourth light (e), and the optimization ends at the true lights."
)


@dataclass(frozen=True, eq=False)
class Data:
    """The scene, the first and the last state of the algorithm, and two places to look closely.

    ``near`` is the light with the most colours about it, ``away`` the place furthest from all
    lights, both (3,).
    """

    scene: Scene
    first: State
    last: State
    near: NDArray[np.float64]
    away: NDArray[np.float64]

    @property
    def colours(self) -> tuple[int, int]:
        """Unique limiters in the neighbourhoods of ``near`` and ``away``."""
        return (
            self.scene.colour_count(self.near, REACH),
            self.scene.colour_count(self.away, REACH),
        )

    @property
    def worst(self) -> float:
        """Of the answer: from a true light to the nearest found one, metres."""
        return float(apart(self.scene.lights.positions, self.answer.positions).min(axis=1).max())

    @property
    def answer(self) -> PointLights:
        return self.last.tried if self.last.tried is not None else self.last.hypotheses


def data(watch: Callable[[float], None]) -> Data:
    scene = Scene.of(rooms(LIGHTS, count=NUMBER + 1)[NUMBER])
    first = last = None
    for state in scene.steps():
        first, last = first or state, state
        watch(min(1.0, state.iteration / ITERATIONS))
        if state.reason:
            break
    assert first is not None and last is not None
    lights = scene.lights.positions
    near = max(lights, key=lambda p: scene.colour_count(p, REACH))
    points = scene.grid.points
    inside = (np.abs(points[:, :2] - 0.5) < 0.5 - INNER).all(axis=1)
    away = points[inside][apart(points[inside], lights).min(axis=1).argmax()]
    return Data(scene, first, last, near, away)


def drawing(watch: Callable[[float], None]) -> Drawing:
    d = data(watch)
    scene, q, true = d.scene, d.scene.q, d.scene.lights.positions
    figure = draw.canvas(14.0, 9.2, f"Figure 2. {TITLE}")
    (bound, limited, _), (first, after, answer) = panels = figure.subplots(2, 3)
    panels[0, 2].remove()
    close = figure.add_gridspec(2, 3)[0, 2].subgridspec(2, 1)
    draw.field(bound, scene.fields[0], scene.grid, "D in W/sr")
    draw.limiters(limited, scene.fields[1], scene.grid, scene.colours)
    for axes, state in ((first, d.first), (after, d.last)):
        assert state.votes is not None
        draw.votes(axes, state.votes.votes, state.votes.grid)
    titles = {
        bound: "(a) D(p)",
        limited: "(b) L(p), with the two close-ups",
        first: f"(d) V(p): {len(d.first.candidates)} candidates",
        after: f"(e) V(p) of what is unexplained, iteration {d.last.iteration}",
        answer: f"(f) the optimized lights: {len(d.answer)}",
    }
    for axes, title in titles.items():
        draw.walls(axes, q, scene.colours)
        draw.plane(axes, title)
        draw.true(axes, true)
    draw.found(first, d.first.candidates, "candidate", linestyles="--")
    draw.found(after, d.last.candidates, "candidate", linestyles="--")
    answer.add_patch(draw.frame([0.5, 0.5], 0.5))
    draw.found(answer, d.answer.positions)
    for p, I in zip(d.answer.positions, d.answer.intensities[:, 0], strict=True):
        side = "left" if p[0] < 0.6 else "right"
        x = p[0] + (0.06 if side == "left" else -0.06)
        answer.text(x, p[1], f"{I:.2f} W/sr", fontsize=8, ha=side, va="center")
    for axes, p, name in (
        (figure.add_subplot(close[0]), d.near, "(c, top) close to a light"),
        (figure.add_subplot(close[1]), d.away, "(c, bottom) away from lights"),
    ):
        close_up(axes, scene, p, (REACH, CLOSE))
        axes.set_title(f"{name}: {scene.colour_count(p, REACH)} colours", fontsize=10)
        limited.add_patch(draw.frame(p[:2], (CLOSE + 0.5) * scene.grid.step[0], "white"))
    draw.legend(figure, first, answer)
    near, away = d.colours
    ours = (
        f"Room {scene.room.name} of our data set. {near} colours in a neighbourhood of "
        f"{2 * REACH + 1} x {2 * REACH + 1} cells about a light, {away} about the place furthest "
        f"from all lights. {len(d.first.candidates)} candidates at first; the last light is voted "
        f"for in iteration {d.last.iteration}; the optimized lights lie within {d.worst:.1g} m of "
        f"the true ones (mean squared error of B {d.last.mse:.1g})."
    )
    return Drawing(2, TITLE, PAPER, ours, figure)
