"""Read OBJ files and their MTL: polygons, several objects and materials, diffuse colours."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.part import Part, Parts, colour, linear, picture, texture, triangulated

SEE_THROUGH = (4, 6, 7, 9)  # illumination models of glass
MIRRORS = (3, 5)


@dataclass
class _Faces:
    """The polygons of one object in one material: (v, vt, vn) of each corner, and their sizes."""

    corners: list[tuple[int, int, int]] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)


def read_obj(path: Path, plain: bool) -> Parts:
    """The parts of an OBJ file, one for each object and material; without paint where ``plain``.

    Raises ValueError, in one sentence with the line, where a file can't be read or is missing, or a
    material is see-through or a mirror.
    """
    points, places, normals, groups, libraries = _lines(path)
    if not any(faces.sizes for faces in groups.values()):
        raise ValueError(f"{path}: has {len(points)} points and no face; expected faces")
    xyz, colours = points[:, :3], points[:, 3:] if points.shape[1] == 6 else None
    used = {material for _, material in groups if material}
    library = {} if plain else _library(path, libraries, used)
    paints = {name: _paint(path, name, values) for name, values in library.items()}
    shiny = [name for name, values in library.items() if max(values.get("Ks", [0.0])) > 0]
    parts = []
    for (name, material), faces in groups.items():
        if not faces.sizes:
            continue
        corner, size = np.array(faces.corners), np.array(faces.sizes)
        try:
            cut, _ = triangulated(np.cumsum(size) - size, size, xyz[corner[:, 0]])
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        v, vt, vn = corner[cut.ravel()].T
        paint = paints.get(material)
        parts.append(
            Part(
                name or material,
                xyz[v],
                np.arange(len(v)).reshape(-1, 3),
                normals[vn] if len(vn) and vn.min() >= 0 else None,
                places[vt] * [1, -1] + [0, 1] if len(vt) and vt.min() >= 0 else None,
                linear(colours[v]) if colours is not None and paint is None and not plain else None,
                paint,
            )
        )
    notes = []
    if shiny:
        notes.append(
            f"highlights (Ks) of {len(shiny)} of {len(library)} materials are not taken from MTL: "
            "all surfaces are diffuse"
        )
    return Parts(tuple(parts), (), tuple(notes))


def obj_files(path: Path) -> list[Path]:
    """The material files that an OBJ file names, and the pictures that these name."""
    libraries = [
        name
        for line in _text(path).splitlines()
        if (words := line.split())[:1] == ["mtllib"]
        for name in _names(path, words)
    ]
    files = [path.parent / name for name in libraries]
    for file in [file for file in files if os.path.isfile(file)]:
        for line in _text(file).splitlines():
            words = line.split()
            if words[:1] == ["map_Kd"]:
                files.append(file.parent / words[-1])
    return files


def _text(path: Path) -> str:
    return path.read_text(errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")


def _names(path: Path, words: list[str]) -> list[str]:
    """The files of an ``mtllib``: one whose name has spaces, or several."""
    whole = " ".join(words[1:])
    return [whole] if os.path.isfile(path.parent / whole) else words[1:]


def _lines(path: Path) -> tuple[NDArray, NDArray, NDArray, dict[Any, _Faces], list[str]]:
    """Positions, places in pictures, normals, the faces of each object and material, libraries."""
    tables: dict[str, list[list[float]]] = {"v": [], "vt": [], "vn": []}
    groups: dict[tuple[str, str], _Faces] = {}
    libraries: list[str] = []
    name, material, faces = "", "", groups.setdefault(("", ""), _Faces())
    vertices, places, normals = tables.values()
    for number, line in enumerate(_text(path).splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] in tables:
                tables[words[0]].append([float(word) for word in words[1:]])
            elif words[0] == "f":
                sizes = len(vertices), len(places), len(normals)
                corners = [_corner(word, sizes) for word in words[1:]]
                if len(corners) > 2:
                    faces.corners += corners
                    faces.sizes.append(len(corners))
            elif words[0] in ("o", "g", "usemtl"):
                name, material = (
                    (name, " ".join(words[1:]))
                    if words[0] == "usemtl"
                    else (" ".join(words[1:]), material)
                )
                faces = groups.setdefault((name, material), _Faces())
            elif words[0] == "mtllib":
                libraries += _names(path, words)
        except IndexError as error:
            raise ValueError(f"{path}: line {number}: {error}") from None
        except ValueError:
            raise ValueError(f"{path}: line {number}: '{line.strip()}' can't be read") from None
    v = tables["v"]
    width = 6 if v and all(len(row) == 6 for row in v) else 3
    arrays = [_table(path, rows, k) for rows, k in zip(tables.values(), (width, 2, 3), strict=True)]
    return arrays[0], arrays[1], arrays[2], groups, libraries


def _table(path: Path, rows: list[list[float]], width: int) -> NDArray[np.float64]:
    if any(len(row) < width for row in rows):
        raise ValueError(f"{path}: a vertex has fewer than {width} numbers")
    return np.array([row[:width] for row in rows], float).reshape(-1, width)


def _corner(word: str, sizes: tuple[int, int, int]) -> tuple[int, int, int]:
    """Its indices from 0, and -1 where it has none; a negative one counts from the last."""
    own = [*word.split("/"), "", ""][:3]
    found = []
    for text, size in zip(own, sizes, strict=True):
        if not text:
            found.append(-1)
            continue
        index = int(text)
        at = index - 1 if index > 0 else size + index
        if index == 0 or not 0 <= at < size:
            raise IndexError(f"a face refers to {text} of {size}, counted from 1")
        found.append(at)
    if found[0] < 0:
        raise ValueError
    return found[0], found[1], found[2]


def _library(path: Path, libraries: list[str], used: set[str]) -> dict[str, dict[str, Any]]:
    """The values of each material that is used."""
    found: dict[str, dict[str, Any]] = {}
    own: dict[str, Any] = {}
    for name in libraries if used else ():
        file = path.parent / name
        if not os.path.isfile(file):
            raise ValueError(f"{path}: names {name}, which is missing; or pass albedo=")
        for number, line in enumerate(_text(file).splitlines(), start=1):
            words = line.split()
            try:
                if words[:1] == ["newmtl"]:
                    own = found.setdefault(" ".join(words[1:]), {})
                elif words[:1] in (["Kd"], ["Ks"], ["d"], ["Tr"], ["illum"]):
                    own[words[0]] = [float(word) for word in words[1:4]]
                    if len(own[words[0]]) not in (1, 3):
                        raise ValueError
                elif words[:1] == ["map_Kd"]:
                    own["map_Kd"] = file.parent / _picture_of(words, file, line)
                elif words[:1] == ["map_d"]:
                    own["d"] = [0.0]
            except ValueError:
                raise ValueError(
                    f"{path}: {name}, line {number}: '{line.strip()}' can't be read"
                ) from None
    return {name: values for name, values in found.items() if name in used}


def _picture_of(words: list[str], file: Path, line: str) -> str:
    """The name of a picture; one that changes its picture by options is not read."""
    whole = line.split(None, 1)[1].strip() if len(words) > 1 else ""
    if not whole or whole.startswith("-"):
        raise ValueError
    return whole


def _paint(path: Path, name: str, values: dict[str, Any]) -> dict[str, Any] | None:
    """The BSDF of a material, None where it has no colour."""
    model = int(values.get("illum", [2])[0])
    opacity = values["d"][0] if "d" in values else 1 - values.get("Tr", [0.0])[0]
    if opacity < 1 or model in SEE_THROUGH:
        raise ValueError(
            f"{path}: material '{name}' is see-through, which is not modelled; or pass albedo="
        )
    if model in MIRRORS:
        raise ValueError(f"{path}: material '{name}' is a mirror, which is not read from MTL")
    if "Kd" not in values and "map_Kd" not in values:
        return None
    kd = np.broadcast_to(np.array(values.get("Kd", [1.0]), float), 3)
    if not ((kd >= 0) & (kd <= 1)).all():
        raise ValueError(f"{path}: material '{name}' has Kd {kd.tolist()}; expected 0 to 1")
    if "map_Kd" not in values:
        return {"type": "diffuse", "reflectance": colour(kd)}
    file = values["map_Kd"]
    if not os.path.isfile(file):
        raise ValueError(
            f"{path}: material '{name}' names {file.name}, which is missing; or pass albedo="
        )
    values_of = linear(picture(file, f"{path}: {file.name}")[:, :, :3])
    return {"type": "diffuse", "reflectance": texture(values_of * kd)}
