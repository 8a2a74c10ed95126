"""A room with what Cycles saw of it: triangles, observations, geometry for lightloc."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import lightloc
import render
from rooms.shapes import Design

Seen = Mapping[str, np.ndarray]


def design(name: str) -> Design:
    """The room, made anew."""
    return getattr(importlib.import_module(f"rooms.{name}"), name)()


def recording(name: str) -> Path:
    """The file of what Cycles saw."""
    return Path(__file__).with_name(f"{name}.npz")


def room(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, Seen]:
    """Vertices, faces, the albedo of each face, and what `rooms.render_cycles` saw.

    ``directions`` (n, 3), towards the camera, are added to its arrays.

    Raises
    ------
    ValueError
        If these are not the triangles that were rendered.
    """
    made = design(name)
    with np.load(recording(name)) as file:
        seen = dict(file)
    if str(seen["sha256"]) != made.sha256():
        raise ValueError(f"{name}: the triangles are not those that were rendered")
    away = seen["origin"] - seen["positions"]
    seen["directions"] = away / np.linalg.norm(away, axis=1, keepdims=True)
    return made.vertices, made.faces, made.albedo, seen


def geometry(vertices: np.ndarray, faces: np.ndarray) -> lightloc.Geometry:
    """Triangles as `lightloc` asks for them, through `render`."""
    rows = np.zeros(len(faces), dtype=[("n", "u1"), ("vertices", "<i4", 3)])
    rows["n"], rows["vertices"] = 3, faces
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    scene = (
        '<scene version="3.0.0"><shape type="ply"><string name="filename" value="room.ply"/>'
        '<boolean name="face_normals" value="true"/>'
        '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>'
        '<emitter type="point"/></scene>'  # a scene without a light is no room; it is not used
    )
    with tempfile.TemporaryDirectory() as folder:
        triangles = header.encode() + np.asarray(vertices, "<f4").tobytes() + rows.tobytes()
        (Path(folder) / "room.ply").write_bytes(triangles)
        (Path(folder) / "room.xml").write_text(scene)
        return render.load(Path(folder) / "room.xml").geometry


def observations(
    seen: Seen, lights: list[int], relative: float = 0.003, floor: float = 0.001
) -> lightloc.Observations:
    """The direct light of some of the lights; sigma is relative B + floor mean B."""
    B = seen["direct"][:, lights].sum(axis=1, dtype=float)
    return lightloc.Observations(
        positions=seen["positions"],
        normals=seen["normals"],
        directions=seen["directions"],
        radiance=B,
        sigma=relative * B + floor * B.mean(),
        material=lightloc.Lambert(albedo=seen["albedo"]),
    )


def agreement(seen: Seen, space: lightloc.Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Direct light by Eq. 1 without shadows, and whether a ray test sees each light: (n, k)."""
    q = observations(seen, [0])
    places = seen["light_positions"]
    formula = lightloc.shading(q, places)[:, :, 0] * seen["light_intensities"]
    return formula, lightloc.shading(q, places, space)[:, :, 0] > 0
