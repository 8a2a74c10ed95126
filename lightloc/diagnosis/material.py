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
    Modelled,
    fixed,
    pointwise,
)
from lightloc.diagnosis.lobe import Lobe, brought, lobes_of
from lightloc.given import Observations

FEW, SHARE, MOST = 12, 0.01, 12
"""Observations, and their share, that a group has at least; groups that are asked."""

FACTORS = (0.05, 20.0)
"""Of an albedo."""

ROUGHER = (0.2, 5.0)
"""Factors on a roughness."""

ALPHAS, GLOSSY, DIELECTRIC = (0.08, 0.2, 0.45), (0.02, 0.9), 1.5
"""Roughnesses from which an unknown lobe is fitted, their limits, and its index of refraction."""

BRIGHT = 20.0
"""Most strength of a lobe, in that of plastic's."""

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
    return found + [gloss(*group) for group in [("", np.ones(n, bool)), *own]]


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
        fixed(np.ones((1, on.shape[1]))),
        said,
        'Options(free=("albedo",))',
        fixed(np.tile(np.array(FACTORS)[:, None], on.shape[1])),
    )


def roughness(lobes: list[Lobe]) -> Departure:
    """All lobes rougher, or smoother, by one factor."""

    def model(lit: Lit, u: Array) -> Modelled:
        S, slope = lit.brought
        for lobe in lobes:
            there, before = (brought(lit, lobe.rougher(f)) for f in (u[0], 1.0))
            S, slope = S + there[0] - before[0], slope + there[1] - before[1]
        ahead = sum(brought(lit, lobe.rougher(u[0] * (1 + DELTA)))[0] for lobe in lobes)
        here = sum(brought(lit, lobe.rougher(u[0]))[0] for lobe in lobes)
        by = np.einsum("nkc,kc->nc", (ahead - here) / (DELTA * u[0]), lit.lights.intensities)
        return lit.summed(S, slope, by[:, :, None])

    return Departure(
        Kind.MATERIAL,
        "the roughness",
        model,
        fixed(np.array([[1.0], [0.6], [1.6]])),
        lambda u, e: f"highlights are {u[0]:.3f} ± {e[0]:.1g} times as rough as was given",
        "another roughness",
        fixed(np.array(ROUGHER)[:, None]),
    )


def gloss(words: str, on: NDArray[np.bool_]) -> Departure:
    """A lobe that was not known of, as that of plastic: its strength, and its roughness."""

    def lobe(alpha: float, lit: Lit) -> Lobe:
        n = len(on)
        strength = np.broadcast_to(on[:, None].astype(float), (n, lit.evidence.q.channels))
        return Lobe(np.full(n, alpha), strength, np.full(n, DIELECTRIC))

    def model(lit: Lit, u: Array) -> Modelled:
        S, slope = lit.brought
        own, along = brought(lit, lobe(u[1], lit))
        ahead = brought(lit, lobe(u[1] * (1 + DELTA), lit))[0]
        columns = np.stack([own, u[0] * (ahead - own) / (DELTA * u[1])], axis=-1)
        by = np.einsum("nkcu,kc->ncu", columns, lit.lights.intensities)
        return lit.summed(S + u[0] * own, slope + u[0] * along, by)

    return Departure(
        Kind.MATERIAL,
        f"a highlight{words}",
        model,
        fixed(np.array([[0.0, alpha] for alpha in ALPHAS])),
        lambda u, e: (
            f"highlights{words} are missing, of roughness {u[1]:.2g} ± {e[1]:.1g} and "
            f"{u[0]:.2g} ± {e[0]:.1g} times as bright as plastic's"
        ),
        "a Plastic, or a Sum with a lobe",
        fixed(np.array([[0.0, GLOSSY[0]], [BRIGHT, GLOSSY[1]]])),
    )


DELTA = 1e-3
"""Relative step of a difference by a roughness."""
