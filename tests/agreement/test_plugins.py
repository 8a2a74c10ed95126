"""Every BSDF and shape of this Mitsuba: observed as Mitsuba renders it, or named as left out."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from rooms import tables

import lightloc  # before mitsuba: it chooses the LLVM library
import render
from render.variant import two_threads

LIGHT = lightloc.PointLights([[0.4, -0.3, 2.0]], [[9.0, 7.0, 5.0]])
LAMP = (
    '<emitter type="point"><point name="position" x="0.4" y="-0.3" z="2"/>'
    '<rgb name="intensity" value="9 7 5"/></emitter>'
)
MIRROR, GLASS = "is a mirror", "is glass"


def node(tag: str, plugin: str, *inside: str, name: str = "") -> str:
    own = f' name="{name}"' if name else ""
    return f'<{tag} type="{plugin}"{own}>{"".join(inside)}</{tag}>'


def bsdf(plugin: str, *inside: str) -> str:
    return node("bsdf", plugin, *inside)


def put(**values: object) -> str:
    """Properties: text, a number, or a colour."""
    kinds = {str: "string", float: "float", tuple: "rgb", bool: "boolean"}
    return "".join(
        f'<{kinds[type(v)]} name="{name}" value="'
        + (
            " ".join(map(str, v))
            if isinstance(v, tuple)
            else str(v).lower() * (type(v) is bool) or str(v)
        )
        + '"/>'
        for name, v in values.items()
    )


def picture(name: str, file: str = "paint.exr") -> str:
    return node("texture", "bitmap", put(filename=file, raw=True), name=name)


def checks(name: str) -> str:
    return node(
        "texture", "checkerboard", put(color0=(0.2, 0.3, 0.4), color1=(0.6, 0.5, 0.2)), name=name
    )


GGX, PAINT = put(distribution="ggx"), put(reflectance=(0.5, 0.4, 0.3))
WOOD = bsdf("diffuse", PAINT)
METAL = bsdf("roughconductor", GGX, put(alpha=0.3, material="Au"))
VOLUME = node(
    "texture",
    "volume",
    node("volume", "gridvolume", put(filename="grid.vol"), name="volume"),
    name="reflectance",
)
BSDFS = {  # with the reason why one is left out
    "diffuse": (WOOD, ""),
    "bitmap": (bsdf("diffuse", picture("reflectance")), ""),
    "checkerboard": (bsdf("diffuse", checks("reflectance")), ""),
    "attribute of vertices": (
        bsdf(
            "diffuse",
            node("texture", "mesh_attribute", put(name="vertex_paint"), name="reflectance"),
        ),
        "",
    ),
    "attribute of faces": (
        bsdf(
            "diffuse", node("texture", "mesh_attribute", put(name="face_paint"), name="reflectance")
        ),
        "",
    ),
    "volume": (bsdf("diffuse", VOLUME), ""),
    "spectrum": (bsdf("diffuse", '<spectrum name="reflectance" value="400:0.2,700:0.8"/>'), ""),
    "plastic": (bsdf("plastic"), ""),
    "pplastic": (bsdf("pplastic"), ""),
    "roughplastic": (bsdf("roughplastic", put(diffuse_reflectance=(0.6, 0.3, 0.2))), ""),
    "roughplastic, GGX": (bsdf("roughplastic", GGX, checks("diffuse_reflectance")), ""),
    "roughplastic, nonlinear": (
        bsdf("roughplastic", GGX, put(nonlinear=True, diffuse_reflectance=(0.6, 0.3, 0.2))),
        "",
    ),
    "conductor": (bsdf("conductor"), MIRROR),
    "roughconductor": (bsdf("roughconductor", put(alpha=0.3)), ""),
    "roughconductor, GGX": (METAL, ""),
    "roughconductor, stretched": (bsdf("roughconductor", GGX, put(alpha_u=0.2, alpha_v=0.5)), ""),
    "roughconductor, textured": (bsdf("roughconductor", GGX, picture("alpha")), ""),
    "dielectric": (bsdf("dielectric"), GLASS),
    "roughdielectric": (bsdf("roughdielectric"), GLASS),
    "principled": (bsdf("principled", put(base_color=(0.6, 0.3, 0.2), roughness=0.4)), ""),
    "principled, metallic": (
        bsdf("principled", put(metallic=0.8, clearcoat=0.5, sheen=0.4, anisotropic=0.3)),
        "",
    ),
    "principled, glass": (bsdf("principled", put(spec_trans=0.5)), GLASS),
    "principledthin": (bsdf("principledthin", put(diff_trans=0.6)), GLASS),
    "twosided": (bsdf("twosided", WOOD), ""),
    "twosided, two": (bsdf("twosided", WOOD, METAL), ""),
    "twosided, blended": (
        bsdf("twosided", bsdf("blendbsdf", put(weight=0.3), WOOD, METAL)),
        "",
    ),
    "mask of 1": (bsdf("mask", put(opacity=1.0), WOOD), ""),
    "blendbsdf": (bsdf("blendbsdf", put(weight=0.3), WOOD, METAL), ""),
    "blendbsdf, textured": (bsdf("blendbsdf", checks("weight"), WOOD, bsdf("plastic")), ""),
    "blendbsdf of two-sided ones": (
        bsdf("blendbsdf", put(weight=0.3), bsdf("twosided", WOOD), bsdf("twosided", METAL)),
        "",
    ),
    "blendbsdf of blends": (
        bsdf("blendbsdf", put(weight=0.3), bsdf("blendbsdf", put(weight=0.6), WOOD, METAL), WOOD),
        "",
    ),
    "blendbsdf with a mirror": (bsdf("blendbsdf", put(weight=0.3), WOOD, bsdf("conductor")), ""),
    "blendbsdf with glass": (bsdf("blendbsdf", put(weight=0.3), WOOD, bsdf("dielectric")), GLASS),
    "bumpmap": (bsdf("bumpmap", picture("arbitrary"), put(scale=0.02), WOOD), ""),
    "normalmap": (bsdf("normalmap", picture("normalmap", "bumps.exr"), WOOD), ""),
    "normalmap over metal": (bsdf("normalmap", picture("normalmap", "bumps.exr"), METAL), ""),
    "roughdiffuse": (bsdf("roughdiffuse", put(alpha=0.7, reflectance=(0.5, 0.4, 0.3))), ""),
    "roughdiffuse, textured": (bsdf("twosided", bsdf("roughdiffuse", checks("reflectance"))), ""),
    "measured": (bsdf("measured", put(filename="cloth_rgb.bsdf")), ""),
    "black": (bsdf("diffuse", put(reflectance=(0.0, 0.0, 0.0))), ""),
}
EACH = 24  # observations


@pytest.fixture(scope="module")
def paint(tmp_path_factory) -> Path:
    """A folder with textures, and a square mesh with attributes."""
    folder = tmp_path_factory.mktemp("paint")
    rng = np.random.default_rng(0)
    render.load("box_one")  # sets Mitsuba's variant
    paint = mi.Bitmap(rng.uniform(0.1, 0.8, (8, 8, 3)).astype(np.float32))
    with two_threads():
        paint.write(str(folder / "paint.exr"))
    bumps = np.full((8, 8, 3), [0.5, 0.5, 1]) + rng.normal(0, 0.05, (8, 8, 3)) * [1, 1, 0]
    with two_threads():
        mi.Bitmap(bumps.astype(np.float32)).write(str(folder / "bumps.exr"))
    (folder / "cloth_rgb.bsdf").write_bytes(tables.measured())
    grid = rng.uniform(0.1, 0.8, (4, 4, 4, 3)).astype(np.float32)
    mi.VolumeGrid(grid).write(str(folder / "grid.vol"))
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    rows = np.column_stack(
        [
            corners,
            np.zeros(4),
            np.tile([0, 0, 1], (4, 1)),
            corners / 2 + 0.5,
            rng.uniform(0.1, 0.8, (4, 3)),
        ]
    )
    square = mi.Mesh("square", 4, 2, has_vertex_normals=True, has_vertex_texcoords=True)
    values = mi.traverse(square)
    values["vertex_positions"], values["vertex_normals"] = rows[:, :3].ravel(), rows[:, 3:6].ravel()
    values["vertex_texcoords"], values["faces"] = rows[:, 6:8].ravel(), [0, 1, 2, 0, 2, 3]
    values.update()
    square.add_attribute("vertex_paint", 3, rows[:, 8:].astype(np.float32).ravel())
    square.add_attribute("face_paint", 3, rng.uniform(0.1, 0.8, 6).astype(np.float32))
    square.write_ply(str(folder / "square.ply"))
    return folder


def rendered(room: render.Room, q: lightloc.Observations) -> np.ndarray:
    """What Mitsuba's own integrator says of the light at each observation, straight from lamps."""
    start = q.positions + 1e-3 * q.directions
    ray = mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(-q.directions.T))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(q))
    return np.array(mi.load_dict({"type": "direct"}).sample(room.scene, sampler, ray)[0]).T


