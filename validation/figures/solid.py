"""Rooms in three dimensions as the figures need them: observed and voted on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import render
from lightloc import Geodesic, Observations, Paper, PointLights
from lightloc.fit import Problem
from lightloc.paper import State, iterate

POINTS, SEED = 16_000, 1
# Coarser than the paper's 512 cells and 60 000 points, and T with them: 15 % of the radius for its
# 5 %, so that T holds several cells and several times the points' spacing. H starts low enough
# for more than one peak, and what lies within 20 % of the radius is one light.
OPTIONS = Paper(
    cells_3d=56,
    threshold=0.15,
    height=2.4e-4,
    lowering=0.75,
    merge=0.2,
    association=0.2,
    increment=2.0,
    radius=1,
)
SAME_AS_TRUTH = 1e-5  # of the mean of B^2: lights with a smaller error explain B


@dataclass(frozen=True, eq=False)
class Solid:
    """A 3D room and what is seen of it: q, with its noise where it has some."""

    room: render.Room
    q: Observations
    options: Paper = OPTIONS

    @property
    def lights(self) -> PointLights:
        return self.room.lights

    @property
    def radius(self) -> float:
        """The scene's, metres."""
        return self.q.diagonal / 2

    @cached_property
    def surface(self) -> Geodesic:
        return Geodesic.of(self.q.positions, self.q.normals, self.options.threshold * self.radius)

    def low_error(self) -> float:
        """The MSE at which lights explain B: of the noise, or of the arithmetic without any."""
        B, sigma = self.q.radiance, self.q.known_sigma
        return SAME_AS_TRUTH * float(np.square(B).mean()) + 1.05 * float(np.square(sigma).mean())

    def steps(self) -> Iterator[State]:
        """The published algorithm with these options."""
        sigma = self.q.known_sigma
        sigma = sigma if (sigma > 0).all() else np.ones_like(sigma)
        problem = Problem.of(self.q, sigma, self.room.geometry, self.q.bounds)
        return iterate(problem, self.surface, self.radius, self.low_error(), self.options)


def observed(room: render.Room) -> Solid:
    """Direct light without noise."""
    return Solid(room, render.observe(room, points=POINTS, seed=SEED, transport="direct"))
