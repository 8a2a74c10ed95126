"""Scene files as people have them: what they may hold, and what is refused in one sentence.

A sentence begins with the file as the user names it, and says the line where there is one.
"""

from __future__ import annotations

import os
import re
import struct
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
import pytest

import render

import drjit as dr  # isort: skip


def scene_of(*lines: str, version: str = "3.0.0") -> str:
    """The text of a scene, of which the first line is line 2."""
    return "\n".join([f'<scene version="{version}">', *lines, "</scene>"])


def node(tag: str, plugin: str, *inside: str, **attributes: str) -> str:
    own = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f'<{tag} type="{plugin}"{own}>{"".join(inside)}</{tag}>'


def number(name: str, value: float = 1) -> str:
    return f'<float name="{name}" value="{value}"/>'


def text(name: str, value: str) -> str:
    return f'<string name="{name}" value="{value}"/>'


bsdf, shape, light = (partial(node, tag) for tag in ("bsdf", "shape", "emitter"))
sensor, film, integrator = (partial(node, tag) for tag in ("sensor", "film", "integrator"))
texture, spectrum, medium = (partial(node, tag) for tag in ("texture", "spectrum", "medium"))
DIFFUSE = bsdf("diffuse")
FLOOR = '<shape type="rectangle" id="floor"/>'
LAMP = (
    '<emitter type="point"><point name="position" value="0.2 0.1 0.8"/>'
    '<rgb name="intensity" value="2"/></emitter>'
)
BLOCK = (
    '<transform name="to_world"><scale value="0.1"/><translate x="0.4" z="0.2"/></transform>'
    '<bsdf type="diffuse"/>'
)
ABOVE = (
    '<transform name="to_world"><lookat origin="0.1 0 3" target="0 0 0" up="0 1 0"/></transform>'
)
TRIANGLE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
-1 -1 0
1 -1 0
0 1 0
3 0 1 {last}
"""
MESH = '<shape type="ply"><string name="filename" value="{}"/></shape>'


@pytest.fixture
def write(tmp_path) -> Callable[..., Path]:
    """Write lines into a scene file, the first of them being its line 2."""

    def file(*lines: str, version: str = "3.0.0", name: str = "room.xml") -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(scene_of(*lines, version=version))
        return path

    return file


def seen(path: Path, shapes: list[str] | None = None, **parameters: Any) -> list[np.ndarray]:
    """Positions, radiance and errors of a few observations, with interreflected light."""
    q = render.observe(render.load(path, **parameters), points=64, spp=4, shapes=shapes)
    return [q.positions, q.radiance, q.sigma]


def lamp_at(x: str) -> str:
    return f'<emitter type="point"><point name="position" x="{x}" y="0" z="0.5"/></emitter>'


FORMS = {
    "single quotes": "<default name='x' value='0.3'/>",
    "value first": '<default value="0.3" name="x"/>',
    "over lines": '<default\n  name = "x"\n  value = "0.3"\n/>',
    "after a comment that is no XML": '<!-- -- walls -- --><default name="x" value="0.3"/>',
    "no default": "",
}


@pytest.mark.parametrize("form", FORMS)
def test_a_parameter_is_one_that_the_file_uses(form, write, refuses):
    """However its default is written, and without one; the others are named."""
    path = write(
        FORMS[form], '<!-- <default name="ghost" value="$shade"/> -->', FLOOR, lamp_at("$x")
    )
    assert render.load(path, x=0.1).lights.positions[0][0] == np.float32(0.1)
    if form == "no default":
        with refuses(f"{path}: line 5: undefined parameter: $x"):
            render.load(path)
    else:
        assert render.load(path).lights.positions[0][0] == np.float32(0.3)
    for name in ("ghost", "shade", "zork"):
        with refuses(f"{path}: has no parameter '{name}' (it has: x)"):
            render.load(path, x=0.1, **{name: 1})


def test_files_are_found_where_mitsuba_finds_them(write, tmp_path, refuses):
    """By <path> and from included files, with parameters in names; all of them are `files_of`."""
    write(FLOOR, lamp_at("$x"), MESH.format("$which.ply"), name="parts/lit.xml")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "flat.ply").write_text(TRIANGLE.format(last=2))
    (tmp_path / "grey.spd").write_text("400 0.5\n700 0.5\n")
    grey = '<bsdf type="diffuse"><spectrum name="reflectance" filename="$paint.spd"/></bsdf>'
    path = write(
        '<path value="meshes"/><default name="x" value="0"/><default name="which" value="none"/>',
        '<default name="paint" value="grey"/><default name="part" value="lit"/>',
        '<include filename="parts/$part.xml"/>',
        f'<shape type="cube">{grey}</shape>',
    )
    room = render.load(path, x=0.25, which="flat")
    assert len(room.scene.shapes()) == 3 and room.lights.positions[0][0] == 0.25
    names = [file.name for file in render.files_of(path, which="flat")]
    assert names == ["room.xml", "grey.spd", "flat.ply", "lit.xml"]
    with refuses(f"{path}: parts/lit.xml, line 4: mesh none.ply: no such file"):
        render.load(path)
    (tmp_path / "meshes" / "flat.ply").write_text(TRIANGLE.format(last=7))
    with refuses(f"{path}: parts/lit.xml, line 4: mesh") as refused:
        render.load(path, which="flat")
    assert "face 0 refers to vertex 7" in str(refused.value)
    alone = write(FLOOR, LAMP, MESH.format("flat.ply"), name="alone.xml")
    with refuses(f"{alone}: line 4: mesh flat.ply: no such file"):  # another scene's <path>
        render.load(alone)


IDS = ("Cube.001", "a/b c.1", "light_1", "lightloc", "part_0")


@pytest.mark.parametrize("name", IDS)
def test_any_id_is_a_shape_s(name, write, eps):
    """A room with such an id is lit anew, observed by it, and is the room that it is without."""
    path, plain = (
        write(
            f'<sensor type="perspective" id="{own}.eye">{ABOVE}</sensor>',
            *(FLOOR, f'<shape type="cube" id="{own}">{BLOCK}</shape>', LAMP),
            name=file,
        )
        for own, file in ((name, "named.xml"), ("block", "plain.xml"))
    )
    room = render.load(path)
    q = render.observe(room, points=32, shapes=[name], transport="direct")
    same = render.observe(render.load(plain), points=32, shapes=["block"], transport="direct")
    np.testing.assert_array_equal(q.radiance, same.radiance)
    H, _ = render.interreflected(room, q, spp=8)(room.lights.positions)
    assert (H >= 0).all() and H.any()
    relit = render.relight(render.relight(room, room.lights), room.lights)
    for one in (room, relit):
        assert [shape.id() for shape in one.scene.shapes()] == ["floor", name]
        assert len(one.scene.emitters()) == len(one.scene.sensors()) == 1
        np.testing.assert_allclose(render.remeasure(one, q).radiance, q.radiance, atol=8 * eps)


def test_sensors_of_shapes_stay_one(write):
    """A light meter on a shape, beside cameras: each stays in its place when a room is relit."""
    meter = '<shape type="disk" id="m"><sensor type="irradiancemeter"/></shape>'
    camera = f'<sensor type="perspective">{ABOVE}</sensor>'
    room = render.load(write(meter, camera, LAMP, camera))
    kinds = [sensor.class_name() for sensor in room.scene.sensors()]
    assert kinds == ["IrradianceMeter", "PerspectiveCamera", "PerspectiveCamera"]
    relit = render.relight(room, room.lights)
    assert [sensor.class_name() for sensor in relit.scene.sensors()] == kinds


GROUP = f'<shape type="shapegroup" id="g.1"><shape type="cube" id="in">{BLOCK}</shape></shape>'
INSTANCES = (
    '<shape type="instance" id="chair.1"><ref id="g.1"/></shape>',
    '<shape type="instance"><ref id="g.1"/><transform name="to_world">'
    '<translate x="-0.8"/></transform></shape>',
)


def test_instances_are_the_shapes_that_they_stand_for(write):
    """To the last bit: they are in the way of light, reflect it, are observed by name and drawn."""
    again = BLOCK.replace('x="0.4"', 'x="-0.4"')
    there = [
        f'<shape type="cube" id="{i}">{block}</shape>' for i, block in enumerate((BLOCK, again))
    ]
    plain = render.load(write(FLOOR, *there, LAMP, name="plain.xml"))
    room = render.load(write(FLOOR, GROUP, *INSTANCES, LAMP))
    assert [shape.id() for shape in room.scene.shapes()] == ["floor", "chair.1", ""]
    assert not room.unobserved
    q, same = (render.observe(r, points=256, spp=16) for r in (room, plain))
    np.testing.assert_allclose(q.positions, same.positions, atol=1e-6)
    np.testing.assert_allclose(q.radiance, same.radiance, rtol=0.02, atol=1e-3)
    assert (q.positions[:, 2] > 0.05).any()
    own = render.observe(room, points=32, shapes=["chair.1"], transport="direct")
    assert (np.abs(own.positions - [0.4, 0, 0.2]) < 0.1 + 1e-6).all()
    assert len(render.triangles(room)[1]) == 2 + 2 * 12


MOVES = {
    "turned": '<rotate x="0.6" y="0.8" angle="50"/>',
    "smaller": '<rotate z="1" angle="20"/><scale value="0.6"/>',
    "stretched": '<scale x="0.5" y="1.5"/>',
    "sheared": '<rotate z="1" angle="30"/><scale x="0.5" y="1.5"/>',
    "mirrored": '<scale x="-1"/>',
}
REPEATED = {
    "cube": shape("cube", "{}", id="in"),
    "sphere": shape("sphere", "{}", id="in"),
    "disk": shape("disk", "{}", id="in"),
    "merged": shape("merge", shape("cube", "{}", id="in"), shape("cylinder", "{}", id="in.2")),
}
OF_ITS_KIND = {  # the moves that leave a shape one of its kind
    "cube": {"turned", "smaller", "stretched", "sheared"},
    "sphere": {"turned", "smaller"},
    "disk": {"turned", "smaller"},
    "merged": {"turned", "smaller"},
}


@pytest.mark.parametrize("repeated", REPEATED)
@pytest.mark.parametrize("move", MOVES)
def test_an_instance_is_where_mitsuba_has_it(move, repeated, write, monkeypatch):
    """Rays meet the copies where they meet Mitsuba's own instances, and see the same normals."""
    inside = BLOCK.replace("0.1", "0.3")
    there = f'<transform name="to_world">{MOVES[move]}<translate y="0.3"/></transform>'
    path = write(
        *(FLOOR, LAMP, shape("shapegroup", REPEATED[repeated].replace("{}", inside), id="g")),
        shape("instance", '<ref id="g"/>' + there, id="a"),
        shape("instance", '<ref id="g"/>', id="b"),
    )
    room = render.load(path)
    kinds = [kept.class_name() for kept in room.scene.shapes()]
    assert ("Instance" in kinds) == (move not in OF_ITS_KIND[repeated])
    assert len(room.unobserved) == kinds.count("Instance") < 2
    monkeypatch.setattr("render.instances.COPIES", 0)
    own = render.load(path)
    assert [kept.class_name() for kept in own.scene.shapes()].count("Instance") == 2
    assert len(own.unobserved) == 2
    rng = np.random.default_rng(1)
    start, aim = rng.normal(size=(2, 3, 2000)) * np.array([[[3.0]], [[0.4]]])
    ray = mi.Ray3f(
        mi.Point3f(start), mi.Vector3f((aim - start) / np.linalg.norm(aim - start, axis=0))
    )
    a, b = (one.scene.ray_intersect(ray) for one in (room, own))
    hit = np.array(a.is_valid()) & np.array(b.is_valid())
    assert (np.array(a.is_valid()) == np.array(b.is_valid())).mean() > 0.998
    for of in (lambda si: si.p, lambda si: si.n, lambda si: si.sh_frame.n):
        far = np.abs(np.array(of(a)) - np.array(of(b))).max(axis=0)[hit]
        assert (far < 1e-3).mean() > 0.998  # the rest passes an edge


