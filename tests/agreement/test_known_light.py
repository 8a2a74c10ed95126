"""Light that is not to be found: rendered alone, and subtracted with its error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import render
from lightloc import Assumption, Irradiance, Reason, localize, remove_known
from validation import compare

SPP = 128
BOX = """<shape type="cube" id="box"><transform name="to_world">
<scale x="2" y="1.5" z="1.25"/><translate x="2" y="1.5" z="1.25"/></transform>
<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>"""
HIDDEN = """<emitter type="point" id="lamp"><point name="position" value="1.2 2.1 1.9"/>
<rgb name="intensity" value="2"/></emitter>"""
SECOND = """<emitter type="point" id="second"><point name="position" value="3.1 0.8 1.1"/>
<rgb name="intensity" value="3"/></emitter>"""
FRAME = '<transform name="to_world"><scale value="0.4"/><rotate x="1" angle="180"/>'
PLACE = '<translate value="2.5 1 2.4"/></transform>'
AIM = '<transform name="to_world"><lookat origin="3 2 2.3" target="1 1 0" up="0 0 1"/></transform>'
OTHER = {
    "area": f'<shape type="rectangle" id="panel">{FRAME}{PLACE}<emitter type="area">'
    '<rgb name="radiance" value="3"/></emitter></shape>',
    "spot": f'<emitter type="spot">{AIM}<rgb name="intensity" value="4"/></emitter>',
    "projector": f'<emitter type="projector">{AIM}<float name="fov" value="50"/></emitter>',
    "constant": '<emitter type="constant"><rgb name="radiance" value="0.3"/></emitter>',
    "directional": '<emitter type="directional"><vector name="direction" value="0.2 0.1 -1"/>'
    '<rgb name="irradiance" value="1.5"/></emitter>',
}
OPEN = """<shape type="rectangle" id="floor"><transform name="to_world"><scale value="2"/>
<translate value="2 1.5 0"/></transform></shape>
<shape type="sphere" id="ball"><point name="center" value="2.2 1.2 0.5"/>
<float name="radius" value="0.5"/></shape>"""


@pytest.fixture
def write(tmp_path) -> Callable[..., Path]:
    def put(*parts: str) -> Path:
        path = tmp_path / "room.xml"
        path.write_text(f'<scene version="3.0.0">{"".join(parts)}</scene>')
        return path

    return put


def room_of(write: Callable[..., Path], kind: str) -> render.Room:
    """A closed box, or an open floor under what comes from far away."""
    far = kind in ("constant", "directional")
    return render.load(write(OPEN if far else BOX, HIDDEN, OTHER[kind]))


def by_mitsuba(path: Path, q, depth: int, spp: int = 512) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard error of Mitsuba's own path integrator on the whole file at q's points."""
    scene = mi.load_file(str(path))
    integrator = mi.load_dict({"type": "path", "max_depth": depth})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(5, len(q) * spp)
    lane = dr.arange(mi.UInt32, len(q) * spp) // spp
    start = q.positions + 1e-3 * q.directions
    ray = dr.gather(mi.Ray3f, mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(-q.directions.T)), lane)
    B = np.array(integrator.sample(scene, sampler, ray)[0][0]).reshape(len(q), spp)
    return B.mean(axis=1), B.std(axis=1) / np.sqrt(spp)


@pytest.mark.parametrize("transport", ["direct", "full"])
@pytest.mark.parametrize("kind", OTHER)
def test_what_is_observed_is_all_light(write, kind, transport):
    """B(q) is what Mitsuba renders of the whole file: its z-scores are standard normal."""
    room = room_of(write, kind)
    q = render.observe(room, points=300, spp=SPP, transport=transport)
    B, error = by_mitsuba(room.path, q, -1 if transport == "full" else 2)
    z = (q.radiance[:, 0] - B) / np.hypot(np.hypot(error, q.sigma[:, 0]), 1e-4 * B.mean())
    assert abs(z.mean()) < 4 / np.sqrt(len(q)) + 0.1
    assert 0.8 < z.std() < 1.2


@pytest.mark.parametrize("kind", OTHER)
def test_what_is_left_is_the_light_to_be_found(write, kind):
    """All light less the known light is that of a file without the known emitters."""
    room = room_of(write, kind)
    q = render.observe(room, points=400, spp=SPP, transport="full")
    left = remove_known(q, room.geometry, samples=SPP, seed=0)
    alone = render.remeasure(replace(room, known=None), q, spp=SPP, seed=9)
    z = (left.radiance - alone.radiance) / np.hypot(left.sigma, alone.sigma)
    assert abs(z.mean()) < 4 / np.sqrt(len(q)) + 0.1
    assert 0.8 < z.std() < 1.2
    assert (left.sigma > q.sigma).all()


def test_emitters_of_one_point_or_direction_are_exact(write):
    """Their direct light has no noise, so what is left of exact data is nearly exact."""
    for kind in ("spot", "projector", "directional"):
        room = room_of(write, kind)
        q = render.observe(room, points=200, transport="direct")
        assert not q.sigma.any()
        left = remove_known(q, room.geometry)
        alone = render.observe(replace(room, known=None), points=200, transport="direct")
        np.testing.assert_allclose(left.radiance, alone.radiance, atol=1e-6 * q.radiance.max())
        assert (left.sigma <= 1e-6 * q.radiance.max()).all()


