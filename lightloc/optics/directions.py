"""Directions over a hemisphere, from points of the unit square."""

from __future__ import annotations

from typing import Any

import drjit as dr

from lightloc.backend import types


def cosine_direction(normal: Any, u: Any, v: Any) -> Any:
    """A cosine-distributed direction about ``normal`` of u, v in 0..1 (Malley's, Duff's frame)."""
    f = types()
    radius, angle = dr.sqrt(u), dr.two_pi * v
    sin, cos = dr.sincos(angle)
    sign = dr.select(normal.z >= 0, f.Float(1), f.Float(-1))
    a = -dr.rcp(sign + normal.z)
    b = normal.x * normal.y * a
    s = f.Array3f(1 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x)
    t = f.Array3f(b, sign + normal.y * normal.y * a, -normal.y)
    return s * (radius * cos) + t * (radius * sin) + normal * dr.safe_sqrt(1 - u)
