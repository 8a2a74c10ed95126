"""A budget of time: an answer whenever it ends, which says so, and the same one where it suffices.

The clock is ours: each look at it is a tick, so that a budget of so many ticks ends at the same
place on every machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

import render
from lightloc import Kind, Observations, Reason, localize
from lightloc.deadline import is_over, left, within
from lightloc.localize import concluding

ENDS = (1, 4, 12, 40, 120)
"""Ticks that a search is given."""


@pytest.fixture
def ticks(monkeypatch) -> Iterator[Callable[[], int]]:
    """How many looks at the clock there were; each is a second."""
    count = 0

    def tick() -> float:
        nonlocal count
        count += 1
        return float(count)

    monkeypatch.setattr("time.monotonic", tick)
    yield lambda: count


@pytest.fixture(scope="module")
def occluder(load: Callable[..., render.Room]) -> render.Room:
    return load("box_occluder")


@pytest.fixture(scope="module")
def direct(occluder) -> Observations:
    return render.observe(occluder, points=800, seed=3, transport="direct", noise=0.01)


@pytest.fixture(scope="module")
def metal(load) -> tuple[render.Room, Observations]:
    """A room whose interreflected light is rendered."""
    room = load("box_conductor", alpha=0.3)
    return room, render.observe(room, points=300, spp=64, seed=3, transport="full", noise=0.01)


def test_enough_time_changes_nothing(occluder, direct):
    """A budget that is not used up leaves the answer as it is, to the bit."""
    free = localize(direct, occluder.geometry)
    kept = localize(direct, occluder.geometry, seconds=1e6)
    assert np.array_equal(kept.lights.positions, free.lights.positions)
    assert np.array_equal(kept.covariance, free.covariance)
    assert kept.reason is free.reason is Reason.CONVERGED


@pytest.mark.parametrize("end", ENDS)
def test_an_answer_whenever_time_is_up(occluder, direct, ticks, end):
    """Lights within the room, as many errors as lights, and the reason; nothing is raised."""
    found = localize(direct, occluder.geometry, seconds=end)
    assert found.reason is Reason.OUT_OF_TIME
    assert found.position_error.shape == (len(found.lights), 3)
    low, high = occluder.bounds
    assert ((found.lights.positions >= low) & (found.lights.positions <= high)).all()
    assert "time was up" in str(found) and found.possible == ()
    assert ticks() < end + 60  # what was begun is brought to its end, and nothing else is begun


def test_more_time_explains_more(occluder, direct, ticks):
    """Chi-square falls from the first end to the last, where all is explained."""
    chi2 = [localize(direct, occluder.geometry, seconds=end).chi2 for end in (ENDS[0], 10_000)]
    assert chi2[0] > 100 > 2 > chi2[1]


def test_what_is_not_explained_yet_is_said_to_change(occluder, direct, ticks):
    """In place of the sentence that the model is wrong, which nobody knows then."""
    found = localize(direct, occluder.geometry, seconds=ENDS[0])
    said = [v.sentence for v in found.verdicts if v.kind is Kind.UNEXPLAINED]
    assert len(said) == 1 and said[0].startswith("Chi-square is still ")
    unknown = direct.with_radiance(direct.radiance, None)
    for end in ENDS:
        said = [v.sentence for v in localize(unknown, occluder.geometry, seconds=end).verdicts]
        assert not any("nan" in sentence or "still 0" in sentence for sentence in said)


@pytest.mark.parametrize("end", ENDS)
def test_rendering_ends_in_time_too(metal, ticks, end):
    """An answer at each end, also between the renderings of two lights."""
    room, q = metal
    found = localize(q, room.geometry, seconds=end)
    assert found.reason is Reason.OUT_OF_TIME
    assert np.isfinite(found.lights.positions).all()
    rendered = any(step.turn for step in found.history)
    assert ("rendered for the lights found" in str(found)) == rendered


@pytest.mark.parametrize("noise", ["scaled", "estimate"])
def test_unknown_noise_ends_in_time_too(occluder, direct, ticks, noise):
    from lightloc import Options

    found = localize(direct, occluder.geometry, options=Options(noise=noise), seconds=20)
    assert found.reason is Reason.OUT_OF_TIME


def test_short_of_time_footnote_1_gathers_with_fewer_rays(load):
    """And says that it is less sure of what it removed."""
    from lightloc import remove_indirect

    room = load("box_two")
    q = render.observe(room, points=300, spp=64, seed=1)
    whole = remove_indirect(q, room.geometry)
    with within(1e-3):
        short = remove_indirect(q, room.geometry)
    assert np.median(short.known_sigma) > 1.02 * np.median(whole.known_sigma)
    off = (short.radiance - whole.radiance) / short.known_sigma
    assert np.sqrt(np.mean(np.square(off))) < 2


def test_deadlines_nest_and_end():
    """The earlier one holds, and outside of all there is none."""
    with within(1e6):
        with within(1e9):
            assert left() < 1e6 + 1
        with within(0.0):
            assert is_over()
        assert not is_over()
    assert np.isinf(left())


def test_no_time_is_refused(occluder, direct, refuses):
    for seconds in (0, -1, float("nan")):
        with refuses("seconds is"):
            localize(direct, occluder.geometry, seconds=seconds)
    with refuses("observations are a float"):
        localize(1.0, seconds=1)


def test_a_budget_keeps_time_to_conclude():
    """As much as it takes with so many observations; at least a share, and half at most."""
    assert concluding(1, 4000) == pytest.approx(0.34)
    assert concluding(100, 4000) == pytest.approx(15)
    assert concluding(0.1, 4000) == concluding(0.1, 10**6) == 0.05
