"""A slice of the strangers' scenes, and that their judge sees what is wrong.

All of them, in all variants: ``make strangers``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from strangers import SCENES
from strangers.reference import whole_file
from strangers.trial import Effort, right, standing, tried
from strangers.world import VARIANTS, World

import render
from lightloc import localize
from validation import compare

FEW = Effort(points=250, spp=64, reference=256, searched=500)
FINE = Effort(points=600)  # what a promise of 0.1 in the mean needs
CHEAP = {  # some scenes, and the variant that each is tried in
    "parts": "unit",
    "partition": "handedness",
    "one_sided_mesh": "order",
    "sun": "handedness",
    "one_by_name": "unit",
}
REFUSED = [name for name, one in SCENES.items() if one.refused]


def test_there_are_fifty_of_all_kinds():
    assert len(SCENES) >= 50
    assert {one.kind for one in SCENES.values()} >= {"versions", "instances", "units", "sides"}
    assert {one.kind for one in SCENES.values()} >= {"emitters", "cameras", "looks", "refusals"}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_are_true(name):
    for variant, world in VARIANTS.items():
        row = tried(SCENES[name], variant, world)
        assert row.sentence and not row.broken, row


@pytest.mark.parametrize("name", CHEAP)
def test_what_loads_is_right(name):
    """B is the whole file's by Mitsuba's own path integrator, and the lights are found."""
    row = tried(SCENES[name], CHEAP[name], VARIANTS[CHEAP[name]], FEW)
    assert not row.broken, row
    assert len(row.z) >= FEW.points / 2
    assert abs(row.z.mean()) < 4 / np.sqrt(FEW.points) + 0.1
    assert 0.8 < row.z.std() < 1.2


@pytest.fixture
def changed(tmp_path) -> Callable[..., tuple[np.ndarray, bool]]:
    """z of a scene whose file was changed after it was loaded."""

    def judged(name: str, before: str, after: str) -> tuple[np.ndarray, bool]:
        path = SCENES[name].into(tmp_path, World())
        room = render.load(path)
        text = path.read_text()
        assert text.count(before) == 1
        path.write_text(text.replace(before, after))
        return standing(room, whole_file(path, {})[0], 0, FINE)

    return judged


WRONG = {
    "nothing": ("partition", 'version="3.0.0"', 'version="3.1.0"'),
    "a light 3 % brighter": ("partition", 'intensity" value="3.0"', 'intensity" value="3.09"'),
    "a wall that is not there": ("partition", '<scale x="0.9" y="1.2"', '<scale x="0.1" y="0.1"'),
    "a normal turned": ("one_sided_room", '<rotate x="1" angle="180.0"/>', ""),
    "another paint": ("one_sided_mesh", 'value="0.5"', 'value="0.51"'),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_the_judge_sees_it(wrong, changed):
    z, exact = changed(*WRONG[wrong])
    standard = abs(z.mean()) < 4 / np.sqrt(FINE.points) and 0.85 < z.std() < 1.15
    assert (standard and exact) == (wrong == "nothing"), (z.mean(), z.std(), exact)


def test_lights_that_are_wrong_are_seen():
    """A centimetre, or a light more."""
    room = render.load("box_two")
    found = localize(render.observe(room, points=300, transport="direct"), room.geometry)
    assert right(found, room.lights, room.diagonal)
    moved = room.lights.positions + np.array([[0.01, 0, 0], [0, 0, 0]])
    assert not right(found, type(room.lights)(moved, room.lights.intensities), room.diagonal)
    one = type(room.lights)(room.lights.positions[:1], room.lights.intensities[:1])
    assert not right(found, one, room.diagonal)
    assert not compare(found.lights, one, room.diagonal).count_right
