"""Mesh files, checked before a scene is built on them: a bad index would end the process."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np

FORMATS = ("ply", "obj", "serialized")


def check_mesh(kind: str, file: Path, index: int) -> None:
    """Refuse a mesh file that can't be read, or that names a vertex that isn't there.

    Mitsuba reads such an index and then crashes on it. The file is read here as a bare mesh,
    without normals and without a scene around it, which is safe (measured, Mitsuba 3.9.1).
    ``index`` is that of a mesh in a serialized file, else 0.

    Raises
    ------
    ValueError
        Naming the mesh file, and the face where it is one.
    """
    if not file.is_file():
        raise ValueError(f"mesh {file}: no such file")
    more = {"shape_index": index} if kind == "serialized" else {}
    try:
        mesh = mi.load_dict({"type": kind, "filename": str(file), "face_normals": True, **more})
    except RuntimeError as error:
        reason = str(error).strip().rsplit('": ', 1)[-1]  # behind the places in the file and in C++
        raise ValueError(f"mesh {file}: {reason}") from None
    count = mesh.vertex_count()
    faces = np.array(mi.traverse(mesh)["faces"]).reshape(-1, 3)
    if not len(faces):
        raise ValueError(f"mesh {file}: has no face")
    if faces.max() >= count:
        row, corner = np.unravel_index(faces.argmax(), faces.shape)
        raise ValueError(
            f"mesh {file}: face {row} refers to vertex {faces[row, corner]}; "
            f"expected an index below {count}"
        )
