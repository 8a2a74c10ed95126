"""Meshes as scenes: a room as PLY, OBJ or glTF is the room that it is as Mitsuba's XML."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightloc
import render

# The room: walls, and a block in it, as squares with a colour in bytes of sRGB. Some face inwards
# and some outwards, as in a scan.
BOX = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], float)
SIDES = ([0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7])
LIGHTS = lightloc.PointLights(
    [[1.2, 0.8, 1.9], [3.1, 2.2, 1.4]], [[6.0, 4.0, 2.0], [2.0, 5.0, 7.0]]
)


def block(low: list[float], high: list[float]) -> np.ndarray:
    """(6, 4, 3) the sides of a box."""
    (x, y, z), (X, Y, Z) = low, high
    ring = [[x, y], [X, y], [X, Y], [x, Y]]
    return np.array([[*p, h] for h in (z, Z) for p in ring])[np.array(SIDES)]


SQUARES = np.concatenate([block([0, 0, 0], [4, 3, 2.5]), block([1.8, 1, 0], [2.3, 1.6, 0.9])])
BYTES = np.random.default_rng(5).integers(90, 230, (12, 3))


def linear(c: np.ndarray) -> np.ndarray:
    """The standard's own formula, IEC 61966-2-1."""
    c = np.asarray(c, float) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


ALBEDO = linear(BYTES)


def xml(folder: Path, albedo: np.ndarray = ALBEDO, bsdf: str = "") -> Path:
    """The room of Mitsuba's own rectangles, which no reader of ours has seen."""
    shapes = []
    for p, a in zip(SQUARES, np.broadcast_to(albedo, (12, 3)), strict=True):
        u, v = (p[1] - p[0]) / 2, (p[3] - p[0]) / 2
        n, c = np.cross(u, v) / np.linalg.norm(np.cross(u, v)), p.mean(axis=0)
        rows = " ".join(
            str(x) for x in np.column_stack([[*u, 0], [*v, 0], [*n, 0], [*c, 1]]).ravel()
        )
        own = bsdf or (
            f'<bsdf type="diffuse"><rgb name="reflectance" value="{a[0]} {a[1]} {a[2]}"/></bsdf>'
        )
        shapes.append(
            f'<shape type="rectangle"><transform name="to_world"><matrix value="{rows}"/>'
            f'</transform><bsdf type="twosided">{own}</bsdf></shape>'
        )
    file = folder / "reference.xml"
    file.write_text(f'<scene version="3.0.0">{"".join(shapes)}</scene>')
    return file


def ply(kind: str, colours: str, names: str = "red green blue", faces: str = "squares") -> bytes:
    """A PLY file of the room in one of three encodings, its colours at vertices or at faces."""
    order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    head = ["ply", f"format {kind} 1.0", "comment by hand", "element vertex 48"]
    head += [f"property float {axis}" for axis in "xyz"]
    own = [f"property uchar {name}" for name in names.split()]
    head += own if colours == "vertex" else []
    cuts = [[0, 1, 2, 3]] if faces == "squares" else [[0, 1, 2], [0, 2, 3]]
    if faces == "mixed":
        cuts = [[0, 1, 2, 3], [0, 1, 2]]
    head += [f"element face {12 * len(cuts)}", "property list uchar int vertex_indices"]
    head += own if colours == "face" else []
    body: list[tuple[str, list[Any]]] = []
    for p, c in zip(SQUARES.reshape(-1, 3), np.repeat(BYTES, 4, axis=0), strict=True):
        body.append(
            ("fff" + "BBB" * (colours == "vertex"), [*p, *(c if colours == "vertex" else [])])
        )
    for i, c in enumerate(BYTES):
        for cut in cuts:
            row = [len(cut), *(4 * i + k for k in cut), *(c if colours == "face" else [])]
            body.append(("B" + "i" * len(cut) + "BBB" * (colours == "face"), row))
    text = "\n".join([*head, "end_header", ""]).encode()
    if order is None:
        return text + "\n".join(" ".join(str(v) for v in row) for _, row in body).encode()
    return text + b"".join(struct.pack(order + kinds, *row) for kinds, row in body)


def obj(library: str = "room.mtl", *, negative: bool = False) -> str:
    """The room as OBJ, a material for each square, in two objects."""
    lines = [f"mtllib {library}"] if library else []
    for i, p in enumerate(SQUARES):
        lines += [f"o {'walls' if i < 6 else 'block'}"] if i in (0, 6) else []
        lines += [f"v {x:g} {y:g} {z:g}" for x, y, z in p]
        lines += [f"usemtl m{i}"] if library else []
        index = [-4, -3, -2, -1] if negative else [4 * i + k for k in (1, 2, 3, 4)]
        lines += ["f " + " ".join(str(k) for k in index)]
    return "\n".join(lines)


def mtl(*more: str) -> str:
    return "\n".join(
        f"newmtl m{i}\nKd {a[0]} {a[1]} {a[2]}\n" + "\n".join(more) for i, a in enumerate(ALBEDO)
    )


