"""Units of length: what they are called, how large they are, and how lights are printed in them."""

from __future__ import annotations

import numpy as np

UNKNOWN = "unit"
"""The word for a length of which nobody has said how long it is."""

METRES = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 0.001,
    "um": 1e-6,
    "µm": 1e-6,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
}
"""Metres to the units that can be converted; any other word serves as a name alone."""


LARGE = 1e7
"""From which on a number has an exponent."""


def conversion(given: str, wanted: str) -> float | None:
    """How many of one unit make another; None where that is not known.

    Examples
    --------
    >>> conversion("m", "cm"), conversion("ell", "ell"), conversion("unit", "m")
    (100.0, 1.0, None)
    """
    if given == wanted:
        return 1.0
    if given not in METRES or wanted not in METRES:
        return None
    return float(f"{METRES[given] / METRES[wanted]:.12g}")  # 1 m is 1000 mm to the last bit


def is_other(a: str, b: str) -> bool:
    """Whether two units are known to be different ones.

    Examples
    --------
    >>> is_other("m", "cm"), is_other("m", "m"), is_other("m", "unit")
    (True, False, False)
    """
    return a != b and UNKNOWN not in (a, b)


def length(value: float, unit: str, digits: int = 2) -> str:
    """A length in a sentence.

    Examples
    --------
    >>> length(0.0213, "cm"), length(0.0213, "unit")
    ('0.021 cm', '0.021 units')
    """
    return f"{brief(value, digits)} {'units' if unit == UNKNOWN else unit}"


def brief(value: float, digits: int = 2) -> str:
    """A number to so many digits, and whole where it is large: no exponent below ten million.

    Examples
    --------
    >>> brief(0.0213), brief(263.0), brief(1e9)
    ('0.021', '260', '1e+09')
    """
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+0" in text and abs(value) < LARGE else text


def power(unit: str) -> str:
    """In what the intensities of lights are whose places are in a unit; empty where nobody knows.

    Examples
    --------
    >>> power("m"), power("cm"), power("unit")
    ('W/sr', '0.0001 W/sr', '')
    """
    if unit == "m":
        return "W/sr"
    if unit in METRES:
        return f"{METRES[unit] ** 2:g} W/sr"
    return "" if unit == UNKNOWN else f"W sr^-1 m^-2 {unit}^2"


def light(where: list[str], bright: list[str], unit: str, intensity_unit: str = "") -> str:
    """A row with the place and the intensities of a light, which may have a unit of their own.

    Examples
    --------
    >>> light(["0", "0", "2"], ["10"], "m"), light(["0", "0", "200"], ["100000"], "cm")
    ('(0, 0, 2) m   10 W/sr', '(0, 0, 200) cm   100000')
    >>> light(["0", "0", "200"], ["10"], "cm", "cd")
    '(0, 0, 200) cm   10 cd'
    """
    lengths = "" if unit == UNKNOWN else f" {unit}"
    row = f"({', '.join(where)}){lengths}   {', '.join(bright)}"
    power = intensity_unit or ("W/sr" if unit == "m" else "")
    return f"{row} {power}" if power else row


def explained(unit: str, intensity_unit: str = "") -> list[str]:
    """What is said once below such rows: in what the intensities are; nothing in metres.

    Examples
    --------
    >>> explained("m"), explained("cm"), explained("cm", "cd")
    ([], ['Intensities are in units of 0.0001 W/sr.'], [])
    >>> explained("unit")
    ["Lengths are in the scene's own unit, intensities in W sr^-1 m^-2 times its square."]
    >>> explained("unit", "lx unit^2")
    ["Lengths are in the scene's own unit."]
    """
    if intensity_unit:
        return ["Lengths are in the scene's own unit."] if unit == UNKNOWN else []
    if unit == "m":
        return []
    if unit == UNKNOWN:
        said = "Lengths are in the scene's own unit, intensities in W sr^-1 m^-2 times its square."
        return [said]
    return [f"Intensities are in {'units of ' if unit in METRES else ''}{power(unit)}."]


def figure(value: float, unit: str) -> str:
    """A coordinate or an intensity: to four places in metres, to six digits in any other unit.

    Examples
    --------
    >>> figure(3.1, "m"), figure(240000.04, "mm"), figure(0.0031, "km")
    ('3.1000', '240000', '0.0031')
    """
    return (
        f"{value:.4f}"
        if unit == "m"
        else np.format_float_positional(float(f"{value:.6g}"), trim="-")
    )
