"""Where surfaces are observed: on the side that light or a camera sees, and not on glass."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import render
from lightloc import Reason, localize
from validation import compare

GREY = '<bsdf type="diffuse"/>'
BOTH = f'<bsdf type="twosided">{GREY}</bsdf>'
NESTED = {
    "twosided": BOTH,
    "blend": f'<bsdf type="blendbsdf"><float name="weight" value="0.5"/>{BOTH}{BOTH}</bsdf>',
    "metal": '<bsdf type="twosided"><bsdf type="roughconductor">'
    '<float name="alpha" value="0.6"/></bsdf></bsdf>',
}


def cube(bsdf: str, size: float = 1.0, name: str = "cube") -> str:
    """A cube around the origin, its normals outward."""
    scale = f'<transform name="to_world"><scale value="{size}"/></transform>'
    return f'<shape type="cube" id="{name}">{scale}{bsdf}</shape>'


def wall(bsdf: str, z: float, size: float = 1.0, name: str = "wall") -> str:
    """A square that faces up."""
    place = f'<scale value="{size}"/><translate z="{z}"/>'
    place = f'<transform name="to_world">{place}</transform>'
    return f'<shape type="rectangle" id="{name}">{place}{bsdf}</shape>'


def lamp(x: float, y: float, z: float, power: float = 1.0) -> str:
    return (
        f'<emitter type="point"><point name="position" value="{x} {y} {z}"/>'
        f'<rgb name="intensity" value="{power}"/></emitter>'
    )


@pytest.fixture
def load(tmp_path) -> Callable[..., render.Room]:
    def put(*parts: str) -> render.Room:
        path: Path = tmp_path / "room.xml"
        path.write_text(f'<scene version="3.0.0">{"".join(parts)}</scene>')
        return render.load(path)

    return put


def inward(q) -> np.ndarray:
    return (q.normals * q.positions).sum(axis=1) < 0


@pytest.mark.parametrize("kind", NESTED)
def test_a_room_that_is_modelled_from_outside_is_seen_from_inside(load, kind):
    room = load(cube(NESTED[kind]), lamp(0.3, 0.2, 0.4))
    q = render.observe(room, points=300, transport="direct")
    assert inward(q).all()
    assert (q.radiance > 0).mean() > 0.95


def test_light_on_both_sides_is_seen_on_both(load):
    """A wall between two lit halves of a room is observed on either side, and both lights found."""
    room = load(cube(BOTH), wall(BOTH, 0.1), lamp(0.3, 0.2, 0.6), lamp(-0.4, 0.1, -0.5, 2.0))
    q = render.observe(room, points=1500, transport="direct")
    on = np.abs(q.positions[:, 2] - 0.1) < 1e-4
    on &= np.abs(q.normals[:, 2]) > 0.9
    above = q.normals[on, 2] > 0
    assert on.sum() > 150
    assert abs(above.mean() - 0.5) < 4 * 0.5 / np.sqrt(on.sum())
    assert (q.radiance[on] > 0).all()
    found = localize(q, room.geometry)
    assert found.reason is Reason.CONVERGED
    assert compare(found.lights, room.lights, room.diagonal).worst_position_percent < 0.1


def test_shadow_is_seen_from_the_lit_side(load):
    """A point that no light reaches is observed where it sees what light reaches."""
    blocker = wall(BOTH, 0.0, 0.4, "blocker")
    room = load(cube(BOTH), blocker, lamp(0.0, 0.0, 0.5))
    q = render.observe(room, points=1500, transport="direct")
    floor = q.positions[:, 2] < -0.999
    dark = floor & (q.radiance[:, 0] == 0)
    assert dark.sum() > 50
    assert inward(q)[dark].all()


def test_a_house_in_a_lit_yard_is_seen_from_both_sides(load):
    """Inside by its own lamp, outside by the other; nothing is dark that is lit."""
    room = load(cube(BOTH, 0.5, "house"), cube(BOTH, 2.0, "yard"), lamp(0, 0, 0.2), lamp(1, 1, 1))
    q = render.observe(room, points=800, transport="direct", shapes=["house"])
    inside = inward(q)
    assert 0.2 < inside.mean() < 0.8
    assert (q.radiance[inside] > 0).all()


def test_a_camera_decides_where_light_does_not(load):
    """A wall in the dark is observed from the side of the camera."""
    eye = (
        '<transform name="to_world"><lookat origin="0 0 -3" target="0 0 0" up="0 1 0"/></transform>'
    )
    sensor = f'<sensor type="perspective">{eye}</sensor>'
    q = render.observe(load(wall(BOTH, 0.0), sensor), points=100, transport="direct")
    assert (q.normals[:, 2] < 0).all()
    q = render.observe(load(wall(BOTH, 0.0)), points=100, transport="direct")
    assert len(set(np.sign(q.normals[:, 2]))) == 1


def test_the_front_alone_is_seen_where_the_back_reflects_nothing(load):
    """A room all of whose light falls on the backs of surfaces is black, and says why."""
    room = load(cube(GREY), lamp(0.3, 0.2, 0.4))
    with pytest.raises(ValueError, match="from behind, where it reflects nothing"):
        render.observe(room, points=100, transport="direct")
    outside = load(cube(GREY), lamp(0.3, 0.2, 0.4), lamp(0.3, 0.2, 2.0))
    q = render.observe(outside, points=100, transport="direct")
    assert not inward(q).any()
    dark = load(cube(GREY, 0.1, "bulb"), wall(GREY, -1.0), lamp(0, 0, 0))
    assert not render.observe(dark, points=50, transport="direct", shapes=["wall"]).radiance.any()


GLASS = {
    "dielectric": "is glass",
    "roughdielectric": "is glass",
    "conductor": "is a mirror",
    "principledthin": "is glass",
}


@pytest.mark.parametrize("kind", GLASS)
def test_glass_and_mirrors_are_left_out_and_named(load, kind):
    more = '<float name="spec_trans" value="0.5"/>' if kind == "principledthin" else ""
    pane = wall(f'<bsdf type="{kind}">{more}</bsdf>', -0.5, 0.3, "pane")
    room = load(cube(BOTH), pane, lamp(0.3, 0.2, 0.4))
    assert room.unobserved == {"shape 'pane'": GLASS[kind]}
    q = render.observe(room, points=500, transport="direct")
    assert not ((np.abs(q.positions[:, 2] + 0.5) < 1e-3) & (np.abs(q.normals[:, 2]) > 0.9)).any()
    with pytest.raises(ValueError, match=f"shape 'pane' {GLASS[kind]}; such shapes can't"):
        render.observe(room, points=10, shapes=["pane"])


def test_lamps_are_left_out_and_named(load):
    light = '<emitter type="area"><rgb name="radiance" value="1"/></emitter>'
    room = load(wall(BOTH, -1.0), wall(light, 1.0, 0.2, "panel"), lamp(0.3, 0.2, 0.4))
    assert room.unobserved == {"shape 'panel'": "emits light"}
    q = render.observe(room, points=200, transport="direct", spp=4)
    assert (q.positions[:, 2] < -0.999).all()


def test_what_is_observed_is_found_again(load):
    """A thousand rooms from the origin, where single precision has steps of a quarter millimetre.

    A view that passes an edge by rounding alone finds the next wall when it is measured again.
    """
    place = '<scale x="2" y="1.5" z="1.25"/><translate x="4002" y="-2998.5" z="1.25"/>'
    place = f'<transform name="to_world">{place}</transform>'
    room = load(f'<shape type="cube">{place}{BOTH}</shape>', lamp(4001.2, -2997.9, 1.9))
    q = render.observe(room, points=4000, seed=1, transport="direct")
    again = render.remeasure(room, q)
    assert (q.radiance > 0).all()
    np.testing.assert_allclose(again.radiance, q.radiance, rtol=0.02)


def test_the_back_of_what_stands_on_a_floor_is_not_its_floor(load):
    """Of two surfaces in one plane either may be met; one that is seen from behind is neither."""
    metal = '<bsdf type="roughconductor"/>'
    blend = f'<bsdf type="blendbsdf"><float name="weight" value="0.4"/>{GREY}{metal}</bsdf>'
    block = (
        '<shape type="cube"><transform name="to_world"><scale value="0.4"/>'
        f'<translate z="-0.6"/></transform>{blend}</shape>'
    )
    room = load(block, cube(BOTH), lamp(0.3, 0.2, 0.4))
    q = render.observe(room, points=2000, spp=64)
    floor = q.positions[:, 2] < -0.99
    below = floor & (np.abs(q.positions[:, :2]).max(axis=1) < 0.39)
    assert set(q.regions[below]) <= set(q.regions[floor & ~below])
    assert np.isfinite(q.radiance).all()
