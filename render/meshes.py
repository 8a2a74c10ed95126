"""Mesh files, checked before a scene is built on them: a bad index would end the process."""

from __future__ import annotations

import os
import struct
import zlib
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
    if not os.path.isfile(file):
        raise ValueError(f"mesh {file}: no such file")
    if kind == "serialized":
        _check_serialized(file, index)
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


def _check_serialized(file: Path, index: int) -> None:
    """Refuse a mesh that holds less than it says, for which Mitsuba may wait for ever."""
    data = file.read_bytes()
    try:
        _, version = struct.unpack_from("<HH", data)
        start, offset = 0, "<Q" if version == 4 else "<I"
        if index:
            (count,) = struct.unpack_from("<I", data, len(data) - 4)
            place = len(data) - 4 - struct.calcsize(offset) * (count - index)
            (start,) = struct.unpack_from(offset, data, place)
        stream = zlib.decompressobj()
        head = stream.decompress(data[start + 4 :], HEAD)
        (flags,) = struct.unpack_from("<I", head)
        at = head.index(b"\0", 4) + 1 if version == 4 else 4
        vertices, faces = struct.unpack_from("<QQ", head, at)
        numbers = 3 + sum(size for flag, size in ATTRIBUTES.items() if flags & flag)
        size = at + 16 + vertices * numbers * (8 if flags & DOUBLE else 4)
        size += faces * 3 * (8 if vertices > 0xFFFFFFFF else 4)
        there = len(head)
        while there < size and (more := stream.decompress(stream.unconsumed_tail, BLOCK)):
            there += len(more)
    except (struct.error, zlib.error, ValueError):
        raise ValueError(f"mesh {file}: is no serialized mesh, or is damaged") from None
    if there < size:
        raise ValueError(f"mesh {file}: holds {there} bytes of the {size} that it says it has")


ATTRIBUTES = {0x1: 3, 0x2: 2, 0x8: 3}  # numbers of a vertex: normal, texture coordinates, colour
DOUBLE = 0x2000
HEAD, BLOCK = 1 << 16, 1 << 24  # bytes
