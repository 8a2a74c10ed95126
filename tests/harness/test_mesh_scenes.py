"""Meshes as scenes: a room as PLY, OBJ or glTF is the room that it is as Mitsuba's XML."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
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
        q = (p - [1, 2, 3]) / [2, -1, 0.5]  # undone by the inner node
        q = q @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # and by the outer one
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
    assert len(mesh.lights) == 0 and mesh.unit == ("m" if "gl" in kind else "unit")
    np.testing.assert_allclose(mesh.bounds, room.bounds, atol=1e-6)
    seen = render.remeasure(render.relight(mesh, LIGHTS), q)
    same = np.isclose(seen.radiance, q.radiance, rtol=1e-4, atol=1e-6).all(axis=1)
    assert same.mean() > 0.98  # the rest lies at a shadow's edge
    own = render.observe(render.relight(mesh, LIGHTS), points=64, transport="direct")
    S = lightloc.radiance(own, LIGHTS, mesh.geometry)
    np.testing.assert_allclose(S, own.radiance, rtol=1e-4, atol=1e-6)
    other = render.remeasure(
        render.relight(render.load(mesh.path, albedo="0.5,0.4,0.3"), LIGHTS), q
    )
    lit = q.radiance.min(axis=1) > 0  # a negative control: other colours give another B
    ratio = other.radiance[lit] / q.radiance[lit]
    wanted = np.array([0.5, 0.4, 0.3]) / albedo_of(q)[lit]
    assert np.isclose(ratio, wanted, rtol=1e-3).all(axis=1).mean() > 0.98
    assert (np.abs(ratio - 1) > 0.02).any(axis=1).mean() > 0.9


def albedo_of(q: lightloc.Observations) -> np.ndarray:
    return np.broadcast_to(q.material.albedo, (len(q), 3))