def test_what_is_merged_is_observed(write):
    """``merge`` is the shapes in it, where Mitsuba has one shape whose area nobody knows."""
    floor = '<shape type="rectangle" id="floor"/>'
    room = render.load(write(shape("merge", floor, shape("cube", BLOCK, id="block")), LAMP))
    plain = render.load(write(floor, shape("cube", BLOCK, id="block"), LAMP, name="plain.xml"))
    a, b = (render.observe(r, points=64, transport="direct") for r in (room, plain))
    np.testing.assert_array_equal(a.radiance, b.radiance)
    assert [kept.id() for kept in room.scene.shapes()] == ["floor", "block"]


def test_a_camera_sees_instances(write):
    """Each is a shape of its own in a view."""
    camera = f'<sensor type="perspective">{ABOVE}<float name="fov" value="50"/></sensor>'
    room = render.load(write(camera, GROUP, *INSTANCES, FLOOR, LAMP))
    view = render.photograph(room, width=64, transport="direct")
    assert set(np.unique(view.shape)) >= {0, 1, 2}
    assert (view.albedo[view.shape == 0] > 0).all()


def test_what_cannot_be_sampled_says_so(write, tmp_path, refuses):
    """A mirrored instance or a curve by its name, or where nothing else is there."""
    (tmp_path / "hair.txt").write_text(
        "0 0 0.2 0.01\n0.1 0 0.2 0.01\n0.2 0 0.2 0.01\n0.3 0 0.3 0.01\n"
    )
    hair = '<string name="filename" value="hair.txt"/>'
    curves = [
        f'<shape type="{kind}" id="{kind}">{hair}</shape>'
        for kind in ("linearcurve", "bsplinecurve")
    ]
    turned = '<transform name="to_world"><scale x="-1"/></transform></shape>'
    mirrored = [INSTANCES[0].replace("</shape>", turned)]
    path = write(GROUP, *mirrored, FLOOR, *curves, LAMP)
    room = render.load(path)
    assert len(render.observe(room, points=16, transport="direct")) == 16
    assert len(render.triangles(room)[0]) > 4
    for name in ("chair.1", "linearcurve", "bsplinecurve"):
        with refuses(f"{path}: shape '{name}' is of type ") as refused:
            render.observe(room, points=16, shapes=["floor", name])
        assert "can't be sampled" in str(refused.value)
    for name in ("g.1", "in", ""):
        with refuses(f"{path}: has no shape '{name}' (it has: chair.1, floor, linearcurve"):
            render.observe(room, points=16, shapes=[name])
    bare = write(GROUP, *mirrored, LAMP, name="bare.xml")
    with refuses(f"{bare}: shape 'chair.1' is of type Instance"):
        render.observe(render.load(bare), points=16)


