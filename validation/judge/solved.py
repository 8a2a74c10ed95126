"""Whether found lights are the true ones, within tolerances."""

from __future__ import annotations

from dataclasses import dataclass

from lightloc import PointLights
from validation.judge.match import compare


@dataclass(frozen=True)
class Tolerance:
    """How near counts: ``position`` as a share of the room's size, ``intensity`` in percent."""

    position: float
    intensity: float


def is_solved(
    found: PointLights, true: PointLights, tolerance: Tolerance, size: float = 1.0
) -> bool:
    """Whether the number is right, and every light is within the tolerance.

    Parameters
    ----------
    found, true
        The lights.
    tolerance
        How near counts.
    size
        Of the room, metres: the side in 2D, the diagonal in three dimensions.

    Examples
    --------
    >>> true = PointLights([[0, 0, 2], [3, 0, 2]], [10.0, 20.0])
    >>> near = PointLights([[3, 0, 2.01], [0, 0, 2]], [20.5, 10.0])
    >>> is_solved(near, true, Tolerance(0.02, 5.0)), is_solved(near, true, Tolerance(0.02, 1.0))
    (True, False)
    """
    verdict = compare(found, true, radius=tolerance.position * size)
    if verdict.missed or verdict.ghosts:
        return False
    return (verdict.worst_intensity_percent or 0.0) <= tolerance.intensity
