"""The published method (method="paper"): its parts against section 5, and a sample of Table 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joblib import Parallel, delayed
from scipy.stats import binom

from lightloc import Geodesic, Paper, Perimeter, PointLights, Reason, localize, radiance
from lightloc.fit.problem import Problem
from lightloc.paper.method import along_surface
from lightloc.paper.optimization import associate, grid_over, iterate, optimize
from validation.jobs.pool import one
from validation.judge import is_solved
from validation.judge.match import compare
from validation.rooms.plane import PlaneRoom, named_outlines, rooms, rooms_of
from validation.studies import columns
from validation.studies.published import ROWS

SCENES = 10  # of each row of Table 1
UNLUCKY = 0.01  # how rarely a method as good as the paper's may fail a row's test


def found_in(room: PlaneRoom, noise: float = 0.0, **options):
    q = room.observe(noise=noise)
    edge = Perimeter(*room.outline.along(q.positions))
    paper = Paper(**options)
    return localize(q, room.geometry, method="paper", options=paper, surface=edge)


@pytest.fixture(scope="module")
def records() -> dict[str, list[columns.Record]]:
    """Ten scenes per row, with all columns, on two processes."""
    names = columns.names(SCENES)
    ended = Parallel(n_jobs=2)(delayed(one)(columns.scene, name) for name in names)
    assert not [each.error for each in ended if each.error]
    done = [columns.Record(**each.record) for each in ended]
    return {row: [r for r in done if r.name.startswith(row)] for row in ROWS}


@pytest.mark.parametrize("row", ROWS)
def test_low_error_as_often_as_the_paper(row, records):
    """Full: no fewer of ten scenes than the paper's rate gives in 99 of 100 such samples."""
    full = sum(record.full for record in records[row])
    assert full >= binom.ppf(UNLUCKY, SCENES, ROWS[row][2])


BELOW = {  # what the paper's rate asks for and ours does not reach; docs/table1.md has all rows
    "noiseless-4": "3 of 100 stop at 3 lights with an MSE below 0.0025; the paper solves all"
}
SOLVED = [
    pytest.param(row, marks=pytest.mark.xfail(strict=True, reason=BELOW[row]))
    if row in BELOW
    else row
    for row in ROWS
]


@pytest.mark.parametrize("row", SOLVED)
def test_solved_as_often_as_the_paper(row, records):
    """Solved: the same; and never without a low error."""
    solved = sum(record.solved for record in records[row])
    assert solved >= binom.ppf(UNLUCKY, SCENES, ROWS[row][3])
    assert all(record.full for record in records[row] if record.solved)


@pytest.mark.parametrize("row", ROWS)
def test_what_a_low_error_means(row, records):
    """Full is an MSE below 0.0025, or 105 % of the truth's under noise; V(p) is part of it."""
    for record in records[row]:
        low = columns.OF_THE_TRUTH * record.mse_truth if record.noise else columns.LOW_ERROR
        assert record.full == (record.mse < low)
        assert record.full or not record.votes
        assert 0 <= record.random <= 1


def test_the_oracle(records):
    """Started at the truth: always solved without noise; under noise rarer with more lights."""
    rate = {row: np.mean([record.oracle for record in records[row]]) for row in ROWS}
    assert all(rate[row] == 1 for row in ROWS if row.startswith("noiseless"))
    assert rate["noisy-5"] <= rate["noisy-2"]


@pytest.mark.parametrize("make", ["L", "circle", "curved", "stadium", "discs", "bar"])
def test_rooms_that_are_not_square(make):
    """Two lights each, curved walls and shadows included: found to 0.1 % and 0.5 %."""
    room = rooms_of(named_outlines()[make], 2, count=1, name=make)[0]
    found = found_in(room)
    verdict = compare(found.lights, room.lights, diagonal=1.0, radius=1e-3)
    assert found.reason is Reason.CONVERGED
    assert not verdict.missed
    assert not verdict.ghosts
    assert verdict.worst_intensity_percent < 0.5


@pytest.mark.parametrize("number", [0, 2, 9])
def test_four_lights_without_a_surface(number):
    """The walls that are followed through the observations are as good as the true ones: the same
    steps to the same lights. (Over neighbours within reach, room 0 ends after two lights, DARKER;
    2 and 9 take two and three times as many steps.)"""
    room = rooms(4, count=number + 1)[number]
    found = localize(room.observe(), room.geometry, method="paper")
    true = found_in(room)
    assert found.reason is true.reason is Reason.CONVERGED
    assert [step.lights for step in found.history] == [step.lights for step in true.history]
    np.testing.assert_allclose(found.lights.positions, true.lights.positions, atol=1e-6)


@pytest.mark.parametrize("make", ["L", "curved", "discs", "bar"])
def test_rooms_that_are_not_square_without_a_surface(make):
    """Curved walls and occluders too: found to 0.1 %."""
    room = rooms_of(named_outlines()[make], 2, count=1, name=make)[0]
    found = localize(room.observe(), room.geometry, method="paper")
    verdict = compare(found.lights, room.lights, diagonal=1.0, radius=1e-3)
    assert found.reason is Reason.CONVERGED
    assert not verdict.missed
    assert not verdict.ghosts


