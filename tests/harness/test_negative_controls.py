"""The suite has power: what is wrong fails, by the very functions that judge its cases."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lightloc import Observations, PointLights, localize
from render import relight
from render.room import Room
from validation.judge.match import compare
from validation.suite.case import rerender, shortfalls
from validation.suite.cases import Case
from validation.suite.solve import observe

POINTS = 1500
FEW = 500  # where a search that can't succeed goes to the end of its options
EXPLAINED = 1.1  # z_std of a re-render that agrees


def row(scene: str, **more: Any) -> Case:
    """A gated row with the limits of the standard suite's exact cases."""
    common = {"name": "control", "claim": "A control.", "brdf": "diffuse", "seed": 1}
    limits = {"position_percent": 0.1, "intensity_percent": 0.5}
    return Case(**{**common, **limits, "scene": scene, "points": POINTS, **more})


def judge(case: Case, room: Room, seen: Observations, geometry: Any) -> list[str]:
    """What `run_case` would say in result.json under "why"."""
    found = localize(seen, geometry, seed=case.seed)
    return shortfalls(case, compare(found.lights, room.lights, room.diagonal), found)


def rebuilt(seen: Observations, **changes: Any) -> Observations:
    """Observations with fields replaced, checked anew."""
    kept = {field.name: getattr(seen, field.name) for field in dataclasses.fields(seen)}
    return Observations(**{**kept, **changes})


@pytest.fixture(scope="module")
def control(load):
    """(case, room, observations, found lights) of a case that passes."""
    case, room = row("box_two"), load("box_two")
    seen = observe(case, room, case.seed)
    return case, room, seen, localize(seen, room.geometry, seed=case.seed).lights


def test_control_passes(control):
    """Untouched, the case passes: what fails below fails for its own reason."""
    case, room, _, found = control
    assert shortfalls(case, compare(found, room.lights, room.diagonal)) == []


def test_light_moved_by_a_hand_fails(control):
    """A truth with one light 10 cm elsewhere is told from the found one, by position alone."""
    case, room, _, found = control
    for i in range(len(room.lights)):
        positions = room.lights.positions.copy()
        positions[i, 0] += 0.1
        wrong = PointLights(positions, room.lights.intensities)
        (why,) = shortfalls(case, compare(found, wrong, room.diagonal))
        assert "position" in why


def test_intensity_off_by_a_tenth_fails(control):
    """A truth with one light a tenth brighter or darker fails by intensity alone."""
    case, room, _, found = control
    for i in range(len(room.lights)):
        for factor in (0.9, 1.1):
            intensities = room.lights.intensities.copy()
            intensities[i] *= factor
            wrong = PointLights(room.lights.positions, intensities)
            (why,) = shortfalls(case, compare(found, wrong, room.diagonal))
            assert "intensity" in why


def test_light_left_out_or_added_fails(control):
    """A light too few or too many fails, however near the others are."""
    case, room, _, found = control
    one = PointLights(found.positions[:1], found.intensities[:1])
    why = shortfalls(case, compare(one, room.lights, room.diagonal))
    assert any("missed" in sentence for sentence in why)
    why = shortfalls(case, compare(found, one, room.diagonal))
    assert any("no true light" in sentence for sentence in why)


def test_flipped_normals_fail(control):
    """Seen from behind, nothing can be lit: the case fails, and the search still ends."""
    case, room, seen, _ = control
    assert judge(case, room, rebuilt(seen, normals=-seen.normals), room.geometry)


@pytest.mark.parametrize("scene", ["box_conductor", "box_plastic"])
def test_wrong_alpha_fails(scene, load):
    """With alpha 0.3 in place of the room's 0.2 the case fails; with 0.2 it passes."""
    case = row(scene, parameters={"alpha": 0.2}, points=FEW)
    room = load(scene, alpha=0.2)
    brightest = room.lights.brightest_first()
    room = relight(room, PointLights(brightest.positions[:1], brightest.intensities[:1]))
    seen = observe(case, room, case.seed)
    wrong = rebuilt(seen, material=dataclasses.replace(seen.material, alpha=0.3))
    assert judge(case, room, seen, room.geometry) == []
    assert judge(case, room, wrong, room.geometry)


def test_occluder_left_out_fails(load):
    """A pillar and a table that the search doesn't know of make the case fail."""
    case, room = row("box_occluder"), load("box_occluder")
    seen = observe(case, room, case.seed)
    assert judge(case, room, seen, room.geometry) == []
    assert judge(case, room, seen, None)


def test_rerender_tells_wrong_lights(load):
    """Under 1 % noise the true lights' re-render is at the noise; a moved light's is not.

    z_std of the truth is 1 within the scatter of a standard deviation over n observations,
    1 / sqrt(2 n), at 4 of them.
    """
    case, room = row("box_two", noise=0.01), load("box_two")
    seen = observe(case, room, case.seed)
    p, intensity = room.lights.positions, room.lights.intensities
    shift, tenth = np.array([[0.1, 0, 0], [0, 0, 0]]), np.array([[1.1], [1.0]])
    spread = {
        name: rerender(case, room, seen, lights).z_std
        for name, lights in (
            ("true", room.lights),
            ("moved", PointLights(p + shift, intensity)),
            ("brighter", PointLights(p, intensity * tenth)),
        )
    }
    assert abs(spread["true"] - 1) < 4 / np.sqrt(2 * POINTS)
    assert spread["moved"] > 2 * EXPLAINED
    assert spread["brighter"] > 2 * EXPLAINED


def test_rerender_of_nothing_says_nothing(control):
    """Where no light was found there is no re-render to judge."""
    case, room, seen, _ = control
    assert rerender(case, room, seen, PointLights([], np.zeros((0, 1)))) is None
