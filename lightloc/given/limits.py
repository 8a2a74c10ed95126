"""What a sensor's range and its steps hide: values that are clipped, lost in its floor, or rounded.

Each is told by what neither noise nor geometry makes: the same value again and again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import binom

from lightloc.given.observations import Observations
from lightloc.given.steps import step_of

BITS = (8, 10, 12, 14, 16)
"""Of sensors: the last step that so many bits count is their maximum."""

BENEATH = 16
"""Different values beneath the brightest, beside whose repeats its own are counted."""

ON_A_LINE, ON_A_SURFACE = 0.25, 0.1
"""Share of all these that the brightest holds, at most. About a maximum B is a square: as many
points of a surface, 1 in 17, are in each step, and of a line in 2D 1 in sqrt(17)."""

LUCK = 1e-6
"""Chance at which it holds as many all the same."""

TIES, SOME = 3, 50
"""Equal maxima that noise never makes where so many other values are all different."""

MANY = 10
"""Equal minima, and as many others, before a floor is asked for."""

LOWEST, SHARE = 20, 0.005
"""The least lit values of all: so many at least, or that share."""

HALF = 0.5
"""Of a step: what rounding to the least value may hide."""

PILED = 1.5
"""Times the least of these at most is the greatest: a floor cuts B off where it has many values."""

NEIGHBOURS = 6
"""Of each point; dark ones among them make it a border."""

BORDER, ENRICHED = 0.5, 2.0
"""Share of the lowest at a border, at least, and times that of all others: beside a shadow's edge B
is of any size. Of 400 made-up rooms with shadows 3 have such zeros by chance."""

TURN = 0.25
"""Of the diagonal: so far apart count two points whose normals differ by one radian."""


@dataclass(frozen=True, eq=False)
class Limits:
    """What was left out because the sensor could not tell it, and how finely it told the rest.

    Parameters
    ----------
    clipped : (n,) array of bool
        Where the sensor was at its maximum: the true value is at least as high.
    floored : (n,) array of bool
        Where it was at its floor: the true value is below all that it told.
    step : float
        Spacing of the values of radiance, W sr^-1 m^-2; 0 where they are not quantized.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Limits
    >>> top = np.array([True, False, False])
    >>> print(Limits(clipped=top, floored=~top & False, step=0.01))
    Left out of 3 observations: 1 clipped. Values are in steps of 0.01.
    """

    clipped: NDArray[np.bool_] = field(repr=False)
    floored: NDArray[np.bool_] = field(repr=False)
    step: float = 0.0

    @property
    def left_out(self) -> NDArray[np.bool_]:
        """(n,) which observations are not used."""
        return self.clipped | self.floored

    def __str__(self) -> str:
        counts = {"clipped": self.clipped.sum(), "at the sensor's floor": self.floored.sum()}
        parts = ", ".join(f"{count:,} {what}" for what, count in counts.items() if count)
        said = [f"Left out of {len(self.clipped):,} observations: {parts}."] if parts else []
        if self.step:
            said.append(f"Values are in steps of {self.step:.3g}.")
        return " ".join(said)


def limits_of(q: Observations, look: bool) -> Limits:
    """What the observations say of their sensor; with ``look``, also what only their values tell.

    What is said wins over what is told.
    """
    nowhere = np.zeros(len(q), bool)
    clipped, step = q.saturated, q.step
    floored = nowhere if q.floor is None else (q.radiance <= q.floor).any(axis=1) & (q.floor > 0)
    if look and not step:
        step = step_of(q.radiance)
    if look and not clipped.any():
        flat = np.ptp(q.positions[:, 2]) == 0 and not q.normals[:, 2].any()
        clipped = clipped_in(q.radiance, step, ON_A_LINE if flat else ON_A_SURFACE)
    least = (q.radiance == q.radiance.min(axis=0)).sum(axis=0)
    if look and q.floor is None and least.max() >= MANY:
        near = around(q)
        floored = np.any([at_floor(B, step, near) for B in q.radiance.T], axis=0)
    return Limits(clipped, floored & ~clipped, step)


def clipped_in(
    radiance: NDArray[np.float64], step: float = 0.0, share: float = ON_A_SURFACE
) -> NDArray[np.bool_]:
    """(n,) which of (n, c) values are clipped in some channel."""
    return np.any([at_most(B, step, share) for B in radiance.T], axis=0)


def at_most(b: NDArray[np.float64], step: float, share: float) -> NDArray[np.bool_]:
    """(n,) which of (n,) values are clipped: more are equal to the brightest than are by chance.

    By chance at most that ``share`` of those that are among the brightest few values.
    """
    values, counts = np.unique(b[b > 0], return_counts=True)
    if len(values) < 2:
        return np.zeros(len(b), bool)
    most, others = counts[-1], counts[:-1]
    full = bool(step) and round(values[-1] / step) in [2**bits - 1 for bits in BITS]
    if others.max() == 1 and len(others) >= SOME:
        repeated = most >= TIES
    else:
        repeated = binom.sf(most - 1, most + others[-BENEATH:].sum(), share) < LUCK
    clipped = (full or repeated) and most <= others.sum()  # else B is constant
    return np.asarray((b == values[-1]) & clipped)


def at_floor(b: NDArray[np.float64], step: float, near: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(n,) which of (n,) values a floor has cut off, and put at the least value of all.

    Where a surface is in shadow, or turned away, B is 0 as well; those stay. But B falls steeply
    there, or fades to nothing; at a floor it ends with many values just above, and beside these lie
    the dark ones.
    """
    least = b.min()
    dark = b == least
    lit = np.flatnonzero(~dark)
    if min(dark.sum(), len(lit) // 4) < MANY or least < 0:
        return np.zeros(len(b), bool)
    height = b[lit] - least
    some = min(max(LOWEST, int(SHARE * len(lit))), len(lit) // 4)
    low = height <= np.sort(height)[some - 1]
    border = dark[near[lit]].any(axis=1)
    cut = (
        height.min() > (1 + HALF) * step
        and height[low].max() <= PILED * height.min()
        and border[low].mean() >= max(BORDER, ENRICHED * border[~low].mean())
    )
    return dark & cut


def around(q: Observations) -> NDArray[np.intp]:
    """(n, k) the nearest neighbours of each of n points, on surfaces that face the same way."""
    places = with_facing(q)
    _, near = cKDTree(places).query(places, k=min(NEIGHBOURS + 1, len(q)))
    return np.asarray(near).reshape(len(q), -1)


def with_facing(q: Observations) -> NDArray[np.float64]:
    """(n, 6) positions and normals: points whose surfaces face other ways lie far apart."""
    return np.hstack([q.positions, TURN * q.diagonal * q.normals])
