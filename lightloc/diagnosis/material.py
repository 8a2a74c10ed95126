"""Materials: another albedo, a lobe that is rougher or smoother, or not known of at all."""

from __future__ import annotations

import numpy as np

from lightloc.answer import Kind
from lightloc.brdf import Irradiance
from lightloc.diagnosis.departure import (
    Array,
    Change,
    Departure,
    Lit,
    fixed,
    pointwise,
    slope_of,
)
from lightloc.diagnosis.gloss import gloss, roughness
from lightloc.diagnosis.groups import Group, groups_of
from lightloc.diagnosis.lobe import lobes_of

FACTORS = (0.05, 20.0)
"""Of an albedo."""


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
        lambda u, e: (
            f"the albedo of {words} is {u[0]:.3f} ± {e[0]:.1g} times what was given, if the others "
            "are as given"
        ),
        'Options(free=("albedo",))',
        fixed(np.array(FACTORS)[:, None]),
    )


def factors(groups: list[Group]) -> Change:
    """A factor on the albedo of each group but the first: on all it is one of all intensities."""
    on = np.stack([which for _, which in groups[1:]], axis=1)  # n, u

    def change(M: Array, u: Array) -> tuple[Array, Array, Array]:
        factor = 1 + on @ (u - 1)
        by = M[:, :, None] * on[:, None]
        return M * factor[:, None], np.broadcast_to(factor[:, None], M.shape), by

    return change


def albedos(groups: list[Group]) -> Departure:
    """The albedo of each group beside the largest's."""
    change, size = factors(groups), len(groups) - 1

    def said(u: Array, e: Array) -> str:
        far = np.argsort(-np.abs(np.log(u)), kind="stable")[:3]
        each = [f"of {groups[i + 1][0]} {u[i]:.3f} ± {e[i]:.1g}" for i in far]
        return f"albedos are, in that of {groups[0][0]}, {', '.join(each)} times what was given"

    return Departure(
        Kind.MATERIAL,
        "several albedos",
        pointwise(change),
        slope_of(change),
        fixed(np.ones((1, size))),
        said,
        'Options(free=("albedo",))',
        fixed(np.tile(np.array(FACTORS)[:, None], size)),
    )
