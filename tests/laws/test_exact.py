"""Exact data: lights that leave nothing are found, and what can't come there is left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Options, PointLights, localize
from lightloc.backend import one_blas_thread
from lightloc.fit.criterion import Criterion
from lightloc.fit.levenberg import Descents
from lightloc.fit.noise import level_of
from lightloc.search import exact
from lightloc.search.exact import NOTHING, emptied
from lightloc.search.ground import Ground
from lightloc.search.ladder import Ladder
from lightloc.search.moves import HOPELESS
from lightloc.search.polish import sharpened
from validation.rooms.plane import rooms

LIGHTS = 12
ROUNDED = 2.0**-24  # relative, of B in 32 bits


@pytest.fixture(autouse=True)
def single():
    """As in `localize`: small products on one thread."""
    with one_blas_thread():
        yield


@pytest.fixture(scope="module")
def room():
    return rooms(LIGHTS, count=1)[0]


def answered(room, radiance, kept: list[int]):
    """A ladder whose best answer has only some of a room's lights, refined."""
    q, o = room.observe().with_radiance(radiance, 0.0), Options()
    ground = Ground.of(q, None, q.bounds, o, 0)
    view = ground.view(ground.whole, o, Criterion.of(o))
    lights = PointLights(room.lights.positions[kept], room.lights.intensities[kept])
    fit = sharpened(view.tight, Descents.at(lights), view.criterion)
    return Ladder.on(view).with_("start", fit), ground.whole


@pytest.mark.slow
def test_lights_that_are_missing_are_exchanged_for(room):
    """Two of twelve lights missing, the others having taken their part: all come exactly."""
    ladder, whole = answered(room, room.observe().radiance, list(range(2, LIGHTS)))
    there, surer = emptied(ladder, whole)
    found = there.best.lights
    assert len(found) == LIGHTS
    apart = np.linalg.norm(found.positions[:, None] - room.lights.positions, axis=2)
    assert apart.min(axis=0).max() < 1e-7
    np.testing.assert_allclose(surer.sigma, NOTHING * whole.sigma)
    assert there.history[-1].action == "empty"


def test_a_light_too_many_is_dropped(room):
    """A right answer and a ghost: nothing is left with it or without."""
    ladder, whole = answered(room, room.observe().radiance, list(range(LIGHTS)))
    ghost = PointLights(
        np.append(ladder.best.lights.positions, [[0.5, 0.5, 0.0]], axis=0),
        np.append(ladder.best.lights.intensities, [[1e-9]], axis=0),
    )
    fit = sharpened(ladder.view.tight, Descents.at(ghost), ladder.view.criterion)
    there, _ = emptied(Ladder.on(ladder.view).with_("start", fit), whole)
    assert len(there.best) == LIGHTS


@pytest.mark.slow
@pytest.mark.parametrize("off", ["rounded", "smooth"])
def test_what_can_not_come_to_nothing_is_left_alone(room, off):
    """B in 32 bits, or of a model that is a little different: no light is added, no error told."""
    q = room.observe()
    if off == "rounded":
        B = q.radiance.astype(np.float32).astype(float)
        assert np.abs(B / q.radiance - 1).max() > ROUNDED / 4
    else:
        B = q.radiance * (1 + 3e-7 * np.sin(7 * q.positions[:, :1]))
    ladder, whole = answered(room, B, list(range(LIGHTS)))
    there, same = emptied(ladder, whole)
    assert there is ladder
    assert same is whole


def test_exchanges_begin_where_little_is_left(room, monkeypatch):
    """From eleven of twelve lights; from one of them, which leaves all the others', never."""
    ladder, whole = answered(room, room.observe().radiance, list(range(1, LIGHTS)))
    few, _ = answered(room, room.observe().radiance, [0])
    assert level_of(few.best.residual) > HOPELESS > level_of(ladder.best.residual)
    begun = []
    monkeypatch.setattr(exact, "exchanged", lambda view, one: begun.append(one) or one)
    assert emptied(ladder.with_("start", few.best), whole)[1] is whole
    assert [one.positions.shape[1] for one in begun] == [LIGHTS - 1]
    fed = replace(ladder.with_("start", few.best), best=few.best)  # eleven feed an error
    assert emptied(fed, whole)[0] is fed
    assert len(begun) == 1


def test_without_exchanges_the_missing_stay_so(room, monkeypatch):
    """Negative control: refining alone does not bring two lights back."""
    monkeypatch.setattr(exact, "PLACES", 0)
    ladder, whole = answered(room, room.observe().radiance, list(range(2, LIGHTS)))
    assert emptied(ladder, whole)[0] is ladder


def test_errors_are_those_of_what_was_reached():
    """Three lights: a standard error a hundred thousandth of that of the same B in 32 bits."""
    q = rooms(3, count=1)[0].observe()
    rounded = q.with_radiance(q.radiance.astype(np.float32).astype(float), 0.0)
    fine, coarse = (localize(one).position_error for one in (q, rounded))
    np.testing.assert_allclose(fine, NOTHING * coarse, rtol=1e-3)
