"""Match found lights with true ones, then count, then measure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from lightloc import PointLights, units

RADIUS = 0.05
"""A found light farther than this share of the diagonal from every true one matches none."""


@dataclass(frozen=True)
class Pair:
    """A true light and the found light that was matched with it.

    Parameters
    ----------
    true, found : int
        Index of each among its own.
    distance : float
        Between the two, in the true lights' unit of length.
    distance_percent : float
        The same, percent of the diagonal.
    intensity_percent : tuple of float
        Error of the intensity, a value per channel, percent of the true one; of the brightest
        channel where that is 0. NaN in a channel in which one of the two is unknown.

    Examples
    --------
    >>> from lightloc import PointLights
    >>> from validation import compare
    >>> true = PointLights([[0, 0, 2]], [10.0])
    >>> pair = compare(PointLights([[0, 0, 2.25]], [11.0]), true, diagonal=10.0).pairs[0]
    >>> pair.distance, pair.distance_percent, pair.intensity_percent
    (0.25, 2.5, (10.0,))
    """

    true: int
    found: int
    distance: float
    distance_percent: float
    intensity_percent: tuple[float, ...]


@dataclass(frozen=True)
class Comparison:
    """The judge's verdict on found lights.

    Parameters
    ----------
    count_true, count_found : int
        How many lights there are, and how many were found.
    pairs : tuple of Pair
        True lights with the found ones that were matched with them.
    missed : tuple of int
        Indices of true lights that none was matched with.
    ghosts : tuple of int
        Indices of found lights that none was matched with.
    unit : str
        The unit of the distances: that of the true lights.
    diagonal : float
        What percentages of distances are of, in the unit of length; NaN where it is not said.

    Examples
    --------
    One of two lights is found, and one that is not there:

    >>> from lightloc import PointLights
    >>> from validation import compare
    >>> true = PointLights([[0, 0, 2], [3, 0, 2]], [10.0, 20.0])
    >>> result = compare(PointLights([[0, 0, 2], [0, 9, 2]], [10.0, 5.0]), true, diagonal=10.0)
    >>> result.recall, result.precision, result.missed, result.ghosts
    (0.5, 0.5, (1,), (1,))
    """

    count_true: int
    count_found: int
    pairs: tuple[Pair, ...]
    missed: tuple[int, ...]
    ghosts: tuple[int, ...]
    unit: str = "m"
    diagonal: float = math.nan

    @property
    def count_right(self) -> bool:
        """Whether as many lights were found as there are."""
        return self.count_true == self.count_found

    @property
    def precision(self) -> float:
        """Share of the found lights that are real; 1 where none was found."""
        return len(self.pairs) / self.count_found if self.count_found else 1.0

    @property
    def recall(self) -> float:
        """Share of the true lights that were found; 1 where there is none."""
        return len(self.pairs) / self.count_true if self.count_true else 1.0

    @property
    def worst_position_percent(self) -> float | None:
        """The largest distance within a pair, percent of the diagonal; None without a pair."""
        return max((pair.distance_percent for pair in self.pairs), default=None)

    @property
    def worst_intensity_percent(self) -> float | None:
        """The largest error of a known intensity, percent of the true one; None without any."""
        errors = (error for pair in self.pairs for error in pair.intensity_percent)
        return max((error for error in errors if not np.isnan(error)), default=None)

    def __str__(self) -> str:
        rows = [
            f"{self.count_found} found, {self.count_true} true: "
            f"precision {self.precision:.2f}, recall {self.recall:.2f}"
        ]
        for pair in self.pairs:
            errors = ", ".join(
                "unknown" if np.isnan(e) else f"{e:.3g} %" for e in pair.intensity_percent
            )
            off = units.length(pair.distance, self.unit, 3)
            rows.append(
                f"  true light {pair.true + 1}, found light {pair.found + 1}: {off} "
                f"({pair.distance_percent:.3g} % of the diagonal), intensity {errors}"
            )
        rows += [f"  true light {i + 1} was missed" for i in self.missed]
        rows += [f"  found light {j + 1} is no true light" for j in self.ghosts]
        return "\n".join(rows)


def compare(
    found: PointLights,
    true: PointLights,
    diagonal: float | None = None,
    radius: float | None = None,
) -> Comparison:
    """Match found with true lights by least total distance, and measure the errors.

    Parameters
    ----------
    found : PointLights
        What was found; converted to the true lights' unit of length where it is in another.
    true : PointLights
        What is there.
    diagonal : float, optional
        Diagonal of the room, in the true lights' unit of length; that of their own box, or 1 m if
        that is more, where None.
    radius : float, optional
        Farthest that a pair may lie apart, in that unit; 5 % of the diagonal where None.

    Returns
    -------
    Comparison
        As many pairs as can be made within the radius, with their distances in that unit and in
        percent of the diagonal, and what is left over.

    Raises
    ------
    ValueError
        If the lights are in two units of length of which one is not known, or their intensities in
        two units, as W/sr and cd; or if there is no diagonal: none is given, the unit is not known,
        and the true lights' box is a point.

    Examples
    --------
    >>> from lightloc import PointLights
    >>> from validation import compare
    >>> true = PointLights([[0, 0, 2], [3, 0, 2]], [10.0, 20.0])
    >>> found = PointLights([[3, 0, 2.01], [0, 0, 2]], [21.0, 10.0])
    >>> result = compare(found, true, diagonal=10.0)
    >>> result.count_right, round(result.worst_position_percent, 3)
    (True, 0.1)
    """
    if units.conversion(found.unit, true.unit) is None:
        raise ValueError(
            f"the unit of length is '{found.unit}' of the found lights and '{true.unit}' of the "
            "true ones, which can't be converted; say the unit of both"
        )
    found = found.in_unit(true.unit)
    if found.intensity_unit != true.intensity_unit:
        raise ValueError(
            f"the intensities of the found lights are in {found.power}, those of the true ones in "
            f"{true.power or 'another unit'}; expected one unit"
        )
    if diagonal is None:
        box = np.ptp(true.positions, axis=0) if len(true) else np.zeros(3)
        diagonal = max(units.conversion("m", true.unit) or 0.0, float(np.linalg.norm(box)))
        if not diagonal:
            raise ValueError("the room's diagonal is not known; give it, or name the scene")
    limit = RADIUS * diagonal if radius is None else radius
    distance = np.linalg.norm(true.positions[:, None] - found.positions[None], axis=2)
    far = 2.0 * limit * (1 + distance.size)  # dearer than any set of pairs within the radius
    rows, columns = linear_sum_assignment(np.where(distance <= limit, distance, far))
    pairs = tuple(
        Pair(
            int(i),
            int(j),
            float(distance[i, j]),
            float(100 * distance[i, j] / diagonal),
            _percent(found.intensities[j], true.intensities[i]),
        )
        for i, j in zip(rows, columns, strict=True)
        if distance[i, j] <= limit
    )
    return Comparison(
        count_true=len(true),
        count_found=len(found),
        pairs=pairs,
        missed=tuple(sorted(set(range(len(true))) - {pair.true for pair in pairs})),
        ghosts=tuple(sorted(set(range(len(found))) - {pair.found for pair in pairs})),
        unit=true.unit,
        diagonal=float(diagonal),
    )


def _percent(found: NDArray, true: NDArray) -> tuple[float, ...]:
    found, true = np.broadcast_arrays(found, true)
    scale = np.where(true > 0, true, max(np.nan_to_num(true).max(), np.finfo(float).tiny))
    return tuple(float(e) for e in 100 * np.abs(found - true) / scale)
