"""One mesh of a file in one paint, as the readers of mesh files give it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.variant import two_threads

LINEAR_BELOW = 0.04045  # of sRGB
MOST_CORNERS = 2000  # of a polygon that is not convex: cutting it takes their square


@dataclass(frozen=True)
class Part:
    """Triangles with one paint.

    Parameters
    ----------
    name
        As the file has it; "" where it has none.
    vertices
        (v, 3) positions.
    faces
        (f, 3) their indices.
    normals, uv, colours
        (v, 3) unit normals; (v, 2) places in a picture, from its top left; (v, 3) albedo. None
        where the file has none.
    paint
        The BSDF as Mitsuba's dictionary; None where the file has none.
    emission
        What it emits, W sr^-1 m^-2, as a colour or a texture; None of what is no lamp.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.intp]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None
    paint: dict[str, Any] | None = None
    emission: dict[str, Any] | None = None


@dataclass(frozen=True)
class Parts:
    """What a mesh file holds: its parts, its lights and cameras, and what was not taken from it.

    ``others`` are lights and cameras as Mitsuba's dictionaries, ``notes`` sentences for the user.
    """

    parts: tuple[Part, ...]
    others: tuple[dict[str, Any], ...] = ()
    notes: tuple[str, ...] = ()


def linear(srgb: NDArray) -> NDArray[np.float64]:
    """Linear values of sRGB ones, 0 to 1.

    Examples
    --------
    >>> linear(np.array([0, 0.5, 1])).round(3).tolist()
    [0.0, 0.214, 1.0]
    """
    c = np.asarray(srgb, float)
    return np.where(c <= LINEAR_BELOW, c / 12.92, ((np.maximum(c, 0) + 0.055) / 1.055) ** 2.4)


def picture(data: bytes | Path, name: str) -> NDArray[np.float64]:
    """The (h, w, 4) values of a picture as it is stored, 0 to 1.

    ``name`` begins the sentence where it can't be read, which is a ValueError.
    """
    try:
        stream = mi.MemoryStream(len(data)) if isinstance(data, bytes) else None
        if stream is not None:
            stream.write(data)
            stream.seek(0)
        with two_threads():
            bitmap = mi.Bitmap(str(data)) if stream is None else mi.Bitmap(stream)
    except (RuntimeError, ValueError):
        raise ValueError(f"{name}: the picture can't be read; expected PNG or JPEG") from None
    values = np.array(bitmap)
    values = values.reshape(*values.shape[:2], -1)
    most = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1
    channels = values.shape[2]
    rgb = values[:, :, :3] if channels > 2 else np.repeat(values[:, :, :1], 3, axis=2)
    alpha = values[:, :, -1:] if channels in (2, 4) else np.full_like(values[:, :, :1], most)
    return np.concatenate([rgb, alpha], axis=2) / most


def texture(values: NDArray, wrap: str = "repeat") -> dict[str, Any]:
    """A texture of (h, w, c) linear values, as Mitsuba's dictionary."""
    bitmap = mi.Bitmap(np.ascontiguousarray(values, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": wrap}


def colour(values: NDArray) -> dict[str, Any]:
    """Three linear values, as Mitsuba's dictionary."""
    return {"type": "rgb", "value": [float(v) for v in values]}


def triangulated(
    start: NDArray, count: NDArray, corners: NDArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Polygons as (t, 3) numbers of corners, and the (t,) polygon of each triangle.

    A polygon has ``count`` corners from ``start`` on; ``corners`` (c, 3) are their positions. One
    of fewer than three is none. Raises ValueError where one that is not convex has too many.
    """
    found, owner = [np.zeros((0, 3), int)], [np.zeros(0, int)]
    for k in np.unique(count[count >= 3]):
        mine = np.flatnonzero(count == k)
        of = start[mine, None] + np.arange(k)
        fan = np.stack([np.zeros(k - 2, int), np.arange(1, k - 1), np.arange(2, k)], axis=1)
        cut = of[:, fan]
        if k > 3:
            p = corners[of]
            normal = np.cross(p, np.roll(p, -1, axis=1)).sum(axis=1)
            q = corners[cut]
            turn = np.cross(q[:, :, 1] - q[:, :, 0], q[:, :, 2] - q[:, :, 0])
            for i in np.flatnonzero((np.einsum("mtk,mk->mt", turn, normal) < 0).any(axis=1)):
                cut[i] = of[i][_clipped(p[i], normal[i])]
        found.append(cut.reshape(-1, 3))
        owner.append(np.repeat(mine, k - 2))
    return np.concatenate(found), np.concatenate(owner)


def _clipped(p: NDArray, normal: NDArray) -> NDArray[np.intp]:
    """(k - 2, 3) triangles of one polygon that is not convex, ear by ear."""
    if len(p) > MOST_CORNERS:
        raise ValueError(
            f"a face that is not convex has {len(p)} corners; expected at most {MOST_CORNERS}"
        )
    drop = int(np.abs(normal).argmax())  # seen along the axis that it faces most
    q = np.delete(p, drop, axis=1) * [1, np.sign(normal[drop]) * (-1 if drop == 1 else 1)]
    left, ears = list(range(len(q))), []
    while len(left) > 3:
        for at in range(len(left)):
            a, b, c = left[at - 1], left[at], left[(at + 1) % len(left)]
            if _turn(q[a], q[b], q[c]) <= 0:
                continue
            others = q[[i for i in left if i not in (a, b, c)]]
            sides = [_turn(q[i], q[j], others) for i, j in ((a, b), (b, c), (c, a))]
            if not (np.min(sides, axis=0) >= 0).any():
                break
        else:  # crosses itself: any cut is as good
            at, (a, b, c) = 1, left[:3]
        ears.append((a, b, c))
        del left[at]
    return np.array([*ears, left])


def _turn(a: NDArray, b: NDArray, c: NDArray) -> NDArray[np.float64]:
    """Above 0 where c lies to the left of the way from a to b."""
    along, off = b - a, c - a
    return np.asarray(along[0] * off[..., 1] - along[1] * off[..., 0])