def test_a_space_that_is_no_plane():
    """Of observations in a plane, lights are sought outside it with areas, as in 3D."""
    room = rooms(2, count=1)[0]
    q = room.observe(100)
    deep = [[0, 0, -0.5], [1, 1, 0.5]]
    assert isinstance(along_surface(q, q.bounds, 0.1), Perimeter)
    assert isinstance(along_surface(q, np.array(deep), 0.1), Geodesic)
    found = localize(q, method="paper", bounds=deep, options=Paper(cells_3d=8, most_lights=1))
    assert found.reason is not None


def states(room: PlaneRoom, o: Paper) -> tuple[list, Problem]:
    q = room.observe()
    edge = Perimeter(*room.outline.along(q.positions))
    problem = Problem.of(q, np.ones_like(q.radiance), None, q.bounds)
    return list(iterate(problem, edge, q.diagonal / 2, 0.0, o)), problem


def test_the_steps_of_section_5():
    """B' is B less the hypotheses' light; brightening is by increments; a failure is B' < 0.

    With a low error of 0 nothing converges, so that the algorithm runs to its end.
    """
    o = Paper(increment=0.25, radius=1, lowering=0.5)
    room = rooms(2, count=1)[0]
    steps, problem = states(room, o)
    B = problem.radiance[:, 0]
    before = np.zeros(0)
    for state in steps[:-1]:
        assert (state.unexplained >= 0).all()
        I = state.hypotheses.intensities[:, 0]
        grown = I[: len(before)] - before
        assert ((np.abs(grown) < 1e-9) | (np.abs(grown - o.increment) < 1e-9)).all()
        before = I
    first = steps[0]
    np.testing.assert_array_equal(first.unexplained, B)
    assert not first.hypotheses.intensities.any()
    assert steps[-1].reason is Reason.DARKER
    assert (steps[-1].unexplained < 0).any()
    left = B - radiance(problem.surfels, steps[-1].hypotheses)[:, 0]
    np.testing.assert_allclose(steps[-1].unexplained, left, atol=1e-3 * B.mean())


def test_noise_below_zero_is_not_the_hypotheses_fault():
    """B below zero is as dark as can be, as section 6.1's data have it; B' turns negative by the
    hypotheses' light alone, of which there is none at first."""
    room = rooms(2, count=2)[1]
    q = room.observe()
    noise = np.random.default_rng(1).normal(size=q.radiance.shape)
    B = q.radiance + np.hypot(2.0, 0.05 * np.sqrt(q.radiance)) * noise
    assert (B < 0).any()
    problem = Problem.of(q.with_radiance(B, 2.0), np.ones_like(B), None, q.bounds)
    edge = Perimeter(*room.outline.along(q.positions))
    first = next(iterate(problem, edge, q.diagonal / 2, 0.0, Paper(radius=15, lowering=0.9)))
    assert first.reason is not Reason.DARKER
    np.testing.assert_array_equal(first.unexplained, np.maximum(B[:, 0], 0))


def test_association():
    """The nearest hypothesis within reach, and none else (section 5.1)."""
    candidates = np.array([[0, 0, 0], [1, 0, 0], [2.05, 0, 0.0]])
    hypotheses = np.array([[2, 0, 0], [0.05, 0, 0], [0, 0.02, 0]])
    assert associate(candidates, hypotheses, 0.1).tolist() == [2, -1, 0]
    assert associate(candidates, hypotheses[:0], 0.1).tolist() == [-1, -1, -1]


def test_optimization_reads_lights():
    """Twice the same hypothesis is one light, and an idle one is none (section 5.2)."""
    room = rooms(3, count=1)[0]
    q = room.observe()
    problem = Problem.of(q, np.ones_like(q.radiance), None, q.bounds)
    p = room.lights.positions
    idle = np.array([[0.5, 0.5, 0.0]])
    grid = grid_over(q.bounds, Paper())
    there, mse = optimize(problem, np.concatenate([p, p + 0.01, idle]), grid, 0.7, Paper())
    assert mse < 1e-6
    assert not compare(there, room.lights, diagonal=1.0, radius=1e-3).ghosts
    dark = replace(problem, radiance=np.zeros_like(problem.radiance))
    there, mse = optimize(dark, idle, grid, 0.7, Paper())
    assert len(there) == 0 and mse == np.inf


def test_colours_are_refused():
    """The paper's method takes one channel, and its own options."""
    room = rooms(2, count=1)[0]
    q = room.observe()
    three = type(q)(
        positions=q.positions,
        normals=q.normals,
        directions=q.directions,
        radiance=np.repeat(q.radiance, 3, axis=1),
        material=q.material,
    )
    with pytest.raises(ValueError, match="one channel"):
        localize(three, method="paper")
    with pytest.raises(ValueError, match="takes Options as its options"):
        localize(q, method="search", options=Paper())
    with pytest.raises(ValueError, match="expected 'search' or 'paper'"):
        localize(q, method="other")  # type: ignore[arg-type]


def test_another_room_is_not_solved():
    """Negative control: lights that are not in the room are no solution."""
    room = rooms(2, count=2)
    assert not is_solved(room[0].lights, room[1].lights, columns.SOLVED)
    moved = PointLights(np.add(room[0].lights.positions, [0.02, 0, 0]), room[0].lights.intensities)
    assert not is_solved(moved, room[0].lights, columns.SOLVED)
    brighter = PointLights(room[0].lights.positions, room[0].lights.intensities * 1.06)
    assert not is_solved(brighter, room[0].lights, columns.SOLVED)
    assert is_solved(room[0].lights, room[0].lights, columns.SOLVED)
