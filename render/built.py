"""Parts of a scene as built: numbers that no light can be traced with are refused."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np


def shape_fault(shape: Any) -> str | None:
    """What of a shape is not finite; None where all is."""
    box = shape.bbox()
    if not np.isfinite([np.array(box.min).ravel(), np.array(box.max).ravel()]).all():
        return "reaches to infinity"
    try:
        area = float(np.array(shape.surface_area()).ravel()[0])
    except RuntimeError:  # of an instance or a curve Mitsuba does not know it
        return None
    if not np.isfinite(area):
        return f"has an area of {area:g}; expected a finite one"
    if not shape.is_mesh():
        return None
    values = mi.traverse(shape)
    for name in ("vertex_positions", "vertex_normals"):
        if name in values and not np.isfinite(np.array(values[name])).all():
            return f"has {name.replace('_', ' ')} that are not finite"
    return None


def bsdf_fault(shape: Any) -> str | None:
    """Why Mitsuba can't evaluate a shape's BSDF, in its own words; None where it can."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.shape = mi.Vector3f(0, 0, 1), mi.ShapePtr(shape)
    try:
        shape.bsdf().eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1))
    except RuntimeError as error:
        return str(error)
    return None


def picture_fault(texture: Any, raw: bool) -> str | None:
    """Which value of a bitmap or a grid is none of a colour; of a raw one, of a number."""
    values = mi.traverse(texture)
    if "data" not in values:
        return None
    data = np.array(values["data"])
    bad = ~np.isfinite(data) if raw else ~(np.isfinite(data) & (data >= 0))
    least = "finite values" if raw else "finite values of at least 0"
    return f"holds {data[bad].flat[0]:g}; expected {least}" if bad.any() else None