class Gltf:
    """A glTF file in the making."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.data = b""

    def add(self, table: str, entry: dict[str, Any]) -> int:
        self.tree.setdefault(table, []).append(entry)
        return len(self.tree[table]) - 1

    def view(self, data: bytes, **more: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        first, self.data = len(self.data), self.data + data
        own = {"buffer": 0, "byteOffset": first, "byteLength": len(data)}
        return self.add("bufferViews", own | more)

    def array(self, values: Any, kind: str, **more: Any) -> int:
        table = np.atleast_2d(np.asarray(values))
        code = {"<f4": 5126, "<u4": 5125, "<u2": 5123, "<u1": 5121, "<i2": 5122}[kind]
        shape = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[table.shape[1]]
        own = {"componentType": code, "count": len(table), "type": shape}
        return self.add(
            "accessors", own | {"bufferView": self.view(table.astype(kind).tobytes())} | more
        )

    def mesh(self, p: np.ndarray, material: int | None = None, **attributes: int) -> int:
        """One square."""
        own = {"POSITION": self.array(p, "<f4")} | attributes
        piece: dict[str, Any] = {
            "attributes": own,
            "indices": self.array(np.array([[0, 1, 2, 0, 2, 3]]).T, "<u2"),
        }
        return self.add(
            "meshes", {"primitives": [piece | ({} if material is None else {"material": material})]}
        )

    def paint(self, colour: Any, **more: Any) -> int:
        metal = {"baseColorFactor": [*map(float, colour), 1.0], "metallicFactor": 0.0}
        return self.add("materials", {"pbrMetallicRoughness": metal | more})

    def room(self) -> Gltf:
        for p, a in zip(SQUARES, ALBEDO, strict=True):
            self.add("nodes", {"mesh": self.mesh(p, self.paint(a))})
        return self

    def bytes(self) -> bytes:
        """As GLB."""
        tree = self.tree | {"buffers": [{"byteLength": len(self.data)}]}
        text = json.dumps(tree).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        size = 28 + len(text) + len(data)
        head = struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A)
        return head + text + struct.pack("<II", len(data), 0x004E4942) + data

    def text(self, uri: str) -> str:
        return json.dumps(self.tree | {"buffers": [{"byteLength": len(self.data), "uri": uri}]})


def nested() -> Gltf:
    """The room under nodes that move, turn, scale and mirror it."""
    g = Gltf()
    half = np.sqrt(0.5)
    for p, a in zip(SQUARES, ALBEDO, strict=True):
        q = (p - [1, 2, 3]) / [2, -1, 0.5]  # undone by the outer node
        q = q @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # and by the inner one
        g.add("nodes", {"mesh": g.mesh(q, g.paint(a))})
    scale, turn = [2, -1, 0.5], [0, 0, half, half]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.diag(scale), [1, 2, 3]
    g.add("nodes", {"children": list(range(12)), "rotation": turn})
    g.add("nodes", {"children": [12], "matrix": matrix.T.ravel().tolist()})
    g.tree |= {"scenes": [{"nodes": []}, {"nodes": [13]}], "scene": 1}
    return g


def sparse() -> Gltf:
    """Corners of zeros, over which the room's are written; colours at vertices, as bytes."""
    g = Gltf()
    for p, a in zip(SQUARES, ALBEDO, strict=True):
        mesh = g.mesh(np.zeros((4, 3)), COLOR_0=g.array(np.tile(a, (4, 1)), "<f4"))
        own = g.tree["accessors"][g.tree["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"]]
        del own["bufferView"]
        own["sparse"] = {
            "count": 4,
            "indices": {
                "bufferView": g.view(np.arange(4, dtype="<u2").tobytes()),
                "componentType": 5123,
            },
            "values": {"bufferView": g.view(p.astype("<f4").tobytes())},
        }
        g.add("nodes", {"mesh": mesh})
    return g


def strips() -> Gltf:
    """Squares as strips and fans, without indices; vertices among other data."""
    g = Gltf()
    for i, (p, a) in enumerate(zip(SQUARES, ALBEDO, strict=True)):
        q = p[[0, 1, 3, 2]] if i % 2 else p
        rows = np.concatenate([q, np.full((4, 2), 7.0)], axis=1).astype("<f4")
        view = g.view(rows.tobytes(), byteStride=20)
        at = {"componentType": 5126, "count": 4, "type": "VEC3", "bufferView": view}
        own = {"POSITION": g.add("accessors", at)}
        piece = {"attributes": own, "mode": 5 if i % 2 else 6, "material": g.paint(a)}
        g.add("nodes", {"mesh": g.add("meshes", {"primitives": [piece]})})
    return g


def beside(folder: Path) -> Path:
    g = Gltf().room()
    (folder / "the data.bin").write_bytes(g.data)
    (folder / "room.gltf").write_text(g.text("the%20data.bin"))
    return folder / "room.gltf"


