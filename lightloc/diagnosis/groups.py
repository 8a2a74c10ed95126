"""Observations that have something in common: a region, a material, an albedo, or a side."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf import BRDF, Lambert, Mixed
from lightloc.given import Observations

Array = NDArray[np.float64]

FEW, SHARE, MOST = 12, 0.01, 12
"""Observations, and their share, that a group has at least; groups that are asked."""

FLATS = 24
"""Directions that flat surfaces face, at most, for each to be one that may be tilted."""

Group = tuple[str, NDArray[np.bool_]]
"""What it is, as a user reads it, and which of the n observations are of it."""


def groups_of(q: Observations) -> list[Group]:
    """Observations that have an albedo of their own: named groups, the largest first.

    By region, by material, by albedo, or else by how they face; none where they are all alike.
    """
    ways: list[tuple[NDArray[Any] | None, Callable[[Any], str]]] = [
        (q.regions, lambda r: f"'{q.region_names[r]}'"),
        (q.material.index if isinstance(q.material, Mixed) else None, lambda m: f"material {m}"),
        (levels(q.material), lambda a: f"what has albedo {a:.3g}"),
        (facing(q.normals), lambda s: f"what faces {SIDES[s]}"),
    ]
    for labels, words in ways:
        if labels is None:
            continue
        which, count = np.unique(labels, return_counts=True)
        order = np.argsort(-count, kind="stable")[:MOST]
        kept = [i for i in order if count[i] >= max(FEW, SHARE * len(q))]
        if len(kept) > 1:
            return [(words(which[i]), labels == which[i]) for i in kept]
    return []


def sides_of(q: Observations) -> list[Group]:
    """Observations that are tilted alike: those of a region that face the same way."""
    region = np.zeros(len(q), int) if q.regions is None else np.asarray(q.regions)
    exact = np.unique(q.normals.round(6), axis=0, return_inverse=True)[1].ravel()
    way = exact if exact.max() < FLATS else facing(q.normals)
    which, count = np.unique(
        np.column_stack([region, way]), axis=0, return_inverse=True, return_counts=True
    )[1:]
    result = []
    for i in np.argsort(-count, kind="stable")[:FLATS]:
        on = which.ravel() == i
        if count[i] < FEW:
            break
        side = SIDES[facing(q.normals[on].mean(axis=0)[None])[0]]
        name = q.region_names[region[on][0]]
        result.append((f"what faces {side}" + (f" in '{name}'" if name else ""), on))
    return result


SIDES = ("-x", "+x", "-y", "+y", "-z", "+z")


def levels(material: BRDF) -> Array | None:
    """(n,) the albedo of each diffuse point; None where there are none or too many."""
    if not isinstance(material, Lambert) or len(material.albedo) == 1:
        return None
    value = material.albedo.mean(axis=1)
    return value if len(np.unique(value.round(6))) <= MOST else None


def facing(normals: Array) -> NDArray[np.intp]:
    """(n,) the side, of six, that each faces most."""
    axis = np.abs(normals).argmax(axis=1)
    return 2 * axis + (normals[np.arange(len(axis)), axis] > 0)
