"""A mesh file as a scene: PLY, OBJ and glTF, their surfaces two-sided, their lights the truth."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.gltf import gltf_files, read_gltf
from render.obj import obj_files, read_obj
from render.part import Part, Parts, colour
from render.ply import ply_files, read_ply
from render.scene_file import SceneFile

READERS: dict[str, Callable[[Path, bool], Parts]] = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".glb": read_gltf,
    ".gltf": read_gltf,
}
NAMERS = {".ply": ply_files, ".obj": obj_files, ".glb": gltf_files, ".gltf": gltf_files}
METRES = (".glb", ".gltf")  # glTF's unit, by its specification
FLAT = 1e-12  # a face of less than this share of its longest side's square has no area


def is_mesh(path: Path) -> bool:
    """Whether a file is a mesh, by its name."""
    return path.suffix.lower() in READERS


@np.errstate(all="ignore")  # what is not finite is refused, or belongs to no face
def read_mesh(path: Path, parameters: Mapping[str, Any]) -> SceneFile:
    """A mesh file as a scene that Mitsuba has parsed, its one parameter ``albedo``.

    Raises ValueError, in one sentence with the file, where it can't be read, has no colours and no
    albedo is given, or something in it is not modelled.
    """
    unknown = next((name for name in parameters if name != "albedo"), None)
    if unknown is not None:
        raise ValueError(f"{path}: has no parameter '{unknown}' (it has: albedo)")
    albedo = None
    if parameters.get("albedo") is not None:
        albedo = _albedo(path, parameters["albedo"])
    found = READERS[path.suffix.lower()](path, albedo is not None)
    if not found.parts:
        raise ValueError(f"{path}: has no surface")
    folder = Path(tempfile.mkdtemp(prefix="lightloc_"))
    try:
        file = SceneFile.made(path, _scene(path, found, albedo, folder), found.notes)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(file, shutil.rmtree, folder, True)
    return file


def mesh_files(path: Path) -> list[Path]:
    """A mesh file, then the others that it names and that exist, sorted."""
    found = {file for file in NAMERS[path.suffix.lower()](path) if os.path.isfile(file)}
    return [path, *sorted(found - {path})]


def _scene(path: Path, found: Parts, albedo: NDArray | None, folder: Path) -> dict[str, Any]:
    """Mitsuba's dictionary, the parts written as files into a folder."""
    scene: dict[str, Any] = {"type": "scene"}
    names: set[str] = set()
    for number, part in enumerate(found.parts):
        name = _free(part.name, names)
        what = f"{path}: mesh '{part.name}'" if part.name else f"{path}: the mesh"
        file = folder / f"{number}.ply"
        has_normals = _write(file, part, what)
        shape = {"type": "ply", "filename": str(file), "face_normals": not has_normals}
        shape["bsdf"] = {"type": "twosided", "bsdf": _bsdf(part, albedo, what)}
        if part.emission:
            shape["emitter"] = {"type": "area", "radiance": part.emission}
        scene[f"part_{number}"] = shape | ({"id": name} if name else {})
    for number, other in enumerate(found.others):
        name = _free(other.get("id", ""), names)
        own = {key: value for key, value in other.items() if key != "id"}
        scene[f"other_{number}"] = own | ({"id": name} if name else {})
    return scene


def _albedo(path: Path, value: Any) -> NDArray[np.float64]:
    """One number or three, also as text with commas."""
    try:
        found = np.array(value.split(",") if isinstance(value, str) else value, float).ravel()
    except (TypeError, ValueError):
        found = np.zeros(0)
    if len(found) not in (1, 3) or not ((found >= 0) & (found <= 1)).all():
        raise ValueError(
            f"{path}: albedo is {value}; expected one number from 0 to 1, or three as 0.5,0.4,0.3"
        )
    return np.broadcast_to(found, 3)


def _bsdf(part: Part, albedo: NDArray | None, what: str) -> dict[str, Any]:
    if albedo is not None:
        return {"type": "diffuse", "reflectance": colour(albedo)}
    if part.paint is not None:
        if part.uv is None and "bitmap" in _types(part.paint):
            raise ValueError(f"{what} has a picture and no texture coordinates")
        return part.paint
    if part.colours is None:
        raise ValueError(f"{what} has no colours; expected albedo=, one number or three")
    return {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}


def _types(paint: dict[str, Any]) -> set[str]:
    """The types of a BSDF's textures."""
    return {value.get("type", "") for value in paint.values() if isinstance(value, dict)}


def _free(name: str, names: set[str]) -> str:
    """A name that no other part has; "" where there is none."""
    own, number = name, 2
    while name and own in names:
        own, number = f"{name}.{number}", number + 1
    names.add(own)
    return own


def _write(file: Path, part: Part, what: str) -> bool:
    """Write a part as Mitsuba reads it, and return whether it has normals.

    Faces without an area are left out, and vertices that no face has. A face is turned so that it
    faces as its vertices' normals do.
    """
    used, faces = np.unique(part.faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    columns = {"x y z": part.vertices, "nx ny nz": part.normals, "u v": part.uv}
    columns |= {"r g b": part.colours}
    kept = {name: values[used] for name, values in columns.items() if values is not None}
    for name, values in kept.items():
        if name != "nx ny nz" and not np.isfinite(values).all():
            row = used[np.argmin(np.isfinite(values).all(axis=1))]
            raise ValueError(f"{what}: vertex {row} has a {name} that is not finite")
    p = kept["x y z"].astype(np.float32).astype(float)[faces]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    sides = np.square(p - np.roll(p, 1, axis=1)).sum(axis=2).max(axis=1, initial=0)
    there = np.linalg.norm(normal, axis=1) > FLAT * sides
    if not there.any():
        raise ValueError(f"{what}: has no face with an area")
    faces, normal = faces[there], normal[there]
    if "nx ny nz" in kept:
        n = kept["nx ny nz"]
        length = np.linalg.norm(n, axis=1, keepdims=True)
        if np.isfinite(n).all() and (length > 0).all():
            kept["nx ny nz"] = n / length
            back = np.einsum("fi,fi->f", normal, kept["nx ny nz"][faces].sum(axis=1)) < 0
            faces[back] = faces[back][:, ::-1]
        else:
            del kept["nx ny nz"]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(used)}"]
    header += [f"property float {axis}" for name in kept for axis in name.split()]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    rows = np.empty(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    rows["n"], rows["v"] = 3, faces
    with file.open("wb") as out:
        out.write("\n".join([*header, "end_header\n"]).encode())
        out.write(np.concatenate(list(kept.values()), axis=1).astype("<f4").tobytes())
        out.write(rows.tobytes())
    return "nx ny nz" in kept
