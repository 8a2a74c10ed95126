"""Good files of each format, as the product or a user's tools write them."""

from __future__ import annotations

import functools
import importlib
import struct
import tempfile
import zlib
from pathlib import Path

import numpy as np

VERTICES = [(-0.3, -0.3, 0.3), (0.3, -0.3, 0.3), (0.0, 0.3, 0.3), (0.0, 0.0, 0.6)]
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]
HEADER = """ply
format {} 1.0
comment four triangles
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float u
property float v
property uchar red
element face 4
property list uchar int vertex_indices
end_header
"""


def meshes() -> dict[str, bytes]:
    """A pyramid in each format of meshes, by the name of its file."""
    rows = [(*v, 0.0, 0.6, 0.8, v[0] + 0.5, v[1] + 0.5, 200) for v in VERTICES]
    lines = [*(" ".join(map(str, row)) for row in rows), *(f"3 {a} {b} {c}" for a, b, c in FACES)]
    ascii_ = HEADER.format("ascii") + "\n".join(lines) + "\n"
    binary = {}
    for name, order in (("little", "<"), ("big", ">")):
        body = b"".join(struct.pack(f"{order}8fB", *row) for row in rows)
        body += b"".join(struct.pack(f"{order}B3i", 3, *face) for face in FACES)
        binary[f"{name}.ply"] = HEADER.format(f"binary_{name}_endian").encode() + body
    obj = [*("v {} {} {}".format(*v) for v in VERTICES), "vn 0 0 1", "vt 0.5 0.5"]
    obj += ["f {}/1/1 {}/1/1 {}/1/1".format(*(i + 1 for i in face)) for face in FACES]
    obj += ["f 1 2 3 4", "usemtl a", "o b"]
    return {
        "ascii.ply": ascii_.encode(),
        **binary,
        "mesh.obj": "\n".join(obj).encode(),
        "mesh.serialized": serialized(zlib.compress(plain())),
    }


def plain(count: int = 4, faces: int = 4, flags: int = 0x1000) -> bytes:
    """What a serialized mesh holds before it is compressed, of the counts that it claims."""
    return (
        struct.pack("<I", flags)
        + b"mesh\0"
        + struct.pack("<QQ", count, faces)
        + np.array(VERTICES, "<f4").tobytes()
        + np.array(FACES, "<u4").tobytes()
    )


def serialized(body: bytes, version: int = 4, offset: int = 0, count: int = 1) -> bytes:
    """Mitsuba's own format of meshes around one body."""
    return struct.pack("<HH", 0x041C, version) + body + struct.pack("<QI", offset, count)


def grid() -> bytes:
    """A volume grid of 2 x 2 x 2 values."""
    head = b"VOL\x03" + struct.pack("<5i6f", 1, 2, 2, 2, 1, 0, 0, 0, 1, 1, 1)
    return head + np.linspace(0, 0.8, 8, dtype="<f4").tobytes()


def texts() -> dict[str, bytes]:
    """Spectra and hair."""
    return {
        "grey.spd": b"# nm, share\n400 0.5\n500 0.4\n700 0.5\n",
        "hair.txt": b"0 0 0.2 0.01\n0.1 0 0.2 0.01\n0.2 0 0.2 0.01\n0.3 0 0.3 0.01\n",
    }


@functools.cache
def pictures() -> dict[str, bytes]:
    """A picture of 4 x 4 pixels in each format that a bitmap may have."""
    import lightloc  # noqa: F401 - before mitsuba
    from render.variant import two_threads, use_mitsuba

    use_mitsuba()
    import mitsuba as mi

    values = np.linspace(0.1, 0.8, 48, dtype=np.float32).reshape(4, 4, 3)
    made = mi.Bitmap(values)
    bytes_ = made.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True)
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("png", "jpg", "ppm", "exr", "hdr", "pfm"):
            path = Path(folder) / f"picture.{kind}"
            with two_threads():
                (made if kind in ("exr", "hdr", "pfm") else bytes_).write(str(path))
            found[path.name] = path.read_bytes()
    header = struct.pack("<2sIHHI", b"BM", 102, 0, 0, 54)
    header += struct.pack("<IiiHHIIiiII", 40, 4, 4, 1, 24, 0, 48, 1, 1, 0, 0)
    found["picture.bmp"] = header + bytes(range(100, 148))
    return found


@functools.cache
def written() -> dict[str, bytes]:
    """What the product writes, by the name of its file."""
    import lightloc
    import render  # before mitsuba
    from render.variant import two_threads

    mi = importlib.import_module("mitsuba")

    room = render.load("box_mixed")
    q = render.observe(room, points=24, spp=2, noise=0.01)
    lights = lightloc.PointLights([[0, 0, 1], [1, 0, 2]], [[1, 2, 3], [4, 5, 6]])
    floor = np.random.default_rng(0).uniform(-1, 1, (60, 3)) * [1, 1, 0]
    readings = lightloc.Observations(
        positions=floor,
        normals=[[0, 0, 1]] * 60,
        radiance=np.zeros(60),
        sigma=0.01,
        material=lightloc.Irradiance(),
    )
    B = lightloc.radiance(readings, lightloc.PointLights([[0.2, 0.1, 0.5]], [10.0]))
    found = lightloc.localize(readings.with_radiance(B, 0.01), bounds=[[-1, -1, 0.1], [1, 1, 1]])
    picture = render.photograph(render.load("box_one"), width=8, transport="direct")
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        q.save(at / "seen.npz")
        readings.save(at / "readings.npz")
        found.save(at / "found.npz")
        lights.save(at / "lights.json")
        (at / "answer.json").write_text(__import__("json").dumps(found.to_dict()))
        render.write_exr(picture, at / "view.exr")
        layers = picture.position, picture.normal, picture.albedo, picture.radiance
        plain = mi.Bitmap(
            np.concatenate(layers, axis=2),
            mi.Bitmap.PixelFormat.MultiChannel,
            [f"{name}.{c}" for name in ("P", "N", "albedo") for c in "XYZ"] + ["R", "G", "B"],
        )
        with two_threads():
            plain.write(str(at / "plain.exr"))
        return {path.name: path.read_bytes() for path in sorted(at.iterdir())}


SUITE = b"""name = "mine"
[defaults]
points = 64
spp = 4
[[case]]
name = "one-direct"
scene = "box_one"
brdf = "diffuse"
claim = "One light."
transport = "direct"
parameters = { alpha = 0.2 }
bounds = [[0, 0, 0], [4, 3, 2.5]]
lights = [[1, 1, 1, 5.0]]
seed = 7
noise = 0.01
position_percent = 0.5
intensity_percent = 5
"""
