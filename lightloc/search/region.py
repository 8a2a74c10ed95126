"""Where lights are looked for, and where else, when they are not there.

The default region is the box of what is observed, or of the whole scene where the geometry says
how large it is, and beyond it on every side that is open: from which a light would reach what is
observed. A closed room has no such side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.answer import Localization, NoiseLaw, Reason, at_border
from lightloc.checks import array
from lightloc.deadline import is_over
from lightloc.fit import robust
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics import shading
from lightloc.search.single import size_of

LARGEST = 20.0
"""Of the observations' longest side: a ground plane or a sky may be as large as it likes."""

FACED = 0.02, 0.2
"""A side is faced by this share of the observations at least, their normals leaning to it so."""

WALL = 0.02, 0.5
"""Of the observations so near a side, of the longest, at least this share face inwards: a wall."""

LOOKS, ON = 6, 256
"""Positions along each direction beyond a side, and the observations that they may light."""

AT_BORDER = 0.01
"""Of the longest side: a light so near an open side may lie beyond it."""

WIDENINGS = 3
"""Times that a region may be widened: each time it doubles."""

LESS = 0.97
"""Share of the robust loss of a light within that one beyond the border may leave, at a glance."""

WILD = 5.0
"""Sizes of B beyond which what is left of one observation counts less and less."""

ALIKE = 1 + 1e-3
"""Chi-square in a wider region may be more by so little, which is a polish's."""


@dataclass(frozen=True)
class Region:
    """A box that may hold lights.

    Parameters
    ----------
    bounds : (2, 3) array
        Its lower and upper corner.
    open : (2, 3) array of bool
        Its lower and upper sides that may be moved outwards.
    """

    bounds: NDArray[np.float64]
    open: NDArray[np.bool_]

    @staticmethod
    def of(q: Observations, geometry: Geometry | None, bounds: ArrayLike | None) -> Region:
        """The region that is asked for, or the default one.

        Raises
        ------
        ValueError
            If the bounds have another shape than (2, 3), are not finite, have no extent, or have
            their upper corner below the lower.
        """
        if bounds is not None:
            box = array("bounds", bounds, (2, 3))
            if (box[1] < box[0]).any() or (box[0] == box[1]).all():
                raise ValueError(
                    "bounds are no box: expected a lower corner and, beyond it, an upper one"
                )
            return Region.within(box, q, geometry)
        box, faced = q.bounds, is_faced(q)
        longest = float(np.ptp(box, axis=0).max())
        scene = getattr(geometry, "bounds", None)
        if scene is not None:
            beyond = np.stack([box[0] - scene[0], scene[1] - box[1]])
            reach = np.clip(beyond, 0, LARGEST * longest)
            box = moved(box, np.where(faced & is_open(box, reach, q, geometry), reach, 0.0))
        reach = np.full((2, 3), longest)
        box = moved(box, np.where(faced & is_open(box, reach, q, geometry), reach, 0.0))
        return Region.within(box, q, geometry)

    @staticmethod
    def within(box: NDArray[np.float64], q: Observations, geometry: Geometry | None) -> Region:
        """A box, and which of its sides are open."""
        size = np.ptp(box, axis=0)
        sides = is_open(box, np.full((2, 3), size.max()), q, geometry) & (size > 0)
        return Region(box, sides)

    def met(self, lights: PointLights) -> NDArray[np.bool_]:
        """(2, 3) the open sides that a light lies at."""
        near = AT_BORDER * float(np.ptp(self.bounds, axis=0).max())
        p = lights.positions
        off = np.stack([p - self.bounds[0], self.bounds[1] - p])
        return np.asarray(self.open & (off < near).any(axis=1))

    def wider(self, sides: NDArray[np.bool_], q: Observations, geometry: Geometry | None) -> Region:
        """The same with some sides as far out as the box is long."""
        longest = float(np.ptp(self.bounds, axis=0).max())
        return Region.within(moved(self.bounds, np.where(sides, longest, 0.0)), q, geometry)


