"""What the command line asks of a search: its words, read."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from lightloc import Options

MOST_PATHS = 65_536
SPELLED = {3: "three", 6: "six"}
FREE = {"albedo", "ambient", "gamma"}


class Transport(StrEnum):
    direct = "direct"
    full = "full"


class Noise(StrEnum):
    given = "given"
    scaled = "scaled"
    estimate = "estimate"


def paths(text: str | None) -> int | Literal["gathered"] | None:
    """What ``--indirect`` asks for.

    Examples
    --------
    >>> paths("256"), paths("gathered"), paths(None)
    (256, 'gathered', None)
    """
    if text is None:
        return None
    if text == "gathered":
        return "gathered"
    if not (text.isdecimal() and text.isascii() and len(text) < 6 and 2 <= int(text) <= MOST_PATHS):
        raise ValueError(
            f"--indirect {text}: expected a number from 2 to {MOST_PATHS}, or gathered"
        )
    return int(text)


def point(text: str) -> list[float]:
    """The position of ``--camera``.

    Examples
    --------
    >>> point("0.3,0.3,1.7")
    [0.3, 0.3, 1.7]
    """
    return _numbers("--camera", text, "X,Y,Z")


def _numbers(option: str, text: str, expected: str) -> list[float]:
    """As many numbers as there are words in what is expected."""
    words = text.split(",")
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    count = len(expected.split(","))
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ValueError(f"{option} {text}: expected {SPELLED[count]} numbers, {expected}")
    return values


def box(text: str | None) -> list[list[float]] | None:
    """The two corners of ``--bounds``.

    Examples
    --------
    >>> box("-2,-2,0,2,2,3")
    [[-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]]
    """
    if text is None:
        return None
    corners = _numbers("--bounds", text, "X0,Y0,Z0,X1,Y1,Z1")
    return [corners[:3], corners[3:]]


def asked(
    method: str,
    ambient: bool,
    noise: Noise,
    free: str | None,
    false_alarm: float | None,
    most_lights: int | None = None,
) -> Options | None:
    """The options of our own search; what can't be right is named as on the command line."""
    from lightloc import Options

    if method != "search":
        return None
    words: tuple[Any, ...] = () if free is None else tuple(free.split(","))
    if not set(words) <= FREE:
        raise ValueError(f"--free {free}: expected some of albedo, ambient, gamma")
    try:
        o = Options(ambient=ambient, noise=noise.value, free=words)
        given: dict[str, Any] = {"false_alarm": false_alarm, "most_lights": most_lights}
        return replace(o, **{name: x for name, x in given.items() if x is not None})
    except ValueError as error:
        raise ValueError(str(error).replace("Options.false_alarm", "--false-alarm")) from None