@pytest.mark.slow
def test_every_bsdf_is_observed_as_mitsuba_renders_it(paint):
    """A field of squares, one for each: B, and its model, are what Mitsuba's integrator finds."""
    shapes = []
    for i, (name, (own, _)) in enumerate(BSDFS.items()):
        x, y = i % 7 - 3, i // 7 - 2.5
        shapes.append(
            f'<shape type="ply" id="{name}"><string name="filename" value="square.ply"/>'
            f'<transform name="to_world"><scale value="0.45"/><translate x="{x}" y="{y}"/>'
            f"</transform>{own}</shape>"
        )
    path = paint / "bsdfs.xml"
    path.write_text(f'<scene version="3.0.0">{"".join(shapes)}{LAMP}</scene>')
    room = render.load(path)
    assert room.unobserved == {f"shape '{n}'": why for n, (_, why) in BSDFS.items() if why}
    q = render.observe(room, points=EACH * len(BSDFS), transport="direct")
    B = rendered(room, q)
    model = lightloc.radiance(q, LIGHT, room.geometry)
    on = np.array(q.positions[:, :2] - [-3.5, -3], int)
    which = np.array(list(BSDFS))[on[:, 1] * 7 + on[:, 0]]
    for name, (_, why) in BSDFS.items():
        here = which == name
        assert here.any() == (not why), name
        for what, values in (("B", q.radiance), ("model", model)):
            scale = np.abs(B[here]).max(initial=1e-9)
            off = np.abs(values[here] - B[here]).max(initial=0) / scale
            assert off < 1e-3, (name, what, off)
        seen_above = q.directions[here][:, 2] > 0
        assert name == "black" or (B[here][seen_above] > 0).any() or not here.any(), name
    assert not np.allclose(B[which == "plastic"].mean(axis=0), B[which == "diffuse"].mean(axis=0))


