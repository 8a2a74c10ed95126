"""Numbers and names as a reader meets them."""

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from validation.records import UNKNOWN, Result

NOTHING = "–"
LEAST_PERCENT = 0.001
THIN_SPACE = "\u202f"  # a narrow one that does not break
GROUPED_FROM = 1e4
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
CONTROL = re.compile(
    r"\x1b\[[0-9;?]*[ -/]*[@-~]|[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
)
SYMBOLS = {"passed": "✓", "failed": "✗", "crashed": "!", "shown": "○"}
MEANINGS = {
    "failed": "a limit was not kept",
    "crashed": "the case's process died",
    "shown": "run, but not gated",
    "passed": "every limit was kept",
}
BRDFS = {"mixed": "mixed materials"}


def number(value: float | None, digits: int = 3) -> str:
    """Write a number with so many significant digits; a dash where there is none.

    Examples
    --------
    >>> [number(value) for value in (None, float("inf"), 0, -0.5, 1.2345, 999.9, 1e6, 2.5e-7)]
    ['–', '–', '0', '−0.5', '1.23', '1000', '10⁶', '2.5·10⁻⁷']
    """
    if value is None or not math.isfinite(value):
        return NOTHING
    if value != 0 and not 1e-4 <= abs(value) < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        power = "10" + str(int(exponent)).translate(SUPERSCRIPT)
        return power if float(mantissa) == 1 else f"{_minus(f'{float(mantissa):g}')}·{power}"
    text = f"{float(f'{value:.{digits}g}'):.15g}"
    if abs(value) >= GROUPED_FROM:
        text = f"{float(text):,.0f}".replace(",", THIN_SPACE)
    return _minus(text)


def solver(method: str) -> str:
    """A short name for a solver: of a function its module's, and its own where that says more.

    Examples
    --------
    >>> [solver(name) for name in ("paper", "mine.adam:solve", "/home/me/grid.py:fast")]
    ['paper', 'adam', 'grid-fast']
    """
    where, _, function = method.rpartition(":")
    if not where:
        return method
    module = Path(where).stem if where.endswith(".py") else where.rpartition(".")[2]
    return module if function == "solve" else f"{module}-{function}"


def percent(value: float | None) -> str:
    """Write a percentage, so that the eye can compare: two digits, and no more than needed."""
    return NOTHING if value is None else f"{number(value, 2)} %"


def briefly(value: float | None) -> str:
    """Write a percentage for a narrow cell, where below a thousandth nothing is to be seen."""
    return f"< {LEAST_PERCENT} %" if value is not None and value < LEAST_PERCENT else percent(value)


def length(value: float | None, unit: str) -> str:
    """Write a length: one in metres in the unit that suits it, any other in its own.

    Examples
    --------
    >>> length(0.0213, "m"), length(2.13, "in"), length(2.13, "unit")
    ('2.13 cm', '2.13 in', '2.13 units')
    """
    if value is None or not math.isfinite(value):
        return NOTHING
    if unit != "m":
        return f"{number(value)} {'units' if unit == UNKNOWN else unit}"
    for unit, size in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)):
        if abs(value) >= size:
            return f"{number(value / size)} {unit}"
    return f"{number(value * 1e6, 2)} µm"


def seconds(value: float | None) -> str:
    """Write a duration in the unit that suits it."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if value >= 3600:
        return f"{int(value // 3600)} h {int(value % 3600 // 60)} min"
    if value >= 60:
        return f"{int(value // 60)} min {int(value % 60)} s"
    return f"{number(value, 2)} s"


def measured(value: float | None, error: float | None) -> str:
    """Write a value with its standard error, both to the error's second digit."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if error is None or not math.isfinite(error) or error <= 0:
        return _minus(f"{value:.4f}")
    decimals = min(max(1 - math.floor(math.log10(error)), 0), 6)
    return _minus(f"{value:.{decimals}f}") + " ± " + f"{error:.{decimals}f}"


def intensity(channels: Sequence[float | None], unit: str) -> str:
    """Write a radiant intensity, by channel where it has three, of a scene in a unit of length."""
    return " · ".join(number(channel) for channel in channels) + (" W/sr" if unit == "m" else "")


def measures(result: Result) -> str:
    """In what a case's positions and intensities are."""
    lengths = "the scene's own unit" if result.unit == UNKNOWN else result.unit
    return f"Positions in {lengths}" + (result.power and f" and intensities in {result.power}")


def material(result: Result) -> str:
    """Name a case's BRDF, with its roughness."""
    name = BRDFS.get(result.brdf, result.brdf)
    return name if result.alpha is None else f"{name}, α {number(result.alpha)}"


def noise(value: float) -> str:
    """Name a noise level."""
    return "no noise" if value == 0 else f"{number(100 * value)} % noise"


def moment(text: str) -> str:
    """Write an ISO date and time as people do, in UTC; anything else is left as it stands."""
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        return text or "no date"
    if when.tzinfo is None:
        return when.strftime("%Y-%m-%d %H:%M")
    return when.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")


def plain(text: str) -> str:
    """Drop what no page and no XML may hold: terminal colours and control characters."""
    return CONTROL.sub("", text)


def _minus(text: str) -> str:
    return text.replace("-", "−")
