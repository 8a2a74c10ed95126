"""Materials: another albedo, a lobe that is rougher or smoother, or not known of at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Kind
from lightloc.brdf import BRDF, Irradiance, Lambert, Mixed
from lightloc.diagnosis.departure import (
    Array,
    Departure,
    Lit,
    fixed,
    pointwise,
    slope_of,
)
from lightloc.diagnosis.gloss import gloss, roughness
from lightloc.diagnosis.lobe import lobes_of
from lightloc.given import Observations

FEW, SHARE, MOST = 12, 0.01, 12
"""Observations, and their share, that a group has at least; groups that are asked."""

FACTORS = (0.05, 20.0)
"""Of an albedo."""

Group = tuple[str, NDArray[np.bool_]]


def materials(lit: Lit) -> list[Departure]:
    """All that may be wrong with what reflects."""
    q, n = lit.evidence.q, len(lit.evidence.q)
    groups = groups_of(q)
    one = groups[1:] if len(groups) == 2 else groups  # of two, one is bright as the other is dark
    found = [albedo(group) for group in one]
    if len(groups) > 2:
        found.append(albedos(groups))
    if isinstance(q.material, Irradiance):
        return found
    if lobes := lobes_of(q.material, n):
        found.append(roughness(lobes))
    own = [(f" of {words}", on) for words, on in groups]
    base = albedo_of(q)
    return found + [gloss(*group, base) for group in [("", np.ones(n, bool)), *own]]


def albedo_of(q: Observations) -> Array:
    """(n, c) albedos, below 1; a half where nobody says."""
    value = q.material.albedo if isinstance(q.material, Lambert) else np.full((1, 1), 0.5)
    return np.asarray(np.broadcast_to(np.clip(value, 0, 1), (len(q), q.channels)))


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


def albedo(group: Group) -> Departure:
    """The albedo of one group."""
    words, on = group

    def change(M: Array, u: Array) -> tuple[Array, Array, Array]:
        factor = np.where(on, u[0], 1.0)[:, None]
        return M * factor, np.broadcast_to(factor, M.shape), (M * on[:, None])[:, :, None]

    return Departure(
        Kind.MATERIAL,
        f"the albedo of {words}",
        pointwise(change),
        slope_of(change),
        fixed(np.ones((1, 1))),
        lambda u, e: f"the albedo of {words} is {u[0]:.3f} ± {e[0]:.1g} times what was given",
        'Options(free=("albedo",))',
        fixed(np.array(FACTORS)[:, None]),
    )


def albedos(groups: list[Group]) -> Departure:
    """The albedo of each group beside the largest's: a common factor is one of all intensities."""
    on = np.stack([which for _, which in groups[1:]], axis=1)  # n, u

    def change(M: Array, u: Array) -> tuple[Array, Array, Array]:
        factor = 1 + on @ (u - 1)
        by = M[:, :, None] * on[:, None]
        return M * factor[:, None], np.broadcast_to(factor[:, None], M.shape), by

    def said(u: Array, e: Array) -> str:
        far = np.argsort(-np.abs(np.log(u)), kind="stable")[:3]
        each = [f"of {groups[i + 1][0]} {u[i]:.3f} ± {e[i]:.1g}" for i in far]
        return f"albedos are, in that of {groups[0][0]}, {', '.join(each)} times what was given"

    return Departure(
        Kind.MATERIAL,
        "several albedos",
        pointwise(change),
        slope_of(change),
        fixed(np.ones((1, on.shape[1]))),
        said,
        'Options(free=("albedo",))',
        fixed(np.tile(np.array(FACTORS)[:, None], on.shape[1])),
    )