SEE_THROUGH = {
    "thindielectric": bsdf("thindielectric"),
    "half a mask": bsdf("mask", put(opacity=0.5), WOOD),
    "leaf": bsdf("mask", checks("opacity"), WOOD),
    "hair": bsdf("hair"),
    "polarizer": bsdf("polarizer"),
    "retarder": bsdf("retarder"),
    "circular": bsdf("circular"),
    "blended with nothing": bsdf("blendbsdf", put(weight=0.5), bsdf("null"), WOOD),
}


@pytest.mark.parametrize("case", SEE_THROUGH)
def test_what_light_passes_straight_through_is_refused(case, paint, refuses):
    path = paint / "pane.xml"
    path.write_text(
        f'<scene version="3.0.0">\n<shape type="cube" id="s">{SEE_THROUGH[case]}</shape>'
        f"{LAMP}</scene>"
    )
    with refuses(f"{path}: line 2: shape 's' is partly see-through"):
        render.load(path)


OUTSIDE = bsdf("diffuse")
BOTH = bsdf("twosided", bsdf("diffuse"))
SHAPES = {
    "sphere": ("", OUTSIDE),
    "cube": ("", OUTSIDE),
    "ply": ("cube.ply", OUTSIDE),
    "obj": ("cube.obj", OUTSIDE),
    "serialized": ("cube.serialized", OUTSIDE),
    "disk": ("", OUTSIDE),
    "rectangle": ("", OUTSIDE),
    "cylinder": ("", BOTH),
    "sdfgrid": ("ball.vol", OUTSIDE),
    "linearcurve": ("hair.txt", OUTSIDE),
    "bsplinecurve": ("hair.txt", OUTSIDE),
    "ellipsoids": ("cloud.ply", OUTSIDE),
}
UNSAMPLED = ("sdfgrid", "linearcurve", "bsplinecurve", "ellipsoids")


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """A folder with what the shapes are read from."""
    folder = tmp_path_factory.mktemp("shapes")
    render.load("box_one")  # sets Mitsuba's variant
    mi.load_dict({"type": "cube"}).write_ply(str(folder / "cube.ply"))
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    squares = ([1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6])
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["f " + " ".join(map(str, square)) for square in squares]
    (folder / "cube.obj").write_text("\n".join(lines))
    faces = [[a - 1, b - 1, c - 1] for p, q, r, t in squares for a, b, c in ((p, q, r), (p, r, t))]
    data = struct.pack("<I", 0x2000) + b"cube\0" + struct.pack("<QQ", 8, 12)
    data += np.array(corners, "<f8").tobytes() + np.array(faces, "<u4").tobytes()
    head = struct.pack("<HH", 0x041C, 4) + zlib.compress(data)
    (folder / "cube.serialized").write_bytes(head + struct.pack("<QI", 0, 1))
    (folder / "hair.txt").write_text("\n".join(f"{x} 0 {x * x} 0.05" for x in range(5)))
    grid = np.linspace(-1, 1, 9)
    far = np.sqrt(sum(x * x for x in np.meshgrid(grid, grid, grid))) - 0.7
    mi.VolumeGrid(far[..., None].astype(np.float32)).write(str(folder / "ball.vol"))
    names = [*"xyz", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3))]
    names += [f"f_rest_{i}" for i in range(45)] + ["opacity", *(f"scale_{i}" for i in range(3))]
    names += [f"rot_{i}" for i in range(4)]
    row = np.array([1.0 if name in ("rot_0", "opacity") else 0 for name in names], "<f4")
    text = ["ply", "format binary_little_endian 1.0", "element vertex 1"]
    text += [*(f"property float {name}" for name in names), "end_header\n"]
    (folder / "cloud.ply").write_bytes("\n".join(text).encode() + row.tobytes())
    return folder