@pytest.mark.parametrize("kind", ["area", "spot", "constant"])
def test_lights_are_found_beside_known_light(write, kind):
    """Right within its errors; where known light stays in, the answer says that it is no good."""
    room = room_of(write, kind)
    q = render.observe(room, points=800, spp=SPP, transport="direct")
    found = localize(q, room.geometry, seed=1)
    assert found.reason is Reason.CONVERGED
    assert Assumption.KNOWN_LIGHT in found.assumed
    assert len(found.lights) == 1
    off = found.lights.positions - room.lights.positions
    assert (np.abs(off) < 4 * found.position_error + 1e-5 * room.diagonal).all()
    if kind != "constant":  # it takes long to give up
        kept = localize(q, render.SceneGeometry(room.scene), seed=1)
        assert Assumption.KNOWN_LIGHT not in kept.assumed
        assert kept.reason is not Reason.CONVERGED or len(kept.lights) > 1


def test_point_lights_that_the_user_names_are_found(write):
    """The others are known light, in the observations and not in the truth."""
    path = write(BOX, HIDDEN, SECOND)
    room = render.load(path, find=["second"])
    assert room.lights.positions.tolist() == pytest.approx(np.array([[3.1, 0.8, 1.1]]))
    q = render.observe(room, points=500, transport="direct")
    both = render.observe(render.load(path), points=500, transport="direct")
    np.testing.assert_allclose(q.radiance, both.radiance, rtol=1e-6)
    found = localize(q, room.geometry)
    assert compare(found.lights, room.lights, room.diagonal).worst_position_percent < 1e-2
    assert len(render.load(path, find=[]).lights) == 0


@pytest.mark.parametrize(
    ("find", "said"),
    [
        (["third"], "has no point emitter 'third' (it has: lamp, second)"),
        ("second", "find is 'second'; expected 'point' or a list of ids"),
        ([2], "find is [2]; expected 'point' or a list of ids"),
    ],
)
def test_lights_that_are_not_there_are_refused(write, find, said):
    path = write(BOX, HIDDEN, SECOND)
    with pytest.raises(ValueError) as refused:
        render.load(path, find=find)
    assert str(refused.value) == f"{path}: {said}"


def test_a_room_without_lights_loads(write):
    """Nothing is hidden in it, and observations of someone else's can be searched with it."""
    room = render.load(write(BOX))
    assert len(room.lights) == 0
    assert room.known is None
    dark = render.observe(room, points=400, transport="full", spp=4)
    assert not dark.radiance.any()
    lit = render.remeasure(render.relight(room, render.load(write(BOX, HIDDEN)).lights), dark)
    found = localize(lit, room.geometry)
    assert found.lights.positions == pytest.approx(np.array([[1.2, 2.1, 1.9]]), abs=0.02)


def test_other_lights_leave_known_light_as_it_is(write):
    room = room_of(write, "area")
    q = render.observe(room, points=200, spp=SPP, transport="direct")
    off = render.relight(room, type(room.lights)(np.zeros((0, 3)), np.zeros((0, 1))))
    B, error = room.geometry.known_light(q, SPP, seed=3)
    left = render.remeasure(off, q, spp=SPP)
    z = (left.radiance - B) / np.hypot(np.hypot(left.sigma, error), 1e-4 * B.mean())
    assert 0.8 < z.std() < 1.2


def test_a_picture_holds_all_light_and_no_lamp_is_an_observation(write):
    """A camera's pixels are subtracted alike; those that show the lamp are not used."""
    eye = AIM.replace("3 2 2.3", "0.2 0.2 0.4").replace("1 1 0", "3 2 2.4")
    sensor = f'<sensor type="perspective"><float name="fov" value="90"/>{eye}</sensor>'
    room = render.load(write(BOX, HIDDEN, OTHER["area"], sensor))
    view = render.photograph(room, width=48, spp=SPP, transport="direct")
    panel = room.scene.shapes()[1]
    assert panel.id() == "panel"
    shown = view.shape == 1
    assert shown.sum() > 10
    assert not view.pure[shown].any()
    assert view.film[shown].mean() == pytest.approx(3.0, rel=0.1)
    found = localize(render.observe_view(view, room), room.geometry)
    assert compare(found.lights, room.lights, room.diagonal).worst_position_percent < 1


def test_one_channel_can_not_hold_coloured_light(write):
    room = render.load(write(BOX, HIDDEN, OTHER["spot"].replace('"4"', '"4 2 1"')))
    q = render.observe(room, points=50, transport="direct")
    assert q.channels == 3
    grey = replace(q, radiance=q.radiance[:, :1], sigma=q.sigma[:, :1])
    with pytest.raises(ValueError, match="known light has colours"):
        remove_known(grey, room.geometry)


@pytest.mark.parametrize("kind", OTHER)
def test_irradiance_is_what_lambert_reflects(write, kind):
    """Known radiance of a diffuse surface is albedo / pi times its known irradiance."""
    room = room_of(write, kind)
    q = replace(render.observe(room, points=300, spp=2), sigma=None)
    meters = replace(q, material=Irradiance())
    B, error = room.geometry.known_light(q, SPP, seed=1)
    E, own = room.geometry.known_light(meters, SPP, seed=2)
    share = q.material.albedo / np.pi
    z = (B - share * E) / np.hypot(np.hypot(error, share * own), 1e-4 * B.mean())
    assert abs(z.mean()) < 4 / np.sqrt(len(q)) + 0.1
    assert 0.8 < z.std() < 1.2


def test_a_camera_that_sees_the_sky_alone(write):
    """No pixel shows a surface; the picture is the sky's."""
    up = '<transform name="to_world"><lookat origin="2 1 3" target="2 1 9" up="0 1 0"/></transform>'
    room = render.load(
        write(OPEN, HIDDEN, OTHER["constant"], f'<sensor type="perspective">{up}</sensor>')
    )
    view = render.photograph(room, width=8, spp=4)
    assert not view.used.any()
    assert view.film == pytest.approx(0.3)
