"""Where outliers lie: beside the edges of shadows, in highlights, on one surface, or anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

from lightloc.backend import types
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics import columns, radiance, shadows, surfels
from lightloc.reprs import short

BESIDE = 0.005
"""Of the diagonal: what lies so near a shadow's edge may be on its other side."""

LIFTED = 0.01
"""Of that distance: how far off its surface a step along it is tested to be free."""

SLANT = np.cos(np.deg2rad(60))
"""Of the other views, with which the own is compared."""

BRIGHTER = 2.0
"""Times the median of those, from which on a surface shows a highlight."""

CHANCE = 0.05
"""Chance at which as many of the outliers lie there as of all observations would by luck."""

MOST = 0.2
"""Of the observations: where more are outliers, it is the model that is wrong."""

ENOUGH = 2000
"""Observations of which it is asked how many lie there."""


class Where(Enum):
    """Where outliers lie; the value is what a user reads.

    Examples
    --------
    >>> from lightloc import Where
    >>> Where.EDGE.value
    "at shadows' edges"
    """

    EDGE = "at shadows' edges"
    HIGHLIGHT = "in highlights"
    SURFACE = "on"
    ELSEWHERE = "elsewhere"


@dataclass(frozen=True, eq=False)
class Outliers:
    """Observations that are outliers and lie in places of one sort.

    Parameters
    ----------
    where : Where
        The sort. One is named only where more outliers lie there than luck would put there.
    observations : (m,) array of int
        Their indices.
    surface : str
        The name of the region that they lie on, for `Where.SURFACE`.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Outliers, Where
    >>> print(Outliers(Where.SURFACE, np.array([7, 9]), surface="table"))
    2 on 'table'
    """

    where: Where
    observations: NDArray[np.intp] = field(repr=False)
    surface: str = ""

    __repr__ = short

    @property
    def place(self) -> str:
        """Where that is, in words."""
        name = f" '{self.surface}'" if self.where is Where.SURFACE else ""
        return self.where.value + name

    def __str__(self) -> str:
        return f"{len(self.observations):,} {self.place}"


def outliers_said(groups: Sequence[Outliers], of: int) -> str:
    """Where the outliers among so many observations lie, in a sentence; nothing without any.

    Examples
    --------
    >>> edge = Outliers(Where.EDGE, np.arange(11))
    >>> outliers_said([edge, Outliers(Where.ELSEWHERE, np.arange(3))], 2000)
    "14 of 2,000 observations (0.7 %) are outliers: 11 at shadows' edges, 3 elsewhere."
    """
    count = sum(len(group.observations) for group in groups)
    if not count:
        return ""
    are = "is an outlier" if count == 1 else "are outliers"
    said = f"{count:,} of {of:,} observations ({100 * count / of:.2g} %) {are}"
    if [group.where for group in groups] == [Where.ELSEWHERE]:
        return f"{said}."
    return f"{said}: {', '.join(map(str, groups))}."


def outliers_of(
    q: Observations, outliers: NDArray[np.bool_], lights: PointLights, geometry: Geometry | None
) -> tuple[Outliers, ...]:
    """Where they lie, of n observations of which ``outliers`` (n, c) says which residuals are."""
    far = np.flatnonzero(outliers.any(axis=1))
    if not 0 < len(far) <= MOST * len(q) or not len(lights):
        return ()
    every = np.arange(0, len(q), -(-len(q) // ENOUGH))
    known = PointLights(
        lights.positions, np.nan_to_num(lights.intensities), q.unit, q.intensity_unit
    )
    named = {
        Where.EDGE: at_edges(q.at(far), known, geometry),
        Where.HIGHLIGHT: in_highlights(q.at(far), known),
    }
    usual = {
        Where.EDGE: at_edges(q.at(every), known, geometry),
        Where.HIGHLIGHT: in_highlights(q.at(every), known),
    }
    groups, left = [], np.ones(len(far), bool)
    for where, there in named.items():
        if is_many(left & there, left, usual[where].mean()):
            groups.append(Outliers(where, far[left & there]))
            left &= ~there
    names = np.unique(q.regions)
    for region in names if len(names) > 1 else ():
        there = q.regions[far] == region
        if is_many(left & there, left, (q.regions == region).mean(), tried=len(names)):
            groups.append(Outliers(Where.SURFACE, far[left & there], q.region_names[region]))
            left &= ~there
    if left.any():
        groups.append(Outliers(Where.ELSEWHERE, far[left]))
    return tuple(groups)


def is_many(
    there: NDArray[np.bool_], left: NDArray[np.bool_], share: float, tried: int = 1
) -> bool:
    """Whether luck puts so many of those that are left there, of whom it would be a share."""
    chance = binom.sf(there.sum() - 1, left.sum(), share)
    return bool(there.any() and tried * chance < CHANCE)


def at_edges(q: Observations, lights: PointLights, geometry: Geometry | None) -> NDArray[np.bool_]:
    """(n,) whether a step along the surface comes into or out of the shadow that a light casts."""
    beside = np.zeros(len(q), bool)
    if geometry is None:
        return beside
    across = np.eye(3)[np.abs(q.facets).argmin(axis=1)]
    u = np.cross(q.facets, across)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(q.facets, u)
    bounds = np.asarray(getattr(geometry, "bounds", q.bounds))
    step = BESIDE * float(np.linalg.norm(np.diff(bounds, axis=0)))
    lift = LIFTED * step * q.facets
    here, _ = shadows(surfels(q, geometry), lights.positions, geometry)
    for way in (u, -u, v, -v):
        there = q.positions + step * way
        start, end = columns(q.positions + lift), columns(there + lift)
        free = np.broadcast_to(geometry.visible(start, end, types().Bool(True)), len(q))
        moved = surfels(replace(q, positions=there), geometry)
        seen, _ = shadows(moved, lights.positions, geometry)
        beside |= np.asarray(free) & (seen != here).any(axis=0)
    return beside


def in_highlights(q: Observations, lights: PointLights) -> NDArray[np.bool_]:
    """(n,) whether B is far brighter as it is seen than from most other directions."""
    if q.quantity == "irradiance":
        return np.zeros(len(q), bool)
    across = np.eye(3)[np.abs(q.normals).argmin(axis=1)]
    u = np.cross(q.normals, across)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(q.normals, u)
    own = radiance(q, lights).sum(axis=1)
    others = [
        radiance(
            replace(q, directions=SLANT * q.normals + np.sqrt(1 - SLANT**2) * way), lights
        ).sum(axis=1)
        for way in (u, -u, v, -v)
    ]
    return np.asarray(own > BRIGHTER * np.median(others, axis=0))