def widened(
    look: Callable[[Region, bool], Localization],
    region: Region,
    q: Observations,
    geometry: Geometry | None,
    may: bool,
) -> tuple[Region, Localization]:
    """Look into a region, and into wider ones while an open side stops a light.

    ``look`` finds at most one light, roughly, where its second argument says so: at that glance all
    open sides are tried, since one light far out often tells already. Later they are only where no
    light was found. A wider region is kept if what it leaves is no more. Returned with what was
    found in it.
    """

    def further(region: Region, glance: bool) -> tuple[Region, Localization]:
        found = look(region, glance)
        for _ in range(WIDENINGS if may else 0):
            sides = region.met(found.lights)
            if not sides.any() and (glance or not len(found.lights)):
                sides = region.open
            if not sides.any() or found.reason is Reason.DARK or is_over():
                break
            wider = region.wider(sides, q, geometry)
            other = look(wider, glance)
            if left(other) > left(found) * (LESS if glance else ALIKE):
                break
            found, region = other, wider
        return region, found

    if may and region.open.any():
        region, _ = further(region, True)
    return further(region, False)


def left(found: Localization) -> float:
    """What an answer leaves: answers are compared whatever errors each took.

    Errors that were estimated are what its own lights leave, so that chi-square is 1 by itself;
    what is left of B then counts by its squares, as a share of those of B.
    """
    if found.noise.law is not NoiseLaw.ESTIMATED:
        return found.chi2 * float(np.square(found.noise.scale).mean())
    size = size_of(found.direct, few=3 + found.direct.shape[1])
    return robust(found.residual * found.sigma / size, WILD)


def bordered(found: Localization, region: Region) -> Localization:
    """The answer with a verdict where a light lies at an open side of the region."""
    sides = region.met(found.lights)
    return at_border(found, sides, region.bounds) if sides.any() else found


def moved(box: NDArray[np.float64], out: NDArray[np.float64]) -> NDArray[np.float64]:
    """A box (2, 3) whose sides are moved outwards by (2, 3) lengths.

    Examples
    --------
    >>> moved(np.array([[0.0, 0, 0], [1, 1, 1]]), np.array([[0, 0, 0.5], [0, 2, 0]])).tolist()
    [[0.0, 0.0, -0.5], [1.0, 3.0, 1.0]]
    """
    return box + OUTWARDS * out


def is_faced(q: Observations) -> NDArray[np.bool_]:
    """(2, 3) whether enough observations look to a side."""
    share, leaning = FACED
    return np.asarray((OUTWARDS * q.normals[:, None] > leaning).mean(axis=0) >= share)


def is_open(
    box: NDArray[np.float64], reach: NDArray[np.float64], q: Observations, geometry: Geometry | None
) -> NDArray[np.bool_]:
    """(2, 3) whether light from beyond a side of a box, up to a reach, would be observed.

    Not where the observations on the side are a wall's, or where the geometry lets none through.
    """
    depth, most = WALL
    longest = float(np.ptp(q.bounds, axis=0).max())
    sides = np.zeros((2, 3), bool)
    rows = np.random.default_rng(0).permutation(len(q))[:ON]
    some = q.at(np.sort(rows))
    for side, axis in np.ndindex(2, 3):
        out = OUTWARDS[side, 0]
        inside = out * (q.bounds[side, axis] - q.positions[:, axis])
        wall = q.normals[inside <= depth * longest, axis] * out < 0
        closes = out * (box[side, axis] - q.bounds[side, axis]) >= 0  # no wall if the box is less
        if not reach[side, axis] or (closes and wall.mean() > most):
            continue
        at = [np.linspace(low, high, LOOKS) for low, high in box.T]
        at[axis] = box[side, axis] + out * reach[side, axis] * np.linspace(0, 1, LOOKS + 1)[1:]
        places = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).reshape(-1, 3)
        sides[side, axis] = bool((shading(some, places, geometry) > 0).any())
    return sides


OUTWARDS = np.array([[-1.0], [1.0]])
"""(2, 1) which way the lower and the upper side look."""