def embedded() -> str:
    g = Gltf().room()
    return g.text("data:application/octet-stream;base64," + base64.b64encode(g.data).decode())


def pieces(folder: Path, name: str, data: str | bytes, *more: tuple[str, str]) -> Path:
    for file, text in more:
        (folder / file).write_text(text)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    return folder / name


LITTLE, BIG = "binary_little_endian", "binary_big_endian"
MTL = ("room.mtl", mtl())
ROOMS: dict[str, Callable[[Path], Path]] = {
    "ply, ascii": lambda to: pieces(to, "room.ply", ply("ascii", "vertex")),
    "ply, little endian": lambda to: pieces(to, "room.ply", ply(LITTLE, "vertex")),
    "ply, big endian": lambda to: pieces(to, "room.PLY", ply(BIG, "vertex")),
    "ply, triangles": lambda to: pieces(
        to, "room.ply", ply(BIG, "vertex", "diffuse_red diffuse_green diffuse_blue", "triangles")
    ),
    "ply, mixed polygons": lambda to: pieces(
        to, "room.ply", ply(LITTLE, "vertex", "r g b", "mixed")
    ),
    "ply, ascii, mixed": lambda to: pieces(to, "room.ply", ply("ascii", "face", faces="mixed")),
    "ply, colours of faces": lambda to: pieces(to, "room.ply", ply(LITTLE, "face")),
    "obj": lambda to: pieces(to, "room.obj", obj(), MTL),
    "obj, negative indices": lambda to: pieces(to, "room.obj", obj(negative=True), MTL),
    "glb": lambda to: pieces(to, "room.glb", Gltf().room().bytes()),
    "glb, nodes": lambda to: pieces(to, "room.glb", nested().bytes()),
    "glb, sparse": lambda to: pieces(to, "room.glb", sparse().bytes()),
    "glb, strips": lambda to: pieces(to, "room.glb", strips().bytes()),
    "gltf, a buffer beside": beside,
    "gltf, embedded": lambda to: pieces(to, "room.gltf", embedded()),
}


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The room by XML, and a few observations of it."""
    room = render.relight(render.load(xml(tmp_path_factory.mktemp("xml"))), LIGHTS)
    return room, render.observe(room, points=256, transport="direct")


@pytest.mark.parametrize("kind", ROOMS)
def test_a_mesh_is_the_room_that_it_was_made_of(kind, reference, tmp_path):
    """Twelve squares in twelve colours: B at every point, from either side, is that of XML."""
    room, q = reference
    mesh = render.load(ROOMS[kind](tmp_path))
    assert len(mesh.lights) == 0 and mesh.unit == ("m" if kind.startswith("gl") else "unit")
    np.testing.assert_allclose(mesh.bounds, room.bounds, atol=1e-6)
    seen = render.remeasure(render.relight(mesh, LIGHTS), q)
    same = np.isclose(seen.radiance, q.radiance, rtol=1e-4, atol=1e-6).all(axis=1)
    assert same.mean() > 0.98  # the rest lies at a shadow's edge


@pytest.mark.parametrize("kind", ["ply, ascii", "obj", "glb"])
def test_albedo_overrides_the_colours_of_a_mesh(kind, reference, tmp_path):
    q = reference[1]
    mesh = render.load(ROOMS[kind](tmp_path), albedo="0.5,0.4,0.3")
    other = render.remeasure(render.relight(mesh, LIGHTS), q)
    lit = q.radiance.min(axis=1) > 0
    ratio = other.radiance[lit] / q.radiance[lit]
    wanted = np.array([0.5, 0.4, 0.3]) / np.broadcast_to(q.material.albedo, (len(q), 3))[lit]
    assert np.isclose(ratio, wanted, rtol=1e-3).all(axis=1).mean() > 0.98
    assert (np.abs(ratio - 1) > 0.02).any(axis=1).mean() > 0.9  # or nothing would be shown above


def png(colours: np.ndarray) -> bytes:
    """A picture of (h, w, c) bytes."""
    h, w, c = colours.shape
    rows = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in colours)

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    head = struct.pack(">IIBBBBB", w, h, 8, {1: 0, 3: 2, 4: 6}[c], 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


# top left, top right, bottom left, bottom right
QUARTERS = np.array([[[200, 60, 60], [60, 180, 60]], [[60, 60, 220], [128, 128, 128]]])
PICTURE = png(np.kron(QUARTERS, np.ones((8, 8, 1), int)))
FLOOR = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
UP = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)  # from the bottom left, as PLY and OBJ
DOWN = UP * [1, -1] + [0, 1]  # from the top left, as glTF


def floor_ply(folder: Path) -> Path:
    head = ["ply", "format ascii 1.0", "comment TextureFile wall.png", "element vertex 4"]
    head += [f"property float {name}" for name in ("x", "y", "z", "s", "t")]
    head += ["element face 1", "property list uchar int vertex_index", "end_header"]
    rows = [" ".join(map(str, row)) for row in np.concatenate([FLOOR, UP], axis=1)]
    (folder / "wall.png").write_bytes(PICTURE)
    return pieces(folder, "floor.ply", "\n".join([*head, *rows, "4 0 1 2 3"]))


def floor_wedges(folder: Path) -> Path:
    head = ["ply", f"format {LITTLE} 1.0", "comment TextureFile wall.png", "element vertex 4"]
    head += [f"property float {name}" for name in "xyz"]
    head += ["element face 1", "property list uchar int vertex_index"]
    head += ["property list uchar float texcoord", "end_header\n"]
    data = FLOOR.astype("<f4").tobytes() + struct.pack("<BiiiiB8f", 4, 0, 1, 2, 3, 8, *UP.ravel())
    (folder / "wall.png").write_bytes(PICTURE)
    return pieces(folder, "floor.ply", "\n".join(head).encode() + data)


def floor_obj(folder: Path) -> Path:
    lines = ["mtllib floor.mtl", "usemtl wall"]
    lines += [f"v {x} {y} {z}" for x, y, z in FLOOR] + [f"vt {u} {v}" for u, v in UP]
    lines += ["vn 0 0 1", "f 1/1/1 2/2/1 3/3/1 4/4/1"]
    (folder / "wall.png").write_bytes(PICTURE)
    return pieces(
        folder,
        "floor.obj",
        "\n".join(lines),
        ("floor.mtl", "newmtl wall\nKd 1 1 1\nmap_Kd wall.png"),
    )


def floor_glb(folder: Path) -> Path:
    g = Gltf()
    g.add("images", {"bufferView": g.view(PICTURE), "mimeType": "image/png"})
    g.add("textures", {"source": 0})
    paint = g.add(
        "materials",
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}},
    )
    normal = g.array(np.tile([0, 0, 1], (4, 1)), "<f4")
    mesh = g.mesh(FLOOR, paint, TEXCOORD_0=g.array(DOWN, "<f4"), NORMAL=normal)
    g.add("nodes", {"mesh": mesh})
    return pieces(folder, "floor.glb", g.bytes())


@pytest.mark.parametrize("made", [floor_ply, floor_wedges, floor_obj, floor_glb])
def test_a_picture_lies_on_a_mesh_as_it_is_seen(made, tmp_path):
    """Its four quarters, in sRGB, are albedo where they lie."""
    path = made(tmp_path)
    lamp = lightloc.PointLights([[0.1, 0.2, 1.5]], [5.0])
    room = render.relight(render.load(path), lamp)
    q = render.observe(room, points=64, transport="direct")
    x, y, _ = q.positions.T
    size = np.abs([x, y])
    clear = ((size > 0.2) & (size < 0.9)).all(axis=0)  # from the edges of its quarters
    want = linear(QUARTERS[(y < 0).astype(int), (x > 0).astype(int)])
    np.testing.assert_allclose(
        np.broadcast_to(q.material.albedo, (64, 3))[clear], want[clear], rtol=1e-4
    )
    names = [file.name for file in render.files_of(path)]
    assert (
        names
        == {
            ".ply": ["floor.ply", "wall.png"],
            ".obj": ["floor.obj", "floor.mtl", "wall.png"],
            ".glb": ["floor.glb"],
        }[path.suffix]
    )


def test_the_lights_and_cameras_of_gltf(tmp_path):
    """Point lights are the truth; a spot and the sun are known light; a camera sees its room."""
    g = Gltf()
    g.add(
        "nodes",
        {
            "mesh": g.mesh(
                FLOOR * 20,
                g.paint([0.5, 0.5, 0.5]),
            )
        },
    )
    red = g.mesh(FLOOR * [0.2, 0.2, 1] + [1, 0, 0.01], g.paint([0.8, 0.1, 0.1]))
    blue = g.mesh(FLOOR * [0.2, 0.2, 1] + [0, 0.7, 0.01], g.paint([0.1, 0.1, 0.8]))
    for mesh in (red, blue):
        g.add("nodes", {"mesh": mesh})
    lights = [
        {"type": "point", "intensity": 50, "color": [1, 0.5, 0.25]},
        {"type": "spot", "intensity": 9, "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.6}},
        {"type": "directional", "intensity": 2, "name": "sun"},
    ]
    g.tree["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    g.tree["extensionsUsed"] = g.tree["extensionsRequired"] = ["KHR_lights_punctual"]
    for i, place in enumerate([[0.5, -0.5, 2], [5, 0, 3], [0, 0, 9]]):
        own = {"KHR_lights_punctual": {"light": i}}
        g.add(
            "nodes", {"translation": place, "scale": [2, 2, 2], "extensions": own, "name": f"l{i}"}
        )
    camera = {"type": "perspective", "perspective": {"yfov": 1.0, "aspectRatio": 2.0, "znear": 0.1}}
    g.add("cameras", camera)
    g.add("nodes", {"camera": 0, "translation": [0, 0, 3], "name": "eye"})
    path = pieces(tmp_path, "lit.glb", g.bytes())
    room = render.load(path)
    np.testing.assert_allclose(room.lights.positions, [[0.5, -0.5, 2]])
    np.testing.assert_allclose(room.lights.intensities, [[50, 25, 12.5]])
    assert (room.unit, room.lights.power) == ("m", "cd")
    q = render.observe(room, points=8, spp=2)
    assert (q.unit, q.intensity_unit) == ("m", "cd")
    dark = render.relight(room, lightloc.PointLights(np.zeros((0, 3)), np.zeros((0, 1))))
    q = render.observe(dark, points=2048, transport="direct")
    grey = np.isclose(np.broadcast_to(q.material.albedo, (2048, 3))[:, 0], 0.5)
    d = np.linalg.norm(q.positions - [5, 0, 3], axis=1)
    angle = np.arccos(3 / d)
    inside = (angle < 0.49) & grey
    lit = 0.5 / np.pi * (2 + np.where(angle < 0.5, 9 * 3 / d**3, 0))
    assert inside.sum() > 2
    for here in (inside, (angle > 0.61) & grey):
        np.testing.assert_allclose(
            q.radiance[here], np.tile(lit[here, None], q.channels), rtol=1e-3
        )
    view = render.photograph(room, width=64, transport="direct")
    assert view.size == (64, 32)
    redness = view.albedo @ [1, 0, -1]
    rows, columns = np.nonzero(redness > 0.3)
    half = 16 / np.tan(0.5)  # pixels of one radian's tangent, the height being yfov
    assert abs(columns.mean() + 0.5 - (32 + half * 1 / 2.99)) < 1
    assert abs(rows.mean() + 0.5 - 16) < 1
    rows, columns = np.nonzero(redness < -0.3)
    assert abs(rows.mean() + 0.5 - (16 - half * 0.7 / 2.99)) < 1
    assert len(render.load(path, find=["l0"]).lights) == 1


def test_a_gltf_material_that_is_not_diffuse_is_mitsuba_s_principled(tmp_path):
    """As one of XML with the same values; a map of roughness and metalness is read by channels."""
    g = Gltf()
    g.add(
        "images",
        {"bufferView": g.view(png(np.full((2, 2, 3), [9, 128, 51]))), "mimeType": "image/png"},
    )
    g.add("textures", {"source": 0})
    paint = g.paint(
        [0.6, 0.5, 0.4],
        roughnessFactor=0.5,
        metallicFactor=1.0,
        metallicRoughnessTexture={"index": 0},
    )
    place = g.array(DOWN, "<f4")
    for p in SQUARES:
        g.add("nodes", {"mesh": g.mesh(p, paint, TEXCOORD_0=place)})
    rough, metal = 0.5 * 128 / 255, 51 / 255
    bsdf = (
        '<bsdf type="principled"><rgb name="base_color" value="0.6 0.5 0.4"/>'
        f'<float name="roughness" value="{rough}"/><float name="metallic" value="{metal}"/>'
        '<float name="eta" value="1.5"/></bsdf>'
    )
    room = render.relight(render.load(xml(tmp_path, bsdf=bsdf)), LIGHTS)
    q = render.observe(room, points=128, transport="direct")
    mesh = render.load(pieces(tmp_path, "room.glb", g.bytes()))
    seen = render.remeasure(render.relight(mesh, LIGHTS), q)
    same = np.isclose(seen.radiance, q.radiance, rtol=2e-3, atol=1e-5).all(axis=1)
    assert same.mean() > 0.97


def test_a_lamp_of_gltf_is_known_light(tmp_path):
    """Emission is subtracted, and the lamp is left out by its name."""
    g = Gltf()
    g.add("nodes", {"mesh": g.mesh(FLOOR, g.paint([0.5, 0.5, 0.5]))})
    lamp = {
        "emissiveFactor": [1, 1, 1],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}},
    }
    paint = g.add("materials", {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}} | lamp)
    down = (FLOOR * 0.1 + [0, 0, 1])[::-1]
    g.add("nodes", {"mesh": g.mesh(down, paint), "name": "panel"})
    room = render.load(pieces(tmp_path, "lamp.glb", g.bytes()))
    assert room.unobserved == {"shape 'panel'": "emits light"}
    q = render.observe(room, points=64, spp=256, transport="direct")
    d2 = (q.positions**2).sum(axis=1) + 1
    want = 0.5 / np.pi * 3 * 0.04 / d2**2
    ratio = q.radiance.mean() / want.mean()
    assert abs(ratio - 1) < 0.05  # the panel is no point
    other = render.load(tmp_path / "lamp.glb", albedo=0.25)
    half = render.remeasure(other, q, spp=256).radiance.mean() / q.radiance.mean()
    assert abs(half - 0.5) < 0.02


def test_what_a_mesh_has_no_use_for_changes_nothing(tmp_path, reference):
    """Faces without an area, points of no face, an unused vertex that is not finite or far away."""
    _, q = reference
    room, odd = obj(""), obj("") + "\nv nan nan nan\nv 900 0 0\nf 1 1 2\nf 1 2 1\np 50\nl 1 2\n"
    rooms = [
        render.relight(render.load(pieces(tmp_path, name, text), albedo=0.5), LIGHTS)
        for name, text in (("room.obj", room), ("odd.obj", odd))
    ]
    np.testing.assert_array_equal(rooms[0].bounds, rooms[1].bounds)
    a, b = (render.remeasure(one, q).radiance for one in rooms)
    np.testing.assert_array_equal(a, b)


def test_a_concave_polygon_is_the_area_that_it_encloses(tmp_path):
    """An L of six corners, whichever comes first, has an area of 3, and no triangle beside it."""
    corners = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    for first in range(6):
        lines = [f"v {x} {y} 0" for x, y in np.roll(corners, -first, axis=0)] + ["f 1 2 3 4 5 6"]
        room = render.load(pieces(tmp_path, "l.obj", "\n".join(lines)), albedo=0.5)
        v, f = render.triangles(room)
        p = v[f]
        area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
        centre = p.mean(axis=1)
        assert np.isclose(area.sum(), 3) and not (centre[:, :2] > 1).all(axis=1).any()


def test_a_star_is_cut_as_it_is_drawn(tmp_path):
    """Whichever way it faces and turns: its area is that of the shoelace formula."""
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    x, y = np.array([np.cos(angle), np.sin(angle)]) * np.where(np.arange(40) % 2, 1, 0.3)
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    for axes in ([x, y, 0 * x], [y, x, x + y], [0 * x, y, x], [y, 2 * x, x]):
        p = np.stack(axes, axis=1)
        lines = [f"v {a} {b} {c}" for a, b, c in p] + ["f " + " ".join(map(str, range(1, 41)))]
        v, f = render.triangles(
            render.load(pieces(tmp_path, "star.obj", "\n".join(lines)), albedo=0.5)
        )
        q = v[f]
        found = np.linalg.norm(np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), axis=1).sum() / 2
        u, w = (np.linalg.lstsq(np.stack([x, y], axis=1), p, rcond=None)[0][k] for k in (0, 1))
        assert np.isclose(found, area * np.linalg.norm(np.cross(u, w)), rtol=1e-5)


def test_a_search_finds_the_lights_of_a_mesh(tmp_path):
    """As in any room: from direct light, to its errors."""
    lights = lightloc.PointLights(LIGHTS.positions, [5.0, 3.0])
    room = render.load(pieces(tmp_path, "room.ply", ply(LITTLE, "vertex")), albedo=0.5)
    q = render.observe(render.relight(room, lights), points=200, transport="direct")
    found = lightloc.localize(q, room.geometry)
    assert found.reason is lightloc.Reason.CONVERGED and len(found.lights) == 2
    np.testing.assert_allclose(found.lights.positions, lights.positions, atol=1e-3)
    np.testing.assert_allclose(found.lights.intensities[:, 0], [5, 3], rtol=1e-3)


def header(*lines: str) -> bytes:
    return "\n".join(["ply", *lines, "end_header", ""]).encode()


POINTS = ["element vertex 3", *(f"property float {axis}" for axis in "xyz")]
ONE_FACE = ["element face 1", "property list uchar int vertex_indices"]
ASCII, CORNERS = "format ascii 1.0", b"0 0 0 1 0 0 0 1 0 "
SQUARE = "\n".join(f"v {x} {y} {z}" for x, y, z in FLOOR)
USES = f"mtllib a.mtl\n{SQUARE}\nusemtl wall\nf 1 2 3 4"


def changed(change: Callable[[Gltf], Any]) -> bytes:
    """A square in glTF with something else in it."""
    g = Gltf()
    mesh = g.mesh(FLOOR, g.paint([0.5, 0.5, 0.5]))
    g.add("nodes", {"mesh": mesh, "name": "floor"})
    change(g)
    return g.bytes()


def material(**more: Any) -> Callable[[Gltf], None]:
    return lambda g: g.tree["materials"][0].update(more)


def metal(**more: Any) -> Callable[[Gltf], None]:
    return lambda g: g.tree["materials"][0]["pbrMetallicRoughness"].update(more)


def piece(**more: Any) -> Callable[[Gltf], None]:
    return lambda g: g.tree["meshes"][0]["primitives"][0].update(more)


def node(**more: Any) -> Callable[[Gltf], None]:
    return lambda g: g.tree["nodes"][0].update(more)


def accessor(number: int, **more: Any) -> Callable[[Gltf], None]:
    return lambda g: g.tree["accessors"][number].update(more)


DRACO = "KHR_draco_mesh_compression"
REFUSED: dict[str, tuple[str, Any, dict[str, Any], str]] = {
    "ply: no colours": (
        "a.ply",
        header(ASCII, *POINTS, *ONE_FACE) + CORNERS + b"3 0 1 2",
        {},
        "has no colours; expected albedo=",
    ),
    "ply: points": ("a.ply", header(ASCII, *POINTS) + CORNERS, {}, "point cloud of 3 points"),
    "ply: an index too high": (
        "a.ply",
        header(ASCII, *POINTS, *ONE_FACE) + CORNERS + b"3 0 1 9",
        {"albedo": 0.5},
        "refers to vertex 9; expected an index from 0 below 3",
    ),
    "ply: an index below zero": (
        "a.ply",
        header(ASCII, *POINTS, *ONE_FACE) + CORNERS + b"3 0 1 -2",
        {"albedo": 0.5},
        "refers to vertex -2",
    ),
    "ply: not a number": (
        "a.ply",
        header(ASCII, *POINTS, *ONE_FACE) + b"0 0 0 1 nan 0 0 1 0 3 0 1 2",
        {"albedo": 0.5},
        "vertex 1 has a x y z that is not finite",
    ),
    "ply: no area": (
        "a.ply",
        header(ASCII, *POINTS, *ONE_FACE) + b"0 0 0 1 0 0 2 0 0 3 0 1 2",
        {"albedo": 0.5},
        "no face with an area",
    ),
    "ply: cut off": (
        "a.ply",
        header(f"format {LITTLE} 1.0", *POINTS, *ONE_FACE) + b"1234",
        {"albedo": 0.5},
        "ends or breaks within its data",
    ),
    "ply: is none": ("a.ply", b"solid", {}, "is no PLY file"),
    "ply: empty": ("a.ply", b"", {}, "is no PLY file"),
    "ply: unknown type": (
        "a.ply",
        header(ASCII, "element vertex 3", "property half x"),
        {},
        "property half x",
    ),
    "ply: too many": (
        "a.ply",
        header(f"format {BIG} 1.0", "element vertex 99999999999999", *POINTS[1:], *ONE_FACE),
        {"albedo": 0.5},
        "ends or breaks",
    ),
    "ply: no x": ("a.ply", header(ASCII, "element vertex 0", "property float y"), {}, "x, y and z"),
    "ply: no picture": (
        "a.ply",
        floor_ply,
        {},
        "names the picture wall.png, which is missing; or pass albedo=",
    ),
    "albedo of 150": ("a.obj", SQUARE, {"albedo": 150}, "albedo is 150; expected one number"),
    "albedo of two": ("a.obj", SQUARE, {"albedo": "0.5,0.5"}, "albedo is 0.5,0.5; expected"),
    "albedo by name": ("a.obj", SQUARE, {"albedo": "grey"}, "albedo is grey; expected"),
    "another parameter": ("a.obj", SQUARE, {"alpha": 1}, "no parameter 'alpha' (it has: albedo)"),
    "obj: no colours": ("a.obj", f"{SQUARE}\nf 1 2 3 4", {}, "has no colours; expected albedo="),
    "obj: points": ("a.obj", SQUARE, {}, "has 4 points and no face"),
    "obj: an index too high": (
        "a.obj",
        f"{SQUARE}\nf 1 2 9",
        {},
        "line 5: a face refers to 9 of 4",
    ),
    "obj: an index of zero": ("a.obj", f"{SQUARE}\nf 0 1 2", {}, "line 5: a face refers to 0"),
    "obj: an index far back": ("a.obj", f"{SQUARE}\nf -9 1 2", {}, "line 5: a face refers to -9"),
    "obj: a star of many corners": (
        "a.obj",
        "\n".join(
            [
                f"v {np.cos(t) * (1 + i % 2)} {np.sin(t)} 0"
                for i, t in enumerate(np.linspace(0, 6, 2001))
            ]
            + ["f " + " ".join(str(i) for i in range(1, 2002))]
        ),
        {"albedo": 0.5},
        "is not convex has 2001 corners; expected at most 2000",
    ),
    "obj: a word": ("a.obj", "v 0 0 zork", {}, "line 1: 'v 0 0 zork' can't be read"),
    "obj: two numbers": ("a.obj", "v 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3", {}, "fewer than 3"),
    "obj: no library": (
        "a.obj",
        USES.replace("a.mtl", "b.mtl"),
        {},
        "names b.mtl, which is missing",
    ),
    "obj: no such material": (
        "a.obj",
        USES.replace("usemtl wall", "usemtl x"),
        {},
        "'x' has no colours",
    ),
    "mtl: glass": ("a.obj", USES, {"mtl": "d 0.5"}, "material 'wall' is see-through"),
    "mtl: a mirror": ("a.obj", USES, {"mtl": "illum 3"}, "material 'wall' is a mirror"),
    "mtl: too white": (
        "a.obj",
        USES,
        {"mtl": "Kd 2 2 2"},
        "has Kd [2.0, 2.0, 2.0]; expected 0 to 1",
    ),
    "mtl: a word": ("a.obj", USES, {"mtl": "Kd red"}, "a.mtl, line 2: 'Kd red' can't be read"),
    "mtl: two numbers": (
        "a.obj",
        USES,
        {"mtl": "Kd 0.5 0.5"},
        "line 2: 'Kd 0.5 0.5' can't be read",
    ),
    "mtl: no picture": ("a.obj", USES, {"mtl": "map_Kd b.png"}, "names b.png, which is missing"),
    "mtl: an option": ("a.obj", USES, {"mtl": "map_Kd -s 2 2 2 a.png"}, "can't be read"),
    "mtl: no coordinates": ("a.obj", USES, {"mtl": "map_Kd a.png"}, "no texture coordinates"),
    "mtl: no PNG": ("a.obj", USES, {"mtl": "map_Kd a.obj"}, "a.obj: the picture can't be read"),
    "glb: is none": ("a.glb", b"glTF", {}, "is no glTF file, or is cut off"),
    "gltf: is none": ("a.gltf", b"{}", {}, "is no glTF file"),
    "gltf: version 1": ("a.gltf", '{"asset": {"version": "1.0"}}', {}, "is glTF 1.0; expected"),
    "glb: empty": ("a.glb", Gltf().bytes(), {}, "has no surface"),
    "glb: no colours": ("a.glb", changed(piece(material=None)), {}, "is broken"),
    "glb: no material": (
        "a.glb",
        changed(lambda g: g.tree["meshes"][0]["primitives"][0].pop("material")),
        {},
        "mesh 'floor' has no colours; expected albedo=",
    ),
    "glb: a material without colours": (
        "a.glb",
        changed(material(pbrMetallicRoughness={})),
        {},
        "mesh 'floor' has no colours; expected albedo=",
    ),
    "glb: draco": (
        "a.glb",
        changed(lambda g: g.tree.update(extensionsRequired=[DRACO])),
        {},
        DRACO,
    ),
    "glb: draco in a mesh": ("a.glb", changed(piece(extensions={DRACO: {}})), {}, DRACO),
    "glb: glass": (
        "a.glb",
        changed(material(extensions={"KHR_materials_transmission": {}})),
        {},
        "material '' has KHR_materials_transmission",
    ),
    "glb: see-through": (
        "a.glb",
        changed(
            lambda g: g.tree["materials"][0].update(
                alphaMode="BLEND", pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 0.5]}
            )
        ),
        {},
        "is partly see-through",
    ),
    "glb: a skin": ("a.glb", changed(node(skin=0)), {}, "node 'floor' has a skin"),
    "glb: morphed": ("a.glb", changed(node(weights=[0.5])), {}, "node 'floor' is morphed"),
    "glb: within itself": ("a.glb", changed(node(children=[0])), {}, "has no surface"),
    "glb: a scene within itself": (
        "a.glb",
        changed(lambda g: (node(children=[0])(g), g.tree.update(scenes=[{"nodes": [0]}]))),
        {},
        "within itself",
    ),
    "glb: an index too high": (
        "a.glb",
        changed(accessor(0, count=2)),
        {},
        "mesh 'floor' refers to vertex 3; expected an index below 2",
    ),
    "glb: more than is there": ("a.glb", changed(accessor(0, count=9**9)), {}, "is broken"),
    "glb: endless zeros": (
        "a.glb",
        changed(lambda g: (accessor(0, count=9**12)(g), g.tree["accessors"][0].pop("bufferView"))),
        {},
        "is broken",
    ),
    "glb: an unknown type": ("a.glb", changed(accessor(0, componentType=1)), {}, "is broken"),
    "glb: no picture": (
        "a.glb",
        changed(metal(baseColorTexture={"index": 0})),
        {},
        "is broken",
    ),
    "glb: a texture that is moved": (
        "a.glb",
        changed(metal(baseColorTexture={"index": 0, "extensions": {"KHR_texture_transform": {}}})),
        {},
        "KHR_texture_transform",
    ),
    "gltf: no buffer": ("a.gltf", Gltf().room().text("b.bin"), {}, "names b.bin, which is missing"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_mesh_that_cannot_be_taken_is_refused(case, tmp_path, refuses):
    """In one sentence that begins with the file."""
    name, data, parameters, said = REFUSED[case]
    if callable(data):
        path = data(tmp_path)
        (tmp_path / "wall.png").unlink()
    else:
        path = pieces(tmp_path, name, data)
    (tmp_path / "a.mtl").write_text("newmtl wall\n" + parameters.get("mtl", ""))
    (tmp_path / "a.png").write_bytes(PICTURE)
    with refuses(str(path)) as refused:
        render.load(path, **{key: value for key, value in parameters.items() if key != "mtl"})
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_what_was_not_taken_is_said(tmp_path):
    (tmp_path / "a.mtl").write_text("newmtl wall\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nillum 2\n")
    room = render.load(pieces(tmp_path, "a.obj", USES))
    assert len(room.notes) == 1 and "highlights (Ks) of 1 of 1 materials" in room.notes[0]
    assert render.load(room.path, albedo=0.5).notes == ()
