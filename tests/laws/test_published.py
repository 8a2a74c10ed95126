"""The published method's own numbers: when an error is low, and what a hypothesis is refined on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Paper, Perimeter, Reason, localize
from lightloc.fields import Field
from lightloc.fit import Problem
from lightloc.paper import method
from lightloc.paper.optimization import LOW_ERROR, OF_THE_TRUTH, State, grid_over, refined
from validation.rooms.plane import rooms


@pytest.mark.parametrize("unit", [1.0, 100.0])
def test_a_low_error_is_in_the_unit_of_b_squared(unit, monkeypatch):
    """105 % of the mean square of sigma (section 6.1), whatever the unit; 0.0025 without noise."""
    asked = []

    def iterate(problem, surface, radius, low_error, o):
        asked.append(low_error)
        nothing = np.zeros((0, 3))
        dark = problem.radiance[:, 0]
        lights = rooms(2, count=1)[0].lights
        yield State(0, lights, dark, None, nothing, None, np.inf, Reason.NO_VOTES)

    monkeypatch.setattr(method, "iterate", iterate)
    room = rooms(2, count=1)[0]
    for q in (room.observe(noise=0.05), room.observe()):
        localize(q.with_radiance(unit * q.radiance, unit * q.sigma), method="paper")
    square = np.square(unit * room.observe(noise=0.05).sigma).mean()
    assert asked == [pytest.approx(OF_THE_TRUTH * square), LOW_ERROR]


def test_hypotheses_are_refined_on_their_own_light():
    """B^i is what the others leave (section 5.3): at the truth, the light of i alone.

    Its votes peak within two and a half cells of it (`test_voting`); so each hypothesis, which has
    the right intensity and stands there, stays as near.
    """
    room = rooms(2, count=1)[0]
    q, o = room.observe(), replace(Paper(), radius=1, lowering=0.5, threshold=0.5)
    problem = Problem.of(q, np.ones_like(q.radiance), None, q.bounds)
    grid = grid_over(q.bounds, o)
    edge = Perimeter(*room.outline.along(q.positions))
    p, I = room.lights.positions, room.lights.intensities[:, 0]
    field = Field.over(problem.surfels, grid)
    moved = refined(problem, p, I, field, grid, edge, q.diagonal / 2, o)
    assert (moved != p).any(axis=1).all()  # each has found a candidate
    assert (np.abs(moved - p)[:, :2] / grid.step[:2]).max() < 2.5
