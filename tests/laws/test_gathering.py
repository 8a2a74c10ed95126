"""Indirect light gathered by rays: the error that it states is what another seed changes."""

from __future__ import annotations

import numpy as np
import pytest

import render
from lightloc import Observations, localize
from lightloc.interreflection import footnote_1
from lightloc.interreflection.choice import coverage
from lightloc.interreflection.footnote_1 import GROUPS, indirect

POINTS = 600


def test_the_error_of_gathering_is_what_another_seed_changes(load):
    """Rays of two seeds differ, and by no more than the errors that both state.

    Each error is measured over groups that share the strata of the hemisphere among them: all
    rays together are spread more evenly, so that it is too large rather than too small. A root
    of a mean square over so many points is known to 1 / sqrt(2 n).
    """
    room = load("box_three")
    seen = render.observe(room, points=POINTS, spp=64, seed=2)
    (one, error), (other, too) = (indirect(seen, room.geometry, seed) for seed in (1, 2))
    changed = np.sqrt(np.square(one - other).mean())
    stated = np.sqrt((np.square(error) + np.square(too)).mean())
    assert 0 < changed < (1 + 4 / np.sqrt(2 * POINTS)) * stated
    again, _ = indirect(seen, room.geometry, 1)
    np.testing.assert_array_equal(again, one)


def test_the_error_of_gathering_is_that_of_a_mean_of_groups(load, monkeypatch):
    """Groups that scatter by 1 have a mean that scatters by 1 / sqrt(8), and the error says so.

    A mean of n variances of eight values each is known to sqrt(2 / (7 n)).
    """
    room = load("box_three")
    seen = render.observe(room, points=POINTS, spp=2, seed=2)
    rng = np.random.default_rng(6)

    def gathered(columns, channels, s, cache, geometry, first, count, seed, strata):
        return 5 + rng.normal(size=(count * GROUPS, 1))

    monkeypatch.setattr(footnote_1, "_gather", gathered)
    mean, error = indirect(seen, room.geometry)
    known = 4 * np.sqrt(2 / (GROUPS - 1) / POINTS)
    assert abs(GROUPS * np.square(error).mean() - 1) < known
    assert abs(GROUPS * mean.var() - 1) < 4 * np.sqrt(2 / POINTS)


SHELF = """<scene version="3.0.0">
<bsdf type="twosided" id="paint"><bsdf type="diffuse">
<spectrum name="reflectance" value="0.5"/></bsdf></bsdf>
<shape type="cube" id="room"><transform name="to_world">
<scale x="2" y="1.5" z="1.25"/><translate x="2" y="1.5" z="1.25"/></transform>
<ref id="paint"/></shape>
<emitter type="point" id="lamp"><point name="position" x="1.1" y="1.2" z="2.1"/>
<rgb name="intensity" value="20"/></emitter>
<shape type="rectangle" id="window"><transform name="to_world"><scale x="0.5" y="0.4"/>
<rotate y="1" angle="90"/><translate x="0.01" y="1.5" z="1.5"/></transform>
<emitter type="area"><rgb name="radiance" value="0.001"/></emitter></shape></scene>"""


@pytest.fixture(scope="module")
def window(tmp_path_factory) -> tuple[render.Room, Observations]:
    """A room with a black window, which is no observation, a centimetre before a wall."""
    path = tmp_path_factory.mktemp("window") / "room.xml"
    path.write_text(SHELF)
    room = render.load(path, unit="m")
    return room, render.observe(room, points=2000, spp=256, seed=1)


def test_a_window_before_a_wall_is_not_told_by_the_wall(window):
    """Its neighbours all lie in one plane, and it does not: nothing is told of it."""
    q = window[1]
    cache, along = footnote_1.RadianceCache.of(q), np.array([[-1.0, 0, 0]])
    middle, beside = np.array([[0.01, 1.1, 1.2]]), np.array([[0.0, 0.5, 0.4]])
    assert not footnote_1.is_told(q, cache, middle, along).any()
    assert footnote_1.is_told(q, cache, beside, along).all()


def test_a_curved_surface_is_told_by_its_own(load):
    """All of a sphere, whose neighbours are off each other's planes."""
    room = load("sphere")
    q = render.observe(room, points=800, seed=0)
    assert coverage(q, room.geometry) > 0.99


@pytest.mark.parametrize("slip", [None, footnote_1.FLATNESS])
def test_light_of_what_is_not_observed_is_in_the_errors(window, monkeypatch, slip):
    """A light is within its stated errors; it is not where the wall is taken for the window."""
    room, q = window
    if slip is not None:
        monkeypatch.setattr(footnote_1, "SLIP", slip)
    found = localize(q, room.geometry, indirect="gathered")
    off = np.abs(found.lights.intensities - 20) / found.intensity_error
    assert len(found.lights) == 1
    assert (off.max() < 4) == (slip is None)
