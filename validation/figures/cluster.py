"""Figure 3: lights that stand close together, and what becomes of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import PointLights, Reason, Votes
from lightloc.paper import State
from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import LOW_ERROR, Scene, apart
from validation.rooms import rooms

LIGHTS = 5
# Of section 6.1's rooms: one in which one light stands for two at a low error, and one in which
# two lights are never told apart.
REPLACED, UNFOUND = 96, 63
ITERATIONS = 140  # about what they take

TITLE = "Lights in a cluster: taken for one, and never told apart"
PAPER = (
    "Failures by clustering. One light (green) stands for a cluster of several (red), and the "
    "error is low all the same (a). Two lights near a wall, which no single light can stand for: "
    "V(p) never shows them as two peaks, and the algorithm ends without a solution (b)."
)


@dataclass(frozen=True, eq=False)
class End:
    """Where the algorithm ended.

    Parameters
    ----------
    scene
        Where it ran.
    first, last
        Its first state, and the last that has votes.
    lights
        The answer, or where there is none, the optimized lights of least error.
    mse
        Of those.
    reason
        Why it ended.
    told_apart
        In how many iterations the two closest lights had a candidate each, nearer to it than to
        the other.
    """

    scene: Scene
    first: State
    last: State
    lights: PointLights
    mse: float
    reason: Reason | None
    told_apart: int

    @property
    def solution(self) -> bool:
        return self.mse < LOW_ERROR

    @property
    def shown(self) -> Votes:
        """V(p) of the last iteration, or where that led nowhere, of the first."""
        votes = (self.last if self.solution else self.first).votes
        assert votes is not None
        return votes


def closest(lights: PointLights) -> tuple[NDArray[np.float64], float]:
    """(2, 3) positions of the two closest lights, and how far apart they are, metres."""
    between = apart(lights.positions, lights.positions)
    between[np.diag_indices_from(between)] = np.inf
    pair = np.unravel_index(between.argmin(), between.shape)
    return lights.positions[list(pair)], float(between.min())


def end(number: int, watch: Callable[[float], None]) -> End:
    scene = Scene.of(rooms(LIGHTS, count=number + 1)[number])
    two, between = closest(scene.lights)
    first = last = None
    best, least, told, reason = scene.lights, np.inf, set(), None
    for state in scene.steps():
        watch(min(1.0, state.iteration / ITERATIONS))
        reason = state.reason
        if state.votes is not None:
            first, last = first or state, state
            if (apart(two, state.candidates).min(axis=1, initial=np.inf) < between / 2).all():
                told.add(state.iteration)
        if state.tried is not None and state.mse < least:
            best, least = state.tried, state.mse
    assert first is not None and last is not None
    return End(scene, first, last, best, least, reason, len(told))


def data(watch: Callable[[float], None]) -> tuple[End, End]:
    return (
        end(REPLACED, lambda share: watch(share / 2)),
        end(UNFOUND, lambda share: watch(0.5 + share / 2)),
    )


def drawing(watch: Callable[[float], None]) -> Drawing:
    ends = data(watch)
    figure = draw.canvas(12.0, 5.8, f"Figure 3. {TITLE}")
    panels = figure.subplots(1, 2)
    for axes, name, e in zip(panels, "ab", ends, strict=True):
        draw.votes(axes, e.shown.votes, e.shown.grid)
        draw.walls(axes, e.scene.q, e.scene.colours)
        how = "a solution of low error" if e.solution else "no solution"
        which = f"iteration {e.last.iteration}" if e.solution else "first iteration"
        draw.plane(axes, f"({name}) V(p), {which}: {how}")
        draw.true(axes, e.scene.lights.positions)
        if e.solution:
            draw.found(axes, e.lights.positions)
        else:
            draw.found(axes, e.first.candidates, "candidate", linestyles="--")
    draw.legend(figure, *panels)
    ours = " ".join(f"({name}) {sentence(e)}" for name, e in zip("ab", ends, strict=True))
    return Drawing(3, TITLE, PAPER, ours, figure)


def sentence(e: End) -> str:
    """What became of a scene."""
    start = (
        f"Room {e.scene.room.name} has {len(e.scene.lights)} lights, the closest two "
        f"{closest(e.scene.lights)[1]:.3f} m apart;"
    )
    after = f"after {e.last.iteration} iterations"
    if e.solution:
        return (
            f"{start} {after} {len(e.lights)} lights explain B with a mean squared error of "
            f"{e.mse:.1g}, below {LOW_ERROR}."
        )
    seen = f"in {e.told_apart}" if e.told_apart else "in none"
    return (
        f"{start} {seen} of {e.last.iteration + 1} iterations did each have a candidate. The least "
        f"error of {len(e.lights)} lights was {e.mse:.3g}. {e.reason.value if e.reason else ''}"
    )
