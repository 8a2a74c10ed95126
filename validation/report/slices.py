"""The fields' slices on a case's page: which there are, and what is said of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.draw import Light, embedded, slices
from validation.records import Result
from validation.report.words import length

NEAR = 0.05  # of the room's diagonal: lights this close to the slice are drawn on it
CAPTIONS = {
    "D": (
        "the brightest that a light at p can be",
        "Every observation bounds a light at p from above; the intensity-distance field D is the "
        "least of these bounds (Eq. 6). At a true light it is at least the light's own intensity.",
    ),
    "L": (
        "which surface limits it",
        "The colour is that of the surface whose bound is the least (Eq. 7): the hue runs around "
        "the walls as in the frame, the lightness from floor to ceiling. Many small cells meet at "
        "a light; broad ones are where few surfaces decide.",
    ),
    "V": (
        "the votes for a light at p",
        "How many different surfaces limit the neighbourhood of p (Eq. 8), counted by the distance "
        "from one to the next (section 4.3): they agree on one intensity there, and so vote for a "
        "light. The peaks are the paper's first candidates.",
    ),
}

Array = NDArray[Any]


@dataclass(frozen=True)
class Slice:
    """One field's figure and what is written around it."""

    name: str
    title: str
    caption: str
    figure: str


@dataclass(frozen=True)
class Slices:
    """All slices at one height, and which lights they show."""

    height: float
    near: str
    slices: list[Slice]


def draw_slices(
    arrays: Mapping[str, Array],
    room: Mapping[str, Array] | None,
    lights: Sequence[Light],
    result: Result,
) -> Slices:
    """Draw fields.npz's arrays; row 0 of a field is at ymin.

    Raises
    ------
    ValueError
        The extent is no rectangle, or a field has the wrong shape.
    """
    height, reach = (
        float(arrays["height"]),
        NEAR * (result.diagonal or float(np.ptp(arrays["extent"]))),
    )
    close = [light for light in lights if _off(light, height) <= reach]
    drawn = []
    for name, figure in slices(arrays, room, close, result.unit, result.power).items():
        title, caption = CAPTIONS[name]
        note = _note(arrays["D"]) if name == "D" else ""
        drawn.append(Slice(name, title, caption + note, embedded(figure)))
    return Slices(height, _near(length(reach, result.unit), len(lights) - len(close)), drawn)


def _off(light: Light, height: float) -> float:
    x, y, z = light.at
    return np.inf if x is None or y is None or z is None else abs(z - height)


def _note(D: Array) -> str:
    dark = " Darkest where D is 0: a surface that a light there would light is dark."
    blank = " Blank where no observation bounds a light."
    return (dark if (D == 0).any() else "") + ("" if np.isfinite(D).all() else blank)


def _near(reach: str, elsewhere: int) -> str:
    words = f"Lights within {reach} of the slice are drawn"
    if elsewhere == 0:
        return words + "; none lies farther off"
    return words + f"; {elsewhere} true or found lie farther off"
