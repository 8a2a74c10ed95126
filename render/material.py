"""Read BRDFs out of a scene: lightloc's own models where they fit, else the BSDF itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lightloc import BRDF, Conductor, Lambert, Mixed, Plastic
from lightloc.brdf import Scatter

GREY = 1e-5  # RGB that differs by less than this is read as one channel


@dataclass(frozen=True)
class SceneBSDF:
    """Mitsuba's own BSDFs at observed points, as a BRDF for lightloc's kernels."""

    interaction: Any = field(repr=False)
    channels: int = 3

    def bind(self, n: int) -> Scatter:
        if dr.width(self.interaction) != n:
            raise ValueError(f"SceneBSDF has {dr.width(self.interaction)} points; expected {n}")
        context = mi.BSDFContext()

        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            si = dr.gather(mi.SurfaceInteraction3f, self.interaction, i)
            value = si.bsdf().eval(context, si, si.to_local(mi.Vector3f(l)))
            return value if self.channels == 3 else value[0]

        return scatter


def material_at(si: Any) -> BRDF:
    """The BRDF at n surface interactions (from `probe`), textures evaluated at each.

    The parts of a `Mixed` stand in the order in which the points first show them.
    """
    n = dr.width(si)
    which = bsdf_of(si)
    models: dict[type, dict[str, NDArray]] = {}
    kind = np.empty(n, object)
    for number in range(which.max() + 1):
        here = np.flatnonzero(which == number)
        bsdf = mi.BSDFPtr(dr.gather(mi.BSDFPtr, si.bsdf(), mi.UInt32(int(here[0]))))
        model, values = _read(bsdf[0], dr.gather(mi.SurfaceInteraction3f, si, mi.UInt32(here)))
        kind[here] = model
        table = models.setdefault(model, {})
        for name, value in values.items():
            column = table.setdefault(name, np.full((n, 3), DEFAULTS.get(name, 0.0)))
            column[here] = value
    parts: list[BRDF] = []
    index = np.zeros(n, int)
    for b, (model, table) in enumerate(models.items()):
        here = kind == model
        index[here] = b
        if model is SceneBSDF:
            parts.append(SceneBSDF(si, _channels_of(si)))
        else:
            parts.append(model(**{name: _compact(v, here) for name, v in table.items()}))
    return parts[0] if len(parts) == 1 else Mixed(tuple(parts), index)


def regions_at(si: Any) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """(n,) which of the regions that share a BSDF n interactions lie in, and their names.

    Named by the BSDF's id, or by its number where it has none of its own.
    """
    which = bsdf_of(si)
    _, first = np.unique(which, return_index=True)
    bsdfs = dr.gather(mi.BSDFPtr, si.bsdf(), mi.UInt32(first))
    names = [bsdfs[i].id() for i in range(len(first))]
    return which, tuple(name or f"material {i}" for i, name in enumerate(names, start=1))


def bsdf_of(si: Any) -> NDArray[np.intp]:
    """(n,) which BSDF each of n interactions has, numbered as the points first show them.

    Mitsuba's own number of a BSDF depends on what else the process has loaded, and on which of a
    scene's parts, all loaded side by side, was ready first: a result must not depend on that.
    """
    return numbered(np.array(dr.reinterpret_array(mi.UInt32, si.bsdf())))


def numbered(ids: NDArray) -> NDArray[np.intp]:
    """Numbers from 0 in the order in which ids first come.

    Examples
    --------
    >>> numbered(np.array([7, 7, 3, 9, 3])).tolist(), numbered(np.array([1, 1, 8, 2, 8])).tolist()
    ([0, 0, 1, 2, 1], [0, 0, 1, 2, 1])
    """
    _, first, which = np.unique(ids, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[which]


def is_grey(colours: NDArray) -> bool:
    """Whether (n, 3) values are one channel."""
    return bool(np.ptp(colours, axis=1).max(initial=0) <= GREY * np.abs(colours).max(initial=0))


DEFAULTS = {"alpha": 0.5, "ior": 1.5}  # fill the rows that belong to another model


def children(parent: Any) -> dict[str, Any]:
    """The objects that one of Mitsuba's holds, by name: a BSDF's textures, a scene's shapes."""
    objects: dict[str, Any] = {}

    class Collect(mi.TraversalCallback):  # exists only once a variant is set
        def put(self, name: str, value: Any, *flags: Any) -> None:
            if isinstance(value, mi.Object):
                objects[name] = value

    parent.traverse(Collect())
    return objects


def _read(bsdf: Any, si: Any) -> tuple[type, dict[str, Any]]:
    """(model, parameters at si) of one BSDF; SceneBSDF where no model fits."""
    found = children(bsdf)
    if bsdf.class_name() == "TwoSidedBRDF":
        if found["brdf_0"] is not found["brdf_1"]:  # alike in print is not enough: bitmaps
            return SceneBSDF, {}
        return _read(found["brdf_0"], si)
    text = str(bsdf)
    ggx = "distribution = ggx" in text
    if bsdf.class_name() == "SmoothDiffuse":
        return Lambert, {"albedo": _colour(found["reflectance"], si)}
    if bsdf.class_name() == "RoughConductor" and ggx and "alpha" in found:
        specular = found.get("specular_reflectance")
        return Conductor, {
            "alpha": np.array(found["alpha"].eval_1(si))[:, None],
            "eta": _colour(found["eta"], si),
            "k": _colour(found["k"], si),
            "specular": 1.0 if specular is None else _colour(specular, si),
        }
    if bsdf.class_name() == "RoughPlastic" and ggx:
        scalars = mi.traverse(bsdf)
        specular = found.get("specular_reflectance")
        return Plastic, {
            "alpha": float(np.array(scalars["alpha"]).ravel()[0]),
            "ior": float(np.array(scalars["eta"]).ravel()[0]),
            "diffuse": _colour(found["diffuse_reflectance"], si),
            "specular": 1.0 if specular is None else _colour(specular, si),
            "nonlinear": float("nonlinear = 1" in text),
        }
    return SceneBSDF, {}


def _colour(texture: Any, si: Any) -> NDArray:
    value = np.atleast_2d(np.array(texture.eval(si), float))
    return np.broadcast_to(value, (3, dr.width(si))).T


def _compact(value: NDArray, here: NDArray) -> NDArray:
    """One channel where all are grey, one row where all its points agree."""
    mine = value[here]
    if is_grey(mine):
        value = value[:, :1]
    if np.ptp(value[here], axis=0).max() == 0:
        value = value[here][:1]
    return value


def _channels_of(si: Any) -> int:
    """1 where a light overhead, on the side that is seen, looks grey everywhere."""
    overhead = mi.Vector3f(0.3, 0.2, dr.mulsign(mi.Float(0.93), si.wi.z))
    value = si.bsdf().eval(mi.BSDFContext(), si, overhead)
    colour = np.array(value)
    return 1 if np.ptp(colour, axis=0).max() <= GREY * colour.max(initial=0) else 3
