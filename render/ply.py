"""Read PLY files: polygons of any size, ASCII and binary, with colours and textures."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.part import Part, Parts, linear, picture, texture, triangulated

TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), tuple("rgb"))
PLACES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
Rows = dict[str, Any]  # of an element: a column for each property, a list's as (start, count, all)


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str, str]]  # name, type, and a list's type of count


def read_ply(path: Path, plain: bool) -> Parts:
    """The one part of a PLY file; without its colours where ``plain``.

    Colours are read as sRGB. Raises ValueError, in one sentence, where the file can't be read or is
    a point cloud.
    """
    rows, pictures = _rows(path)
    vertex, face = rows.get("vertex", {}), rows.get("face", {})
    if not {"x", "y", "z"} <= set(vertex):
        raise ValueError(f"{path}: has no vertices with x, y and z")
    name = next((n for n in ("vertex_indices", "vertex_index") if n in face), None)
    points = _columns(vertex, ("x", "y", "z"))
    if name is None or not len(face[name][2]):
        raise ValueError(f"{path}: is a point cloud of {len(points)} points; expected faces")
    start, count, index = face[name]
    index = index.astype(int)
    if index.min() < 0 or index.max() >= len(points):
        raise ValueError(
            f"{path}: a face refers to vertex {index.min() if index.min() < 0 else index.max()}; "
            f"expected an index from 0 below {len(points)}"
        )
    try:
        corner, polygon = triangulated(start, count, points[index])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    own = {key: _columns(vertex, names) for key, names in _named(vertex, plain).items()}
    faces = index[corner]
    if plain:
        return Parts((Part("", points, faces, own.get("normals")),))
    colours, uv = _colours(vertex), own.get("uv")
    if (wedge := face.get("texcoord")) is not None and (wedge[1] == 2 * count).all():
        uv = wedge[2].reshape(-1, 2)[corner].reshape(-1, 2)
        points, faces, own, colours = _apart(points, faces, own, colours)
    elif (per_face := _colours(face)) is not None:
        points, faces, own, colours = _apart(points, faces, own, colours)
        colours = np.repeat(per_face[polygon], 3, axis=0)
    paint = None
    if pictures and uv is not None:
        if len(pictures) > 1:
            raise ValueError(f"{path}: has {len(pictures)} pictures; expected one, or albedo=")
        uv = uv * [1, -1] + [0, 1]
        values = linear(picture(_there(path, pictures[0]), f"{path}: {pictures[0]}")[:, :, :3])
        paint, colours = {"type": "diffuse", "reflectance": texture(values)}, None
    return Parts((Part("", points, faces, own.get("normals"), uv, colours, paint),))


def ply_files(path: Path) -> list[Path]:
    """The pictures that a PLY file names."""
    with path.open("rb") as file:
        _, pictures, _ = _header(path, file)
    return [path.parent / name for name in pictures]


def _there(path: Path, name: str) -> Path:
    file = path.parent / name
    if not os.path.isfile(file):
        raise ValueError(f"{path}: names the picture {name}, which is missing; or pass albedo=")
    return file


def _apart(points: Any, faces: Any, own: Rows, colours: Any) -> tuple[Any, Any, Rows, Any]:
    """The same triangles, no two of which share a vertex."""
    flat = faces.ravel()
    return (
        points[flat],
        np.arange(len(flat)).reshape(-1, 3),
        {key: value[flat] for key, value in own.items()},
        None if colours is None else colours[flat],
    )


def _named(vertex: Rows, plain: bool) -> dict[str, tuple[str, ...]]:
    """The properties of vertices that are used, by what they are."""
    found: dict[str, tuple[str, ...]] = {}
    if {"nx", "ny", "nz"} <= set(vertex):
        found["normals"] = ("nx", "ny", "nz")
    place = next((names for names in PLACES if set(names) <= set(vertex)), None)
    return found if place is None or plain else {**found, "uv": place}


def _columns(rows: Rows, names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.stack([rows[name].astype(float) for name in names], axis=1)


def _colours(rows: Rows) -> NDArray[np.float64] | None:
    names = next((names for names in COLOURS if set(names) <= set(rows)), None)
    if names is None:
        return None
    kind = rows[names[0]].dtype
    most = np.iinfo(kind).max if kind.kind in "iu" else 1
    return linear(_columns(rows, names) / most)


def _rows(path: Path) -> tuple[dict[str, Rows], list[str]]:
    """The columns of each element, and the pictures that the header names."""
    with path.open("rb") as file:
        elements, pictures, order = _header(path, file)
        data: Any = file.read()
    at, found = 0, {}
    try:
        if not order:
            data = np.array(data.split(), float)
        for element in elements:
            found[element.name], at = _element(element, data, at, order)
    except (ValueError, IndexError, OverflowError):
        raise ValueError(f"{path}: ends or breaks within its data") from None
    return found, pictures


def _header(path: Path, file: Any) -> tuple[list[_Element], list[str], str]:
    elements: list[_Element] = []
    pictures, order = [], None
    if file.readline().strip() != b"ply":
        raise ValueError(f"{path}: is no PLY file")
    try:
        while (line := file.readline(4096)) and line.strip() != b"end_header":
            words = line.decode(errors="replace").split() or [""]
            if words[0] == "format":
                order = ORDERS[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], TYPES[words[3]], TYPES[words[2]]))
            elif words[0] == "property":
                elements[-1].properties.append((words[2], TYPES[words[1]], ""))
            elif words[0] == "comment" and words[1:2] == ["TextureFile"]:
                pictures.append(" ".join(words[2:]))
    except (KeyError, IndexError, ValueError):
        raise ValueError(f"{path}: the header's line {line!r} can't be read") from None
    if not line or order is None or any(e.count < 0 for e in elements):
        raise ValueError(f"{path}: the header of PLY can't be read")
    return elements, pictures, order


def _element(element: _Element, data: Any, at: int, order: str) -> tuple[Rows, int]:
    """The columns of an element whose rows begin at a place in the data, and where they end."""
    if not element.count:
        return {name: _empty(many) for name, _, many in element.properties}, at
    sizes = [_row(element, data, at, order)[1]]
    fixed = _fixed(element, data, at, order, sizes[0])
    if fixed is not None:
        return fixed
    values: list[list[Any]] = []
    for _ in range(element.count):
        row, _, at = _row(element, data, at, order)
        values.append(row)
    rows: Rows = {}
    for (name, kind, many), column in zip(
        element.properties, zip(*values, strict=True), strict=True
    ):
        if many:
            count = np.array([len(v) for v in column])
            rows[name] = np.cumsum(count) - count, count, np.concatenate(column)
        else:
            rows[name] = np.array(column).ravel().astype(kind)
    return rows, at


def _empty(many: str) -> Any:
    none = np.zeros(0, int)
    return (none, none, none) if many else none


def _row(element: _Element, data: Any, at: int, order: str) -> tuple[list[Any], list[int], int]:
    """One row: its values, the length of each, and where it ends."""
    row, sizes = [], []
    for _, kind, many in element.properties:
        size = 1
        if many:
            value, at = _take(data, at, 1, many, order)
            size = int(value[0])
        value, at = _take(data, at, size, kind, order)
        row.append(value)
        sizes.append(size)
    return row, sizes, at


def _take(data: Any, at: int, size: int, kind: str, order: str) -> tuple[NDArray, int]:
    width = np.dtype(kind).itemsize if order else 1
    end = at + size * width
    if size < 0 or end > len(data):
        raise IndexError
    if not order:
        return data[at:end].astype(kind), end
    return np.frombuffer(data, order + kind, size, at).astype(kind), end


def _fixed(
    element: _Element, data: Any, at: int, order: str, sizes: list[int]
) -> tuple[Rows, int] | None:
    """All rows at once where their lists are as long as those of the first; None otherwise."""
    fields: list[Any] = []
    for number, ((_, kind, many), size) in enumerate(zip(element.properties, sizes, strict=True)):
        if many:
            fields.append((f"n{number}", order + many if order else "f8"))
        fields.append((f"v{number}", order + kind if order else "f8", (size,)))
    kind_of_row = np.dtype(fields)
    width = kind_of_row.itemsize if order else kind_of_row.itemsize // 8
    end = at + element.count * width
    if end > len(data):
        if any(many for *_, many in element.properties):
            return None
        raise IndexError
    table = np.frombuffer(data[at:end] if order else data[at:end].tobytes(), kind_of_row)
    rows: Rows = {}
    for number, ((name, kind, many), size) in enumerate(
        zip(element.properties, sizes, strict=True)
    ):
        values = table[f"v{number}"].astype(kind)
        if many:
            if (table[f"n{number}"] != size).any():
                return None
            count = np.full(element.count, size)
            rows[name] = np.arange(element.count) * size, count, values.ravel()
        else:
            rows[name] = values[:, 0]
    return rows, end
