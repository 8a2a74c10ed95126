"""Scenes of section 6.1 as the figures need them: a square room, what is seen, and its fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lightloc import (
    Grid,
    Observations,
    Paper,
    Perimeter,
    PointLights,
    Votes,
    intensity_distance,
    vote,
)
from lightloc.fit import Problem
from lightloc.paper import DISCONTINUITY, LOWERING_OF_NOISE, RADIUS_OF_NOISE, State, iterate
from validation import draw
from validation.rooms import SAMPLES, PlaneRoom

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CELLS = Paper.cells  # along each side
DARKER = 0.72  # of every other limiter in a close-up, where neighbours look alike
LOW_ERROR = 0.0025  # of MSE, without noise (section 6.1)
# As `localize` sets the paper's method up where there is no noise.
OPTIONS = Paper(radius=RADIUS_OF_NOISE[False], lowering=LOWERING_OF_NOISE[False])


@dataclass(frozen=True, eq=False)
class Scene:
    """A square room with what is seen of it, and D and L over the paper's grid."""

    room: PlaneRoom
    q: Observations

    @staticmethod
    def of(room: PlaneRoom, noise: float = 0.0, seed: int = 0) -> Scene:
        return Scene(room, room.observe(SAMPLES, noise=noise, seed=seed))

    @property
    def lights(self) -> PointLights:
        return self.room.lights

    @property
    def radius(self) -> float:
        """The scene's, metres."""
        return self.q.diagonal / 2

    @cached_property
    def grid(self) -> Grid:
        lower, upper = self.q.bounds
        return Grid(lower, upper, (CELLS, CELLS, 1))

    @cached_property
    def surface(self) -> Perimeter:
        return Perimeter(*self.room.outline.along(self.q.positions))

    @cached_property
    def fields(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
        """D (g,) in W/sr and L (g,)."""
        D, L = intensity_distance(self.q, self.grid)
        return D[:, 0], L[:, 0]

    @property
    def colours(self) -> NDArray[np.float64]:
        """(n, 3), one per observation."""
        return draw.outline_colours(self.surface.along, float(self.surface.length[0]))

    def votes(self, radius: int = 1) -> Votes:
        return vote(self.grid, self.fields[1], self.surface, DISCONTINUITY * self.radius, radius)

    def steps(self) -> Iterator[State]:
        """The published algorithm as Table 1 runs it on scenes without noise (section 6.1)."""
        problem = Problem.of(self.q, np.ones_like(self.q.sigma), None, self.q.bounds)
        return iterate(problem, self.surface, self.radius, LOW_ERROR, OPTIONS)

    def neighbourhood(self, p: NDArray, reach: int) -> NDArray[np.uint32]:
        """Limiters of the (2 reach + 1)^2 cells about p, cut off at the walls."""
        cell = np.clip(((p - self.grid.lower) / _full(self.grid.step)).astype(int), 0, CELLS - 1)
        x, y = (slice(max(0, c - reach), c + reach + 1) for c in cell[:2])
        return self.fields[1].reshape(CELLS, CELLS)[x, y]

    def colour_count(self, p: NDArray, reach: int) -> int:
        """How many different limiters those cells have: section 3.4's vote, by counting."""
        return len(np.unique(self.neighbourhood(p, reach)))


def close_up(axes: Axes, scene: Scene, p: NDArray, reach: tuple[int, int]) -> None:
    """L(p) cell by cell, neighbours told apart; what is counted framed (reaches in cells)."""
    counted, shown = reach
    step = scene.grid.step[0]
    stripes = np.where(np.arange(len(scene.colours)) % 2, DARKER, 1.0)
    draw.limiters(axes, scene.fields[1], scene.grid, scene.colours * stripes[:, None])
    middle = (np.floor(p[:2] / step) + 0.5) * step
    axes.add_patch(draw.frame(middle, (counted + 0.5) * step))
    half = (shown + 0.5) * step
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_xlabel("x in m", fontsize=9)
    axes.set_ylabel("y in m", fontsize=9)
    axes.locator_params(nbins=4)
    axes.tick_params(labelsize=8)
    draw.true(axes, scene.lights.positions)


def _full(step: NDArray) -> NDArray:
    """A flat grid's step, 1 along the axis that it has none on."""
    return np.where(step > 0, step, 1.0)


def apart(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """(m, n) distances between (m, 3) and (n, 3) positions."""
    return np.linalg.norm(np.asarray(a)[:, None] - np.asarray(b), axis=2)
