"""Which side of a surface to look at, where both reflect: the one that light or a camera sees."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.room import Room
from render.transport import PROBE_SHARE, is_free, off_surface

BOUNCES = 4  # rays from each side that look for a lit surface


def side_of(room: Room, p: Any, n: Any, rng: np.random.Generator) -> Any:
    """The normals at m points p, whose normals are n, on the side to look at.

    That is the one that light reaches, straight or by way of one surface, or that a camera of the
    scene sees; either where both are such. Where none is, it is the one that faces the room.
    """
    ahead, behind = _is_seen(room, p, n, rng), _is_seen(room, p, -n, rng)
    reach = PROBE_SHARE * room.diagonal
    free = [~room.scene.ray_test(mi.Ray3f(p + s * reach, s)) for s in (n, -n)]
    coin = mi.Mask(rng.random(dr.width(p)) < 0.5)
    back = dr.select(ahead == behind, dr.select(ahead, coin, free[0] & ~free[1]), behind)
    return dr.select(back, -n, n)


def lit_from_behind(room: Room, x: NDArray, n: NDArray, rng: np.random.Generator) -> bool:
    """Whether light reaches the backs of some of m points x, whose normals n are on the front."""
    p, back = mi.Point3f(x.T), mi.Vector3f(-n.T)
    return bool(dr.any(_is_lit(room, _there(room, p, back), back, rng)))


def _is_seen(room: Room, p: Any, side: Any, rng: np.random.Generator) -> Any:
    """Whether light, or a camera, sees m points on one side."""
    si = _there(room, p, side)
    seen = _is_lit(room, si, side, rng)
    for sensor in room.scene.sensors():
        eye = mi.Point3f(np.array(sensor.world_transform().translation()).ravel())
        seen |= (dr.dot(eye - p, side) > 0) & is_free(room.scene, si, eye)
    for _ in range(BOUNCES):
        d = mi.Frame3f(side).to_world(mi.warp.square_to_cosine_hemisphere(_uniform(p, rng)))
        hit = room.scene.ray_intersect(mi.Ray3f(off_surface(room.scene, si, d), d))
        facing = dr.select(dr.dot(hit.n, d) > 0, -hit.n, hit.n)
        seen |= hit.is_valid() & _is_lit(room, hit, facing, rng)
    dr.eval(seen)
    return seen


def _is_lit(room: Room, si: Any, side: Any, rng: np.random.Generator) -> Any:
    """Whether an emitter sees m surface interactions on one side."""
    lit = mi.Mask(False)
    for scene in (room.scene, room.known):
        for emitter in scene.emitters() if scene else ():
            to, value = emitter.sample_direction(si, _uniform(si.p, rng))
            free = is_free(scene, si, to.p)
            lit |= free & (dr.dot(side, to.d) > 0) & (dr.max(value) > 0)
    return lit


def _there(room: Room, p: Any, side: Any) -> Any:
    """Surface interactions at m points, seen from one side."""
    return room.scene.ray_intersect(mi.Ray3f(p + side * (PROBE_SHARE * room.diagonal), -side))


def _uniform(p: Any, rng: np.random.Generator) -> Any:
    return mi.Point2f(rng.random((2, dr.width(p))))
