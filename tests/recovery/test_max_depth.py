"""Pictures whose paths end early: what they lack is not subtracted, as what they hold is.

Rationale: most renderers end paths after a few bounces, and light that is missing looks like lights
that are weaker. Set-up: a room seen by its own camera with Mitsuba's path integrator, with light
that has bounced once. Expected: lights within four standard errors where the length of the paths is
known, from the scene's integrator or as it is told; far outside where it is not (the control).
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

import render
from lightloc import Observations, Reason, Way, localize, remove_indirect
from render.variant import two_threads
from validation import compare

DEPTH = 3
SURE = 4.0
SCENE = (
    '<scene version="3.0.0">INTEGRATOR<sensor type="perspective"><transform name="to_world">'
    '<lookat origin="0 0 3" target="0 0 0" up="0 1 0"/></transform><film type="hdrfilm"><integer '
    'name="width" value="16"/><integer name="height" value="16"/></film></sensor><shape '
    'type="rectangle"/><emitter type="point"><point name="position" x="0" y="0" z="1"/>'
    "</emitter></scene>"
)


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """Two lights before a camera of 96 x 72 pixels, whose integrator ends paths."""
    small = render.files_of("box_two")[0].read_text()
    file = tmp_path_factory.mktemp("rooms") / "room.xml"
    file.write_text(small.replace('"320"', '"96"').replace('"240"', '"72"'))
    return render.load(file, max_depth=DEPTH)


@pytest.fixture(scope="module")
def picture(room, tmp_path_factory):
    path = mi.load_dict({"type": "path", "max_depth": DEPTH})
    mi.render(room.scene, integrator=path, spp=256, seed=1)
    file = tmp_path_factory.mktemp("pictures") / "picture.exr"
    with two_threads():
        room.scene.sensors()[0].film().write(str(file))
    return file


def off(found, lights) -> float:
    """The most standard errors by which a light that was found is off."""
    pairs = compare(found.lights, lights).pairs
    assert len(pairs) == len(lights)
    i, k = [pair.found for pair in pairs], [pair.true for pair in pairs]
    apart = (found.lights.positions[i] - lights.positions[k]) / found.position_error[i]
    more = (found.lights.intensities[i] - lights.intensities[k]) / found.intensity_error[i]
    return float(max(np.abs(apart).max(), np.abs(more).max()))


def test_the_scene_says_where_paths_end(room, picture):
    """And the answer says that it was heard."""
    seen = render.observe_picture(picture, room)
    assert (room.max_depth, seen.max_depth) == (DEPTH, DEPTH)
    found = localize(seen, room.geometry)
    assert found.reason is Reason.CONVERGED and found.way is Way.RENDERED
    assert "hold no paths longer than 3" in str(found)
    assert off(found, room.lights) < SURE


def test_light_that_is_missing_makes_lights_weaker(room, picture):
    """The control: taken for all light, the picture is explained otherwise, or not."""
    seen = render.observe_picture(picture, room, max_depth=-1)
    assert seen.max_depth is None
    found = localize(seen, room.geometry)
    assert found.reason is not Reason.CONVERGED or off(found, room.lights) > 2 * SURE


def test_a_length_of_two_is_direct_light(room, picture, refuses):
    seen = render.observe_picture(picture, room, max_depth=2)
    assert not seen.interreflected and seen.max_depth is None
    for wrong in (1, 0, -2, 2.5, True):
        with refuses(f"max_depth is {wrong}; expected a whole number of at least 2"):
            render.observe_picture(picture, room, max_depth=wrong)


def test_what_is_said_of_transport_and_length(picture, tmp_path):
    """Both by the caller; by the scene, where nobody else says; a view of ours has no end."""
    one = SCENE.replace("INTEGRATOR", '<integrator type="direct"/>')
    (tmp_path / "room.xml").write_text(one)
    direct = render.load(tmp_path / "room.xml")
    view = tmp_path / "view.exr"
    render.write_exr(render.photograph(direct, width=16, height=16, spp=4), view)
    seen = render.observe_picture(view, direct)
    assert seen.interreflected and seen.max_depth is None
    render.write_exr(render.photograph(direct, width=16, height=16, transport="direct"), view)
    assert not render.observe_picture(view, direct).interreflected
    assert not render.observe_picture(view, replace(direct, max_depth=None)).interreflected
    other = tmp_path / "other.exr"
    with two_threads():
        mi.Bitmap(np.ones((16, 16, 3), np.float32)).write(str(other))
    for asked, interreflected, length in (
        ({}, False, None),
        ({"transport": "full"}, True, None),
        ({"transport": "full", "max_depth": 2}, False, None),
        ({"max_depth": 4}, True, 4),
        ({"max_depth": -1}, True, None),
        ({"transport": "direct", "max_depth": 4}, False, None),
    ):
        seen = render.observe_picture(other, direct, **asked)
        assert (seen.interreflected, seen.max_depth) == (interreflected, length), asked


def test_measured_again_paths_are_as_long(room):
    """`remeasure` renders what the observations hold."""
    seen = render.observe(room, points=200, spp=64, transport="full", seed=2)
    ended = render.remeasure(room, replace(seen, max_depth=3), spp=64, seed=2)
    known = render.remeasure(room, replace(seen, interreflected=False))
    H, _ = room.geometry.interreflection(room.lights.positions, replace(seen, max_depth=3), 256)
    expected = known.radiance + np.einsum("nkc,kc->nc", H, room.lights.intensities)
    assert ended.radiance.sum() == pytest.approx(expected.sum(), rel=0.01)
    assert ended.radiance.sum() < 0.9 * seen.radiance.sum()


def test_it_is_kept_and_forbids_to_gather(room, tmp_path, refuses):
    """Footnote 1 gathers from radiance that bounced as often as what it is gathered for."""
    seen = render.observe(room, points=64, spp=16, transport="full")
    q = replace(seen, max_depth=5)
    q.save(tmp_path / "seen.npz")
    assert Observations.load(tmp_path / "seen.npz").max_depth == 5
    assert q.at([1, 2]).max_depth == 5
    seen.save(tmp_path / "seen.npz")
    assert Observations.load(tmp_path / "seen.npz").max_depth is None
    with refuses("footnote 1 would gather longer paths"):
        remove_indirect(q, room.geometry)
    bare = SimpleNamespace(visible=room.geometry.visible, intersect=room.geometry.intersect)
    with refuses("footnote 1 would gather longer paths"):
        localize(q, bare)
    with refuses("Observations.max_depth is 1; expected"):
        replace(seen, max_depth=1)


@pytest.mark.parametrize(
    ("integrator", "depth"),
    [
        ('<integrator type="path"><integer name="max_depth" value="5"/></integrator>', 5),
        ('<integrator type="path"/>', None),
        ('<integrator type="direct"/>', 2),
        ('<integrator type="prb"/>', 6),
        (
            '<integrator type="direct_projective"><integer name="max_depth" value="7"/>'
            "</integrator>",
            2,
        ),
        ("", None),
        (
            '<integrator type="aov"><string name="aovs" value="p:position"/><integrator '
            'type="path"><integer name="max_depth" value="7"/></integrator></integrator>',
            7,
        ),
        ('<integrator type="bdpt"><integer name="max_depth" value="6"/></integrator>', 6),
    ],
)
def test_integrators(integrator, depth, tmp_path):
    """Also one within another, and one that this Mitsuba does not have."""
    file = tmp_path / "room.xml"
    file.write_text(SCENE.replace("INTEGRATOR", integrator))
    assert render.load(file).max_depth == depth
