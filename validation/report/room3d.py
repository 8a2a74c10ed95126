"""The room in 3D: what a case page's script needs to draw it, packed small."""

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.draw import stops
from validation.records import Result
from validation.report.words import intensity, metres, percent

POINTS_MOST = 20_000  # a browser turns this many smoothly
FACES_MOST = 100_000  # beyond it the walls' edges are drawn, and not their faces
CREASE_DEGREES = 20.0  # faces that meet at less are one smooth surface
MERGE = 1e-6  # of the diagonal: vertices closer than that are one
DECADES_MOST = 3.0  # of radiance in the colour bar; darker points take its lowest colour
ON_WALL = 1e-4  # of the diagonal: a point closer to the bounding box than that is on a wall
RESIDUAL_LIMIT = 4.0  # standard errors at the ends of the residual's colour bar
PADDING = 0.04  # of the diagonal, around the room

Array = NDArray[Any]


def room_data(result: Result, arrays: Mapping[str, Array]) -> dict[str, Any]:
    """Pack room.npz's arrays and a case's lights for the page's script.

    Points look inwards where they have a normal (`normals` (m, 3) of the file, else the bounding
    box's for points on it), so that the script can leave out those that turn their back.

    Raises
    ------
        ValueError: an array has the wrong shape, or a face names no vertex.
    """
    vertices, faces = _mesh(arrays)
    points = _shaped("points", arrays["points"], 3)
    radiance = arrays["radiance"].reshape(len(points), -1).mean(axis=1)
    residual = arrays["residual"] if "residual" in arrays else np.full(len(points), np.nan)
    if residual.size != len(points):
        raise ValueError(f"residual has {residual.size} values for {len(points)} points")
    every = np.concatenate([vertices, points])
    every = every[np.isfinite(every).all(axis=1)]
    if len(every) == 0:
        raise ValueError("it holds no finite point")
    low, high = every.min(axis=0), every.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    normals = arrays.get("normals")
    if normals is None or normals.shape != points.shape:
        normals = _box_normals(points, low, high, ON_WALL * diagonal)
    step = max(1, -(-len(points) // POINTS_MOST))
    brightness, ends = _log_radiance(radiance)
    return {
        "vertices": _pack(vertices, np.float32),
        "faces": _pack(faces if len(faces) <= FACES_MOST else faces[:0], np.int32),
        "edges": _pack(creases(vertices, faces, MERGE * diagonal), np.float32),
        "points": _pack(points[::step], np.float32),
        "normals": _pack(normals[::step], np.float32),
        "brightness": _pack(brightness[::step], np.float32),
        "brightness_ends": ends,
        "brightness_stops": stops("inferno"),
        "residual": _pack(residual.ravel()[::step], np.float32),
        "residual_known": bool(np.isfinite(residual).any()),
        "residual_limit": RESIDUAL_LIMIT,
        "drawn": len(points[::step]),
        "observed": len(points),
        "low": (low - PADDING * diagonal).tolist(),
        "high": (high + PADDING * diagonal).tolist(),
        "lights": _lights(result),
    }


def creases(vertices: Array, faces: Array, merge: float) -> NDArray[np.float32]:
    """Return the edges (n, 2, 3) where a mesh ends or folds: those that show a room's shape.

    A square's diagonal is no such edge, even where each of its triangles has its own corners:

    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> len(creases(square, np.arange(6).reshape(2, 3), 1e-6))
    4
    """
    if len(faces) == 0:
        return np.zeros((0, 2, 3), dtype=np.float32)
    cells = np.round(vertices / max(merge, np.finfo(np.float32).tiny))
    _, first, same = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    corners = same.reshape(-1)[faces]
    places = vertices[first].astype(np.float64)
    normals = np.cross(
        places[corners[:, 1]] - places[corners[:, 0]], places[corners[:, 2]] - places[corners[:, 0]]
    )
    size = np.linalg.norm(normals, axis=1)
    corners, normals = corners[size > 0], normals[size > 0] / size[size > 0, None]
    sides = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    owner = np.tile(np.arange(len(corners)), 3)
    edges, which, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    start = np.concatenate([[0], np.cumsum(count)[:-1]])
    one = owner[order[start]]
    other = owner[order[start + np.minimum(count, 2) - 1]]
    # The faces may be wound either way, so only the angle between their planes counts.
    fold = np.abs(np.sum(normals[one] * normals[other], axis=1))
    sharp = (count != 2) | (fold < np.cos(np.radians(CREASE_DEGREES)))
    return places[edges[sharp]].astype(np.float32)


def _mesh(arrays: Mapping[str, Array]) -> tuple[Array, Array]:
    vertices = _shaped("vertices", arrays["vertices"], 3)
    faces = _shaped("faces", arrays["faces"], 3).astype(np.int64)
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise ValueError("a face names a vertex that does not exist")
    return vertices, faces


def _shaped(name: str, array: Array, width: int) -> Array:
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} has shape {array.shape}, and not (n, {width})")
    return array


def _box_normals(points: Array, low: Array, high: Array, near: float) -> NDArray[np.float32]:
    return (np.abs(points - low) < near).astype(np.float32) - (np.abs(points - high) < near)


def _log_radiance(radiance: Array) -> tuple[Array, list[float]]:
    lit = radiance[np.isfinite(radiance) & (radiance > 0)]
    if lit.size == 0:
        return np.full(radiance.shape, np.nan), [-1.0, 0.0]
    high = float(np.log10(lit.max()))
    low = max(float(np.log10(lit.min())), high - DECADES_MOST)
    dark = np.where(np.isfinite(radiance), 10**low, np.nan)
    logarithm = np.log10(np.where(radiance > 10**low, radiance, dark))
    return logarithm, [low, high if high > low else low + 1]


def _lights(result: Result) -> dict[str, Any]:
    if result.lights is None or result.comparison is None:
        return {"true": [], "found": [], "pairs": []}
    lights, comparison = result.lights, result.comparison
    partner = {pair.found: pair for pair in comparison.pairs}
    true = [
        {
            "at": light.position,
            "missed": index in comparison.missed,
            "text": f"true light {index + 1}: {intensity(light.intensity)}",
        }
        for index, light in enumerate(lights.true)
    ]
    found = []
    for index, light in enumerate(lights.found):
        pair = partner.get(index)
        off = (
            f"{metres(pair.distance)} ({percent(pair.distance_percent)}) from true light "
            f"{pair.true + 1}"
            if pair
            else "a ghost: no true light is near"
        )
        text = f"found light {index + 1}: {intensity(light.intensity)}<br>{off}"
        found.append({"at": light.position, "ghost": pair is None, "text": text})
    pairs = [[pair.true, pair.found] for pair in comparison.pairs]
    return {"true": true, "found": found, "pairs": pairs}


def _pack(array: Array, kind: type[np.float32] | type[np.int32]) -> str:
    little_endian = np.ascontiguousarray(array, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(little_endian.tobytes()).decode("ascii")