FILM = film("hdrfilm", '<boolean name="high_quality_edges" value="true"/>')
SAMPLER = node("sampler", "independent", '<integer name="scramble" value="3"/>')
UNUSED = {
    "integrator": integrator("sppm"),
    "integrator in one": integrator("aov", integrator("transientpath")),
    "integrator out of range": integrator("path", '<integer name="max_depth" value="-7"/>'),
    "film": sensor("perspective", film("mfilm")),
    "film's property": sensor("perspective", FILM),
    "filter": sensor("perspective", film("hdrfilm", node("rfilter", "sinc"))),
    "sampler": sensor("perspective", node("sampler", "halton")),
    "sampler's property": sensor("perspective", SAMPLER),
    "sensor": sensor("spherical"),
    "bsdf that no shape has": bsdf("velvet", id="v"),
    "property of one": bsdf("diffuse", number("gloss"), id="v"),
    "medium that is nowhere": medium("homogeneous", id="fog"),
    "null surface": shape("sphere", bsdf("null")),
    "null surface by its name": bsdf("null", id="air") + shape("sphere", '<ref id="air"/>'),
    "mask of nothing": shape("sphere", bsdf("mask", number("opacity", 0), DIFFUSE)),
}


@pytest.mark.parametrize("case", UNUSED)
def test_what_is_not_used_changes_nothing(case, write):
    """An integrator, film or sampler that this Mitsuba does not have, and surfaces of nothing."""
    block = f'<shape type="cube" id="block">{BLOCK}</shape>'
    plain = write(FLOOR, block, LAMP, name="plain.xml")
    for a, b in zip(seen(write(UNUSED[case], FLOOR, block, LAMP)), seen(plain), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_film_that_is_unknown_keeps_its_size(write):
    """And a sensor that is unknown is not counted."""
    size = '<integer name="width" value="24"/><integer name="height" value="6"/>'
    camera = sensor("perspective", ABOVE, film("mfilm", size, number("gamma")))
    room = render.load(write(sensor("spherical"), camera, FLOOR, LAMP))
    assert render.photograph(room, transport="direct").size == (24, 6)


@pytest.mark.parametrize("opacity", ["float", "spectrum", "rgb"])
def test_a_mask_that_hides_nothing_is_what_it_masks(opacity, write):
    diffuse = '<bsdf type="diffuse"/>'
    masked = f'<bsdf type="mask"><{opacity} name="opacity" value="1"/>{diffuse}</bsdf>'
    there, plain = (
        write(FLOOR, f'<shape type="cube">{BLOCK.replace(diffuse, bsdf)}</shape>', LAMP, name=name)
        for bsdf, name in ((masked, "room.xml"), (diffuse, "plain.xml"))
    )
    for a, b in zip(seen(there), seen(plain), strict=True):
        np.testing.assert_array_equal(a, b)


def test_names_of_old_versions(write):
    """A scene of Mitsuba 0.5 is the same scene in the words of Mitsuba 3."""
    new = (
        f'<sensor type="perspective">{ABOVE}<float name="fov" value="40"/></sensor>',
        '<shape type="sphere"><boolean name="flip_normals" value="true"/>' + number("radius", 2),
        '<bsdf type="roughplastic"><spectrum name="diffuse_reflectance" value="0.4"/>'
        '<float name="int_ior" value="1.4"/></bsdf></shape>',
        LAMP,
    )
    words = {"to_world": "toWorld", "flip_normals": "flipNormals", "int_ior": "intIOR"}
    words |= {"<lookat": "<lookAt", "diffuse_reflectance": "diffuseReflectance"}
    old = "\n".join(new)
    for here, there in words.items():
        assert here in old
        old = old.replace(here, there)
    paths = write(*new, name="new.xml"), write(old, version="0.5.0", name="old.xml")
    for a, b in zip(*map(seen, paths), strict=True):
        np.testing.assert_array_equal(a, b)
    views = [render.photograph(render.load(p), width=8, transport="direct") for p in paths]
    assert views[0] == views[1]


OLD_COLOURS = {
    '<srgb name="reflectance" value="#c8b4a0"/>': [0.577580, 0.456411, 0.351533],
    "<srgb\n value='0.5, 0.04 0.7'  name='reflectance'/>": [0.214041, 0.003096, 0.447988],
    '<srgb name="reflectance" value="0.5"/>': [0.214041, 0.214041, 0.214041],
    '<rgb name="reflectance" value="#ff8800" intent="reflectance"/>': [1.0, 0.533333, 0.0],
    '<spectrum intent="reflectance" name="reflectance" value="0.3"/>': [0.3, 0.3, 0.3],
}


@pytest.mark.parametrize("colour", OLD_COLOURS)
def test_colours_of_old_versions(colour, write):
    """Values of a screen become light (IEC 61966-2-1), in hexadecimal too; intent says nothing."""
    path = write(FLOOR[:-2] + f">{bsdf('diffuse', colour)}</shape>", LAMP, version="0.6.0")
    q = render.observe(render.load(path), points=8, transport="direct")
    albedo = np.broadcast_to(q.material.albedo, (len(q.material.albedo), 3))[0]
    np.testing.assert_allclose(albedo, OLD_COLOURS[colour], atol=2e-6)


SPECTRA = {
    "float": (number("intensity", 3), 3),
    "rgb": ('<rgb name="intensity" value="1 2 3"/>', [1, 2, 3]),
    "uniform": (spectrum("uniform", number("value", 4), name="intensity"), 4),
    "d65": (spectrum("d65", number("scale", 3), name="intensity"), 3),
    "none": ("", 1),
}


@pytest.mark.parametrize("case", SPECTRA)
def test_intensities_are_what_lights_the_room(case, write):
    """The truth is what a surface under the light receives: pi B d^2 / albedo below it."""
    intensity, value = SPECTRA[case]
    lamp = light("point", '<point name="position" value="0 0 1"/>', intensity)
    room = render.load(write(FLOOR, lamp))
    I = np.broadcast_to(room.lights.intensities, (1, 3))
    np.testing.assert_allclose(I, [np.broadcast_to(value, 3)], rtol=1e-6)
    q = render.observe(room, points=8, transport="direct")
    d = np.linalg.norm(q.positions - [0, 0, 1], axis=1)[:, None]
    np.testing.assert_allclose(q.radiance, 0.5 / np.pi * I[:, : q.channels] / d**3, rtol=1e-4)


pane, lamp = partial(shape, "cube", id="pane"), partial(light, "point", id="lamp")
colour = partial(spectrum, name="reflectance")
IRREGULAR = text("wavelengths", "400, 700") + text("values", "1, 2")
REGULAR = number("wavelength_min", 400) + number("wavelength_max", 700) + text("values", "1, 2")
FOG = medium("homogeneous", name="interior")
WINDOW = bsdf("thindielectric")
IN_A_GROUP = shape("shapegroup", shape("cube", WINDOW, id="w"), id="g")
BLEND = bsdf("blendbsdf", number("weight", 0.5), bsdf("null"), DIFFUSE)
INSTANCE = shape("instance", '<ref id="g"/>')
FAR = '<translate x="{}"/>'
WHITE = bsdf("diffuse", '<rgb name="reflectance" value="1.5"/>')
REFUSED = {
    "blackbody": (lamp(spectrum("blackbody", name="intensity")), "'blackbody'", "RGB"),
    "regular": (lamp(spectrum("regular", REGULAR, name="intensity")), "'regular'", "RGB"),
    "blackbody as a colour": (pane(bsdf("diffuse", colour("blackbody"))), "'blackbody'"),
    "irregular as a colour": (pane(bsdf("diffuse", colour("irregular", IRREGULAR))), "'irregular'"),
    "fog in a null shape": (pane(bsdf("null"), FOG), "'pane'", "medium"),
    "fog in glass": (pane(bsdf("dielectric"), FOG), "'pane'", "medium"),
    "fog outside": (pane(FOG.replace("interior", "exterior")), "'pane'", "medium"),
    "fog at a light": (lamp(medium("homogeneous")), "'lamp'", "medium"),
    "fog at a camera": (sensor("perspective", medium("homogeneous"), id="eye"), "'eye'", "medium"),
    "window": (pane(WINDOW), "'pane'", "see-through"),
    "mask": (pane(bsdf("mask", DIFFUSE)), "'pane'", "see-through"),
    "leaf": (
        pane(bsdf("mask", texture("checkerboard", name="opacity"), DIFFUSE)),
        *("'pane'", "see-through"),
    ),
    "half null": (pane(BLEND), "'pane'", "see-through"),
    "window in a group": (
        IN_A_GROUP + shape("instance", '<ref id="g"/>', id="there"),
        *("'there'", "see-through"),
    ),
    "beam of a panel": (pane(light("directionalarea")), "'directionalarea'", "one direction"),
    "sky by the hour": (light("timed_sunsky"), "'timed_sunsky'", "moves with time"),
    "a shape's own light": (pane(light("point")), "'pane'", "point emitter"),
    "property of a shape": (pane(number("bevel")), "'cube'", "property 'bevel'"),
    "transform": (
        pane('<transform name="toWorld"><scale value="2"/></transform>'),
        "property 'toWorld'",
    ),
    "property of what is repeated": (
        shape("shapegroup", shape("cube", text("filename", "a.ply")), id="g")
        + shape("instance", '<ref id="g"/>'),
        *("'cube'", "'filename'"),
    ),
    "no inverse": (
        pane('<transform name="to_world"><rotate x="1" y="2" z="3" angle="50"/></transform>'),
        *("'pane'", "to_world without an inverse", "length 1"),
    ),
    "flattened": (
        pane('<transform name="to_world"><scale z="0"/></transform>'),
        *("'pane'", "to_world without an inverse", "scale of 0"),
    ),
    "stretched sphere": (
        shape("sphere", '<transform name="to_world"><scale z="2"/></transform>', id="egg"),
        *("'egg'", "stretched"),
    ),
    "property of what is merged": (
        shape("merge", shape("cube"), '<transform name="to_world"><scale value="2"/></transform>'),
        *("'merge'", "'to_world'"),
    ),
    "property of a BSDF": (pane(bsdf("diffuse", number("gloss"))), "bsdf 'diffuse'", "'gloss'"),
    "texture of a BSDF": (
        pane(bsdf("diffuse", texture("checkerboard", name="gloss"))),
        *("bsdf 'diffuse'", "'gloss'"),
    ),
    "property of a texture": (
        pane(bsdf("diffuse", texture("checkerboard", number("gloss"), name="reflectance"))),
        *("texture 'checkerboard'", "'gloss'"),
    ),
    "property of a light": (lamp(number("samplingWeight")), "'samplingWeight'"),
    "property of a camera": (sensor("perspective", number("kc")), "'kc'"),
    "shape in a shape": (pane(shape("cube")), "no place for an object"),
    "unknown BSDF": (pane(bsdf("phong")), "no bsdf 'phong'"),
    "unknown texture": (
        pane(bsdf("diffuse", texture("noise", name="reflectance"))),
        "no texture 'noise'",
    ),
    "bitmap without a file": (
        pane(bsdf("diffuse", texture("bitmap", name="reflectance"))),
        *("bitmap", "filename"),
    ),
    "relief without a slope": (
        pane(bsdf("bumpmap", texture("checkerboard", name="b"), DIFFUSE)),
        *("'pane'", "can't be evaluated", "eval_1_grad"),
    ),
    "BSDFs in BSDFs": (
        pane('<bsdf type="twosided">' * 9 + DIFFUSE + "</bsdf>" * 9),
        "nested more than 8 deep",
    ),
    "nowhere": (pane(f'<transform name="to_world">{FAR.format("nan")}</transform>'), "reaches nan"),
    "far away": (pane(f'<transform name="to_world">{FAR.format("1e13")}</transform>'), "1e+13"),
    "odd characters": (pane(number("gl\u202eoss")), "'gl\\u202eoss'"),
    "long value": (pane(f'<float name="x" value="{"A" * 10_000}"/>'), 'AAA..."'),
    "blend of nothing": (pane(bsdf("blendbsdf")), "blendbsdf", "two BSDFs"),
    "empty group": (shape("shapegroup", id="g") + INSTANCE, "'g'", "without a surface"),
    "no such picture": (
        pane(bsdf("diffuse", texture("bitmap", text("filename", "gone.png"), name="reflectance"))),
        *("gone.png", "No such file"),
    ),
    "reference to nothing": (pane('<ref id="gone"/>'), 'unresolved reference to "gone"'),
    "include of nothing": ('<include filename="gone.xml"/>', 'included file "gone.xml" not found'),
    "include of itself": ('<include filename="room.xml"/>', "include recursion depth"),
    "path to nothing": ('<path value="gone"/>', 'folder "gone" not found'),
    "same id twice": (FLOOR, 'duplicate ID: "floor"'),
    "too white": (pane(WHITE), "bsdf 'diffuse'", "[1.5, 1.5, 1.5]"),
    "not a number": (pane('<float name="x" value="1.2.3"/>'), '"1.2.3"'),
    "tag of older versions": (light("point").replace("emitter", "luminaire"), "<luminaire>"),
    "no colour": (pane(bsdf("diffuse", '<srgb name="reflectance" value="#12"/>')), "<srgb>"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_rendered_is_refused(case, write, refuses):
    """Not modelled, not known to this Mitsuba, or broken: the line, and what it is."""
    fault, *said = REFUSED[case]
    path = write(FLOOR, LAMP, fault)
    with refuses(f"{path}: line 4: ") as refused:
        render.load(path)
    for words in said:
        assert words in str(refused.value)
    assert not re.search(r"\.cpp|\[[A-Z]\w+\]|failed to instantiate", str(refused.value))
    render.load(write(FLOOR, LAMP, name="control.xml"))


NUMBERS = {  # of a BSDF, that Mitsuba would take as they are, or for others
    "a roughness below 0": ("roughconductor", number("alpha", -0.2), "alpha is -0.2"),
    "a roughness that is none": ("roughplastic", number("alpha", float("nan")), "alpha is nan"),
    "an integer": ("roughdielectric", '<integer name="alpha" value="-1"/>', "alpha is -1"),
    "a share below 0": ("principled", number("metallic", -1), "metallic is -1"),
    "a colour": ("conductor", '<rgb name="eta" value="1 -2 1"/>', "eta is -2"),
    "a texture": (
        "diffuse",
        '<texture name="reflectance" type="uniform"><float name="value" value="-1"/></texture>',
        "value is -1",
    ),
    "a spectrum": ("conductor", '<spectrum name="k" value="-2"/>', "k is -2"),
}


@pytest.mark.parametrize("case", NUMBERS)
def test_numbers_that_no_surface_has_are_refused(case, write, refuses):
    """On their line, also within another BSDF."""
    plugin, wrong, said = NUMBERS[case]
    inside = bsdf("twosided", "\n", bsdf(plugin, wrong))
    file = write(shape("rectangle", inside), LAMP)
    with refuses(f"{file}: line 3: ") as refused:
        render.load(file)
    assert f"{said}; expected a finite number, at least 0" in str(refused.value)


@pytest.mark.parametrize("word", ["difuse", "Diffuse", "roughdifuse", "roughplastics", "phong"])
def test_the_nearest_plugin_is_said(word, write, refuses):
    """Of the same kind, where any is near."""
    file = write(shape("rectangle", bsdf(word)), LAMP)
    with refuses(f"{file}: line 2: this Mitsuba has no bsdf '{word}'") as refused:
        render.load(file)
    near = {
        "difuse": "diffuse",
        "Diffuse": "diffuse",
        "roughdifuse": "roughdiffuse",
        "roughplastics": "roughplastic",
    }.get(word)
    end = f"; did you mean '{near}'?" if near else f"'{word}'"
    assert str(refused.value).endswith(end)


def test_an_included_file_is_named_with_its_line(write, refuses):
    """Whether Mitsuba's parser, its plugins or we find the fault, and in old words too."""
    faults = (
        '<shape type="cube"><zork/></shape>',
        pane(bsdf("phong")),
        pane(bsdf("twosided")),
    )
    for fault in faults:
        write("", fault, name="parts/bad.xml")
        path = write(FLOOR, LAMP, '<include filename="parts/bad.xml"/>')
        with refuses(f"{path}: parts/bad.xml, line 3: "):
            render.load(path)
    camera = f'<sensor type="perspective">{ABOVE}</sensor>'.replace("lookat", "lookAt")
    path = write(camera, FLOOR, LAMP, *faults[:1], version="0.5.0")
    with refuses(f"{path}: line 5: encountered an unsupported XML element: <zork>"):
        render.load(path)


PIPED = {
    "mesh": shape("ply", text("filename", "pipe")),
    "texture": pane(bsdf("diffuse", texture("bitmap", text("filename", "pipe"), name="b"))),
    "spectrum": pane(bsdf("diffuse", '<spectrum name="reflectance" filename="pipe"/>')),
    "include": '<include filename="pipe"/>',
    "by a parameter": '<default name="f" value="pipe"/><include filename="$f"/>',
    "in a folder": '<path value="parts"/>' + shape("obj", text("filename", "deep")),
    "in an included file": '<include filename="parts/piped.xml"/>',
}


@pytest.mark.parametrize("case", PIPED)
def test_a_pipe_or_a_device_is_no_file(case, write, tmp_path, refuses):
    """Mitsuba would wait for it, for ever."""
    write(PIPED["mesh"], name="parts/piped.xml")
    os.mkfifo(tmp_path / "pipe")
    os.mkfifo(tmp_path / "parts" / "deep")
    path = write(FLOOR, LAMP, PIPED[case])
    with refuses(f"{path}: {tmp_path}") as refused:
        render.load(path)
    assert "device or a pipe" in str(refused.value)
    for device in (tmp_path / "pipe", Path("/dev/zero")):
        with refuses(f"{device}: "):
            render.load(device)


ENDLESS = {
    "tags in tags": scene_of("<a>" * 100_000),
    "tags that never end": scene_of("<a b='c" * 100_000),
    "comments that never end": scene_of("<!--" * 100_000),
    "a name": scene_of(FLOOR, LAMP, f'<shape type="cube" id="{"n" * 10**7}"/>'),
    "entities": '<!DOCTYPE s [<!ENTITY a "&a;&a;">]>' + scene_of('<shape type="&a;"/>'),
}


@pytest.mark.parametrize("case", ENDLESS)
def test_an_endless_file_ends(case, tmp_path, refuses):
    """In time that grows with its length alone, and without ending the process."""
    path = tmp_path / "room.xml"
    path.write_text(ENDLESS[case])
    if case == "a name":
        assert len(render.load(path).scene.shapes()[1].id()) == 10**7
    else:
        with refuses(f"{path}: "):
            render.load(path)


def test_files_that_include_files(write, refuses):
    """Each eight others, or each other: refused before Mitsuba reads eight to the twelfth."""
    include = '<include filename="parts/{}.xml"/>'
    for i in range(12):
        write(*8 * [f'<include filename="{i + 1}.xml"/>'], name=f"parts/{i}.xml")
    write(name="parts/12.xml")
    path = write(FLOOR, LAMP, include.format(0))
    with refuses(f"{path}: includes more than 1000 files"):
        render.load(path)
    render.load(write(FLOOR, LAMP, include.format(10)))  # 8 + 64


def test_pictures_of_no_colours(write, tmp_path, refuses):
    """Values that are not finite, negative, or beyond float32's squares; of a raw one too."""
    picture = text("filename", "p.pfm")
    colour = texture("bitmap", picture, name="reflectance")
    path = write(FLOOR, LAMP, pane(bsdf("diffuse", colour)))
    for value, good in ((0.5, True), (-0.5, False), (np.nan, False), (np.inf, False), (1e7, False)):
        values = np.full((2, 2, 3), 0.2, "<f4")
        values[1, 0, 2] = value
        (tmp_path / "p.pfm").write_bytes(b"PF\n2 2\n-1.0\n" + values.tobytes())
        if good:
            seen(path)
        else:
            with refuses(f"{path}: line 4: p.pfm holds {value:g}; expected values of 0 to 1e+06"):
                render.load(path)


def bmp(width: int = 2, height: int = 2, bits: int = 24) -> bytes:
    head = struct.pack("<2sIHHI", b"BM", 70, 0, 0, 54)
    return head + struct.pack("<IiiHHIIiiII", 40, width, height, 1, bits, *[0] * 6) + bytes(16)


def vol(size: int = 2, kind: int = 1, value: float = 0.5) -> bytes:
    head = b"VOL\x03" + struct.pack("<5i6f", kind, size, 2, 2, 1, 0, 0, 0, 1, 1, 1)
    return head + np.full(8, value, "<f4").tobytes()


BROKEN = {
    "p.ppm": tuple(b"P6\n2 " + rest for rest in (b"2\n255\n" + bytes(12), b"0\n255\n", b"2\n")),
    "p.pfm": tuple(
        b"PF\n2 " + rest for rest in (b"2\n-1.0\n" + bytes(48), b"\0\n-1\n" + bytes(48))
    ),
    "p.bmp": (bmp(), bmp(bits=0), bmp(width=-2), bmp(width=2**30), bmp(height=0), bmp()[:20]),
    "g.vol": (vol(), vol(0), vol(-(2**31)), vol(3), vol(kind=2), vol(value=np.nan), b"VOL", b""),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_headers_are_refused(name, write, tmp_path, refuses):
    """What would end the process, or keep it for ever; the good one is read."""
    file = text("filename", name)
    grid = node("volume", "gridvolume", file, name="volume")
    of = ("volume", grid) if name == "g.vol" else ("bitmap", file)
    path = write(FLOOR, LAMP, pane(bsdf("diffuse", texture(*of, name="reflectance"))))
    good, *bad = BROKEN[name]
    (tmp_path / name).write_bytes(good)
    render.load(path)
    for content in bad:
        (tmp_path / name).write_bytes(content)
        with refuses(f"{path}: line 4: ") as refused:
            render.load(path)
        assert name in str(refused.value)


def test_blocks_of_an_exr_texture_are_in_place(write, tmp_path, refuses, rng):
    """One that is not would end the process: two of Mitsuba's threads complain at once."""
    file = oiio.ImageOutput.create(str(tmp_path / "p.exr"))
    spec = oiio.ImageSpec(4, 40, 3, oiio.FLOAT)
    spec.attribute("compression", "zip")  # blocks of 16 lines: three of them
    assert file.open(str(tmp_path / "p.exr"), spec)
    assert file.write_image(rng.random((40, 4, 3), np.float32)) and file.close()
    colour = texture("bitmap", text("filename", "p.exr"), name="reflectance")
    path = write(FLOOR, LAMP, pane(bsdf("diffuse", colour)))
    render.load(path)
    good = (tmp_path / "p.exr").read_bytes()
    table = next(i for i in range(len(good)) if good[i : i + 8] == struct.pack("<Q", i + 24))
    for at in struct.unpack_from("<3Q", good, table):
        (tmp_path / "p.exr").write_bytes(good[:at] + b"\x63" + good[at + 1 :])
        with refuses(f"{path}: line 4: bitmap {tmp_path}/p.exr: a damaged EXR file"):
            render.load(path)


def test_what_a_room_yields_names_its_file(write, refuses):
    """Values that Mitsuba takes and nothing here does, and names that are not UTF-8."""
    path = write(
        FLOOR, LAMP, pane(bsdf("roughconductor", number("alpha", 0), text("distribution", "ggx")))
    )
    with refuses(f"{path}: Conductor.alpha[0][0] is 0; expected at least"):
        seen(path)
    latin = write(FLOOR.replace("floor", "fl\u00f6r"), LAMP)
    latin.write_bytes(latin.read_text().encode("latin-1"))
    with refuses(f"{latin}: a name in it is not written in UTF-8"):
        render.load(latin)


def test_an_exr_texture_loads_with_one_thread(write, tmp_path):
    """With one thread of Dr.Jit's, as on one core, Mitsuba by itself waits for ever."""
    texels = oiio.ImageBuf(oiio.ImageSpec(4, 4, 3, oiio.FLOAT))
    oiio.ImageBufAlgo.fill(texels, (0.2, 0.4, 0.6))
    assert texels.write(str(tmp_path / "p.exr"))
    colour = texture("bitmap", text("filename", "p.exr"), name="reflectance")
    path = write(LAMP, shape("rectangle", bsdf("diffuse", colour)))
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        q = render.observe(render.load(path), points=4, transport="direct")
        assert dr.thread_count() == 1
    finally:
        dr.set_thread_count(before)
    np.testing.assert_allclose(q.material.albedo, [[0.2, 0.4, 0.6]] * 4, rtol=1e-6)


def test_a_serialized_mesh_holds_what_it_says(write, tmp_path, refuses):
    """More faces than there are bytes, a stream that is cut off, and a mesh that is not there."""
    corners = np.array([[0, 0, 0.5], [1, 0, 0.5], [0, 1, 0.5]], "<f4").tobytes()

    def mesh(faces: int, cut: int = 0) -> bytes:
        body = struct.pack("<I", 0x1000) + b"mesh\0" + struct.pack("<QQ", 3, faces)
        packed = zlib.compress(body + corners + struct.pack("<3I", 0, 1, 2))
        return (
            struct.pack("<HH", 0x041C, 4) + packed[: len(packed) - cut] + struct.pack("<QI", 0, 1)
        )

    path = write(FLOOR, LAMP, shape("serialized", text("filename", "m.serialized"), DIFFUSE))
    (tmp_path / "m.serialized").write_bytes(mesh(1))
    assert len(render.load(path).scene.shapes()) == 2
    for broken, said in (
        (mesh(1 << 23), "holds 73 bytes of the 100663357 that it says it has"),
        (mesh(1 << 60), "that it says it has"),
        (mesh(1, cut=30), "is no serialized mesh, or is damaged"),
        (b"", "is no serialized mesh, or is damaged"),
    ):
        (tmp_path / "m.serialized").write_bytes(broken)
        with refuses(f"{path}: line ") as refused:
            render.load(path)
        assert said in str(refused.value)


def test_a_name_that_no_file_could_have_is_no_file(write):
    path = write(FLOOR, LAMP, integrator("path", text("note", "9" * 5000)))
    assert render.files_of(path) == [path]
