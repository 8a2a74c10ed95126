"""Where to look at a room: points by area over its shapes, each seen from a free direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.room import Room
from render.sides import side_of
from render.surfaces import area_of, left_out, two_sided
from render.transport import PROBE_SHARE, probe, to_numpy

CLEARANCE = 0.02  # the viewer stands at least this share of the diagonal away
ALIKE = 0.999  # cosine between the normals of one point, found twice
ROUNDS = 64  # attempts at placing points before a scene counts as unobservable


def viewed_points(
    room: Room, count: int, rng: np.random.Generator, shapes: Sequence[str] | None
) -> tuple[NDArray, NDArray]:
    """Points by area over the shapes, each with a direction from which it is really seen.

    Both are (n, 3), with n = ``count``: positions in the scene's unit of length, and unit vectors.
    Raises ValueError where a shape is unknown or too few points are seen.
    """
    chosen, areas = _choose(room, shapes)
    sides = rng.spawn(1)[0]
    points, views = np.zeros((0, 3)), np.zeros((0, 3))
    for _ in range(ROUNDS):
        want = count - len(points) + 64
        strata = (rng.permutation(want) + rng.random(want)) / want
        which = np.searchsorted(np.cumsum(areas) / areas.sum(), strata).clip(0, len(chosen) - 1)
        uv, disc = rng.random((2, want)), rng.random((2, want))
        order = np.argsort(which, kind="stable")
        x, n, both = _placed([chosen[s] for s in np.unique(which)], which[order], uv[:, order])
        seen, w = _seen(room, x, n, both, disc[:, order], sides)
        points, views = np.concatenate([points, x[seen]]), np.concatenate([views, w[seen]])
        if len(points) >= count:
            keep = np.sort(rng.permutation(len(points))[:count])
            return points[keep], views[keep]
    raise ValueError(f"{room.path}: no viewpoint sees enough of the chosen shapes")


def _placed(
    shapes: Sequence[Any], which: NDArray[np.intp], uv: NDArray
) -> tuple[NDArray, NDArray, NDArray[np.bool_]]:
    """m points on shapes, their normals, and whether both sides reflect there.

    ``which`` (m,) are the shapes' numbers in rising order, and ``uv`` (2, m) in 0..1 the places.
    """
    x, n, both = np.zeros((len(which), 3)), np.zeros((len(which), 3)), np.zeros(len(which), bool)
    for shape, number in zip(shapes, np.unique(which), strict=True):
        mine = which == number
        on = shape.sample_position(0, mi.Point2f(uv[:, mine]))
        x[mine], n[mine] = to_numpy(on.p), to_numpy(on.n)
        both[mine] = two_sided(shape.bsdf().flags())
    return x, n, both


def _seen(
    room: Room,
    x: NDArray,
    n: NDArray,
    both: NDArray[np.bool_],
    disc: NDArray,
    rng: np.random.Generator,
) -> tuple[NDArray[np.bool_], NDArray]:
    """Whether m points are seen along a cosine-distributed view, (m,), and that view, (m, 3).

    It is sampled by ``disc``, (2, m) in 0..1, on the front, or on a side that ``rng`` helps to
    choose where ``both`` reflect.
    """
    p, normal, either = mi.Point3f(x.T), mi.Vector3f(n.T), mi.Mask(both)
    side = dr.select(either, side_of(room, p, normal, rng), normal) if both.any() else normal
    w = mi.Frame3f(side).to_world(mi.warp.square_to_cosine_hemisphere(mi.Point2f(disc)))
    start = p + w * (PROBE_SHARE * room.diagonal)
    free = ~room.scene.ray_test(mi.Ray3f(start, w, CLEARANCE * room.diagonal, 0, []))
    back = probe(room.scene, x, to_numpy(w))
    # far from the origin, and beside an edge, another probe may find something else there
    again = probe(room.scene, to_numpy(back.p), to_numpy(w))
    near = 0.1 * PROBE_SHARE * room.diagonal
    same = (dr.norm(back.p - p) < near) & (dr.norm(again.p - p) < near) & again.is_valid()
    # beside an edge, the ray may come through the other surface
    alike, front = dr.abs(dr.dot(back.n, normal)) > ALIKE, dr.dot(back.sh_frame.n, w) > 0
    same &= dr.abs(dr.dot(back.n, again.n)) > ALIKE
    alike &= front | two_sided(back.bsdf().flags())  # another surface may lie in the same plane
    good = free & back.is_valid() & same & dr.select(either, alike, front)
    return np.array(good), to_numpy(w)


def _choose(room: Room, shapes: Sequence[str] | None) -> tuple[list[Any], NDArray[np.float64]]:
    """The shapes to sample, and their areas; unless named, those in `left_out` are not."""
    everything = room.scene.shapes()
    unfit = {place: (name, why) for place, name, why in left_out(room.scene, room.known)}
    chosen = [place for place in range(len(everything)) if place not in unfit]
    if shapes is not None:
        by_id = {shape.id(): place for place, shape in enumerate(everything) if shape.id()}
        unknown = [name for name in shapes if name not in by_id]
        if unknown or not shapes:
            raise ValueError(
                f"{room.path}: has no shape '{unknown[0] if unknown else ''}' "
                f"(it has: {', '.join(by_id)})"
            )
        chosen = [by_id[name] for name in shapes]
    refused = next((unfit[place] for place in chosen or unfit if place in unfit), None)
    if refused:
        raise ValueError(f"{room.path}: {refused[0]} {refused[1]}; such shapes can't be sampled")
    return [everything[place] for place in chosen], np.array(
        [area_of(everything[place]) for place in chosen]
    )
