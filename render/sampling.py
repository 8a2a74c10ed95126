"""Where to look at a room: points by area over its shapes, each seen from a free direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.room import Room
from render.transport import PROBE_SHARE, to_numpy

CLEARANCE = 0.02  # the viewer stands at least this share of the diagonal away
ROUNDS = 64  # attempts at placing points before a scene counts as unobservable


def viewed_points(
    room: Room, count: int, rng: np.random.Generator, shapes: Sequence[str] | None
) -> tuple[NDArray, NDArray]:
    """Points by area over the shapes, each with a direction from which it is really seen.

    Both are (n, 3), with n = ``count``: positions in the scene's unit of length, and unit vectors.
    Raises ValueError where a shape is unknown or too few points are seen.
    """
    chosen, areas = _choose(room, shapes)
    points, views = np.zeros((0, 3)), np.zeros((0, 3))
    for _ in range(ROUNDS):
        want = count - len(points) + 64
        strata = (rng.permutation(want) + rng.random(want)) / want
        which = np.searchsorted(np.cumsum(areas) / areas.sum(), strata).clip(0, len(chosen) - 1)
        uv, disc = rng.random((2, want)), rng.random((2, want))
        for s, shape in enumerate(chosen):
            mine = which == s
            if mine.any():
                x, w = _seen(room, shape, uv[:, mine], disc[:, mine])
                points, views = np.concatenate([points, x]), np.concatenate([views, w])
        if len(points) >= count:
            keep = np.sort(rng.permutation(len(points))[:count])
            return points[keep], views[keep]
    raise ValueError(f"{room.path}: no viewpoint sees enough of the chosen shapes")


def _seen(room: Room, shape: Any, uv: NDArray, disc: NDArray) -> tuple[NDArray, NDArray]:
    """Of sampled points of one shape, those with a cosine-distributed view that is free.

    They are sampled by ``uv`` and their views by ``disc``, each (2, m) in 0..1.
    """
    on = shape.sample_position(0, mi.Point2f(uv))
    side = mi.Vector3f(on.n)
    if "TwoSided" in shape.bsdf().class_name():  # look from the side that faces the room
        ahead = room.scene.ray_test(mi.Ray3f(on.p + side * PROBE_SHARE * room.diagonal, side))
        behind = room.scene.ray_test(mi.Ray3f(on.p - side * PROBE_SHARE * room.diagonal, -side))
        side = dr.select(behind & ~ahead, -side, side)
    w = mi.Frame3f(side).to_world(mi.warp.square_to_cosine_hemisphere(mi.Point2f(disc)))
    start = on.p + w * (PROBE_SHARE * room.diagonal)
    free = ~room.scene.ray_test(mi.Ray3f(start, w, CLEARANCE * room.diagonal, 0, []))
    back = room.scene.ray_intersect(mi.Ray3f(start, -w))
    same = dr.norm(back.p - on.p) < 0.1 * PROBE_SHARE * room.diagonal
    front = (dr.dot(back.sh_frame.n, w) > 0) | ("TwoSided" in shape.bsdf().class_name())
    good = np.array(free & back.is_valid() & same & front)
    return to_numpy(on.p)[good], to_numpy(w)[good]


def _choose(room: Room, shapes: Sequence[str] | None) -> tuple[list[Any], NDArray[np.float64]]:
    """The shapes to sample, and their areas; unless named, those without an area are left out."""
    everything = room.scene.shapes()
    by_id = {shape.id(): shape for shape in everything if shape.id()}
    if shapes is not None:
        unknown = [name for name in shapes if name not in by_id]
        if unknown or not shapes:
            raise ValueError(
                f"{room.path}: has no shape '{unknown[0] if unknown else ''}' "
                f"(it has: {', '.join(by_id)})"
            )
        everything = [by_id[name] for name in shapes]
    areas = [_area(shape) for shape in everything]
    for shape, area in zip(everything, areas, strict=True):
        if area is None and (shapes is not None or not any(areas)):
            name = f"shape '{shape.id()}'" if shape.id() else "a shape"
            raise ValueError(
                f"{room.path}: {name} is of type {shape.class_name()}, whose area Mitsuba "
                "does not know; such shapes can't be sampled"
            )
    chosen = [shape for shape, area in zip(everything, areas, strict=True) if area is not None]
    return chosen, np.array([area for area in areas if area is not None])


def _area(shape: Any) -> float | None:
    """In the scene's unit of length squared; None of an instance or a curve."""
    try:
        return float(np.array(shape.surface_area()).ravel()[0])
    except RuntimeError:
        return None
