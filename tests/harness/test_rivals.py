"""The rivals: each finds an easy light, none looks at the truth, and the judge is strict."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

import render
from lightloc import Grid, PointLights, shading
from validation import compare
from validation.jobs.store import Ended
from validation.studies import rival_solvers as rivals
from validation.studies import rivals as study
from validation.studies.study import outcome, tabulate

EASY = 1.0, 5.0  # percent of the diagonal and of the intensity: what counts as solved
NOISE = 4.0  # standard errors of a standard deviation that is estimated from n values


@pytest.fixture
def short(monkeypatch):
    """Small searches: what is tested is that they work, not how well."""
    monkeypatch.setattr(rivals, "STARTS", 10)
    monkeypatch.setattr(rivals, "AT_ONCE", 5)
    monkeypatch.setattr(rivals, "CELLS", 9**3)
    monkeypatch.setattr(rivals, "GRID_SAMPLE", 512)
    adam = render.descent.Adam(starts=4, steps=200, points=512)
    monkeypatch.setattr(
        rivals, "optimize", lambda *given: render.descent.optimize(*given, options=adam)
    )


def observe(room, noise=0.01):
    return render.observe(room, points=1024, seed=3, transport="direct", noise=noise)


# the rivals


@pytest.mark.parametrize("rival", rivals.RIVALS, ids=lambda rival: rival.name)
def test_each_finds_one_light(rival, load, short):
    """One light in an empty box of metal is easy for all of them."""
    room = render.relight(load("box_conductor"), PointLights([[2.5, 2.0, 1.3]], [12.0]))
    verdict = compare(rival.solve(observe(room), room, 1), room.lights, room.diagonal)
    assert verdict.count_right and not verdict.missed, verdict
    assert verdict.worst_position_percent < EASY[0], verdict
    assert verdict.worst_intensity_percent < EASY[1], verdict


@pytest.mark.parametrize("rival", rivals.RIVALS, ids=lambda rival: rival.name)
def test_none_looks_at_the_truth(rival, load, short):
    """The same data in a room that is lit otherwise: the same lights, bit for bit."""
    room = load("box_conductor")
    q = observe(render.relight(room, PointLights([[2.5, 2.0, 1.3]], [12.0])))
    other = render.relight(room, PointLights([[1.0, 1.0, 1.0]], [99.0]))
    first, second = (rival.solve(q, lit, 1) for lit in (room, other))
    assert np.array_equal(first.positions, second.positions)
    assert np.array_equal(first.intensities, second.intensities)


def test_random_starts_need_the_right_count(load, short):
    """Negative control: told of one light where there are two, they do not find both."""
    room = load("box_two")
    found = rivals.random_starts(observe(room), room, 1)
    assert compare(found, room.lights, room.diagonal).missed


def test_exact_data_are_taken_too(load, short):
    """Without noise there is no sigma to weight by: every observation weighs the same."""
    room = load("box_two")
    found = rivals.random_starts(observe(room, noise=0.0), room, 2)
    assert compare(found, room.lights, room.diagonal).worst_position_percent < EASY[0]


def test_clusters_are_cells_that_touch():
    """Two clusters: the centroid by intensity, channel by channel the sum; the faint one is none.

    By hand: cells 0 and 1 along x hold 1 and 3, so their centroid is at 0.5 + 3/4.
    """
    grid = Grid([0, 0, 0], [8, 4, 1], (8, 4, 1))
    I = np.zeros((8, 4, 1, 3))
    I[0, 0, 0], I[1, 1, 0] = [1, 1, 1], [3, 3, 3]  # they touch by an edge
    I[5, 2, 0] = [0, 0, 6]
    I[7, 0, 0] = 0.5 * rivals.FAINT  # of a sum of 4 + 2, below FAINT of it
    lights = rivals.clusters(grid, I.reshape(-1, 3))
    assert lights.positions.tolist() == [[1.25, 1.25, 0.5], [5.5, 2.5, 0.5]]
    assert lights.intensities.tolist() == [[4, 4, 4], [0, 0, 6]]
    assert len(rivals.clusters(grid, np.zeros((32, 1)))) == 0


# the scenes


def test_the_first_round_has_the_rooms_own_lights(load):
    """box_occluder holds three lights: they are the scene with three; with two, others are."""
    own = load("box_occluder").lights
    assert np.array_equal(study.scene(3, 1)[0].lights.positions, own.positions)
    assert len(study.scene(2, 1)[0].lights) == 2
    assert not np.array_equal(study.scene(3, 6)[0].lights.positions, own.positions)


def test_scenes_are_what_they_say():
    """Lights lie apart, in the open; the noise is 1 %; the same name, the same scene."""
    room, q = study.scene(5, 4)
    again, q_again = study.scene(5, 4)
    assert np.array_equal(room.lights.positions, again.lights.positions)
    assert np.array_equal(q.radiance, q_again.radiance)
    p = room.lights.positions
    apart = np.linalg.norm(p[:, None] - p, axis=2) + 1e9 * np.eye(5)
    assert apart.min() >= study.CLEARANCE * room.diagonal
    assert ((shading(q, p, room.geometry) > 0).any(axis=2).mean(axis=0) > 0.9 * study.LIT).all()
    clean = render.observe(room, points=len(q), seed=4, transport="direct").radiance
    lit = clean > 0
    share = (q.radiance - clean)[lit] / np.sqrt(clean * clean.mean())[lit]
    assert abs(share.std() / study.ONE_PERCENT - 1) < NOISE / np.sqrt(2 * lit.sum())


def test_no_room_for_more_lights():
    room, _ = study.scene(1, 0)
    with pytest.raises(ValueError, match="no free place for 500 lights"):
        study.random_lights(room, 500, np.random.default_rng(0))


# the judge


def test_only_the_truth_counts_as_solved(load):
    """Negative controls: 2 % of the diagonal off, 6 % too bright, one light more, one less."""
    room = load("box_three")
    p, I = room.lights.positions, room.lights.intensities
    first = np.eye(3)[:, :1]
    right = study.judged("lights-3-ours-000", room, room.lights, 1.0)
    assert right.solved and (right.missed, right.ghosts, right.found) == (0, 0, 3)
    wrong = [
        PointLights(p + 0.02 * room.diagonal * first * [1, 0, 0], I),
        PointLights(p, I * (1 + 0.06 * first)),
        PointLights(np.append(p, p[:1] + 0.5, axis=0), np.append(I, I[:1], axis=0)),
        PointLights(p[1:], I[1:]),
        PointLights(np.zeros((0, 3)), np.zeros((0, 1))),
    ]
    outcomes = [study.judged("lights-3-ours-000", room, lights, 1.0) for lights in wrong]
    assert not any(answer.solved for answer in outcomes)
    assert [answer.missed for answer in outcomes] == [0, 0, 0, 1, 3]
    assert outcomes[0].position == pytest.approx(2.0)
    assert outcomes[1].intensity == pytest.approx(6.0)


def test_one_scene_from_its_name(short):
    """`one` runs the rival that the name says, on the room that it says."""
    answer = study.one("lights-1-random-000")
    assert (answer.room, answer.lights, answer.solved) == ("box_one", 1, True)
    assert answer.seconds > 0


# the table


def test_the_table_and_what_is_said_of_it():
    """Rates by row, and by rival over all rows, from outcomes made by hand."""
    names = study.names(2)
    assert len(names) == len(set(names)) == 2 * len(study.COUNTS) * len(rivals.RIVALS)
    right = study.Outcome("", "box_one", 1, 1, 0, 0, 0.01, 0.1, True, 2.0)
    wrong = replace(right, solved=False, position=None, intensity=None, missed=1, seconds=4.0)
    ended = {}
    for name in names:
        good = "-ours-" in name or ("-grid-" in name and name.endswith("0"))
        record = asdict(replace(right if good else wrong, name=name))
        ended[name] = Ended(name, "print", 1.0, record)
    rows = tabulate(study.STUDY, names, ended)
    cells = {row.name: row for row in rows}
    assert cells["lights-2-ours"].cell("Solved").value == 1.0
    assert cells["lights-2-grid"].cell("Solved").value == 0.5
    assert cells["lights-2-grid"].cell("Median (s)").value == 3.0
    assert cells["lights-2-adam"].cell("Missed").value == 2
    assert cells["lights-2-adam"].cell("Position (%)").value is None
    n = 2 * len(study.COUNTS)
    assert study.said(rows) == (
        f"Solved: lightloc {n} of {n}, Random starts, LM 0 of {n}, "
        f"NNLS on a grid {n // 2} of {n}, Mitsuba and Adam 0 of {n}."
    )
    assert study.said(rows) in " ".join(outcome(study.STUDY, rows))
    drawn = study.curve(rows, list(ended.values()))
    assert [line.y[0] for line in drawn.lines] == [1.0, 0.0, 0.5, 0.0]
    doubts = [study.doubt(scene.record) for scene in ended.values()]
    assert not any(doubts)
    assert study.doubt(asdict(replace(wrong, name="lights-1-ours-000"))) == "not solved"


def test_a_crash_counts_as_not_solved():
    name = "lights-1-adam-000"
    crashed = Ended(name, "print", 1.0, None, "it raised")
    (row,) = tabulate(study.STUDY, [name], {name: crashed})
    assert row.cell("Solved").value == 0.0