@pytest.mark.slow
def test_every_shape_is_observed_or_named(files):
    """Points lie on it, and its normals point away from it; or it is named as not observed."""
    centres, shapes = {}, []
    for i, (name, (file, paint)) in enumerate(SHAPES.items()):
        centres[name] = x, y, z = np.array([1.5 * (i % 4) - 2.25, 1.5 * (i // 4) - 1.5, 0.5])
        shapes.append(
            f'<shape type="{name}" id="{name}">{put(filename=file) if file else ""}'
            f'<transform name="to_world"><scale value="0.4"/><translate x="{x}" y="{y}" z="{z}"/>'
            f"</transform>{paint}</shape>"
        )
    path = files / "shapes.xml"
    path.write_text(f'<scene version="3.0.0">{"".join(shapes)}{LAMP}</scene>')
    room = render.load(path)
    assert list(room.unobserved) == [f"shape '{name}'" for name in UNSAMPLED]
    assert all("whose area Mitsuba does not know" in why for why in room.unobserved.values())
    q = render.observe(room, points=800, transport="direct")
    np.testing.assert_allclose(q.radiance, rendered(room, q), rtol=1e-3, atol=1e-6)
    nearest = np.argmin([np.linalg.norm(q.positions - c, axis=1) for c in centres.values()], axis=0)
    for place, name in enumerate(centres):
        here = nearest == place
        assert (here.sum() > 20) == (name not in UNSAMPLED)
        away = (q.positions[here] - centres[name]) / 0.4
        if name in ("disk", "rectangle"):
            np.testing.assert_allclose(away[:, 2], 0, atol=1e-5)
        elif name == "cylinder":
            np.testing.assert_allclose(np.linalg.norm(away[:, :2], axis=1), 1, atol=1e-3)
        elif name == "sphere":
            np.testing.assert_allclose(q.normals[here], away, atol=1e-4)
        else:
            np.testing.assert_allclose(np.abs(away).max(axis=1, initial=1), 1, atol=1e-5)
            assert ((away * q.normals[here]).sum(axis=1) > 0.99).all()
