"""Parts of a scene: numbers that no light can be traced with are refused."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from render.surfaces import area_of

FARTHEST = 1e12  # of a point of the scene: beyond it areas and their squares are no float32

BRIGHTEST = 1e6  # value of a picture: paths multiply many, and the sum of squares is a float32


SIGNED = ("bumpmap", "hair", "polarizer", "retarder")  # BSDFs with numbers that may be below 0


def number_fault(props: Any) -> str | None:
    """Which number of a BSDF is none that it can have; None where all are.

    Mitsuba takes a roughness below 0 for a mirror, and a share below 0 as it is.
    """
    own, kinds = mi.Properties(props), mi.Properties.Type  # reading the BSDF's own would be a use
    for key in list(own.keys()):
        kind = own.type(key)
        if kind not in (kinds.Float, kinds.Integer, kinds.Color, kinds.Spectrum):
            continue
        values = np.ravel(own[key].values if kind == kinds.Spectrum else own[key])
        bad = values[~((values >= 0) & (values < np.inf))]
        if len(bad):
            return f"{key} is {bad[0]:g}; expected a finite number, at least 0"
    return None


def shape_fault(shape: Any) -> str | None:
    """What of a shape is not finite; None where all is."""
    box = shape.bbox()
    reach = np.abs([np.array(box.min).ravel(), np.array(box.max).ravel()]).max()
    if not reach < FARTHEST:
        return f"reaches {reach:.3g} from the origin; expected less than {FARTHEST:g}"
    size = area_of(shape)
    if size is not None and not np.isfinite(size):
        return f"has an area of {size:g}; expected a finite one"
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
    """Which value of a bitmap or a grid is out of range; a raw one may be below 0."""
    values = mi.traverse(texture)
    if "data" not in values:
        return None
    data = np.array(values["data"])
    least = -BRIGHTEST if raw else 0.0
    bad = ~((data >= least) & (data <= BRIGHTEST))
    expected = f"values of {least:g} to {BRIGHTEST:g}"
    return f"holds {data[bad].flat[0]:g}; expected {expected}" if bad.any() else None
