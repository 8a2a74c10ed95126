"""The answer as a table: in a console, in a notebook, as a data frame."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from lightloc import units

if TYPE_CHECKING:
    from lightloc.answer.result import Localization

LEAST = 1e-5
"""An error below which two digits of it would be too many of the value."""

MISFITS = ("NO_GAIN", "MOST_LIGHTS")
"""Reasons of answers that do not explain the data."""

DOUBTED = "Do not lean on these errors: with a wrong model, lights may be much farther off."
"""Said of theirs."""

GAP = "  "
"""Between columns."""


def table(found: Localization) -> tuple[list[str], list[list[str]]]:
    """Headings, and a row for each light: its number, place and intensity, and what is in doubt."""
    unit, own = found.unit, found.lights.intensity_unit
    power = own or ("W/sr" if unit == "m" else "")
    lengths = "" if unit == units.UNKNOWN else f" ({unit})"
    head = ["light", f"position{lengths}", f"intensity ({power})" if power else "intensity", ""]
    rows = []
    for i, (p, e) in enumerate(zip(found.lights.positions, found.position_error, strict=True)):
        bright = zip(found.lights.intensities[i], found.intensity_error[i], strict=True)
        rows.append(
            [
                str(i + 1),
                ", ".join(_known(a, off, unit) for a, off in zip(p, e, strict=True)),
                ", ".join("unknown" if np.isnan(a) else _known(a, off, unit) for a, off in bright),
                _doubts(found, i),
            ]
        )
    return head if any(row[-1] for row in rows) else head[:-1], rows


def text(found: Localization) -> str:
    """Why the search stopped, the table, and a sentence each for all else that is said."""
    count = len(found.lights)
    lines = [f"{count} light{'s' * (count != 1)}. {found.reason.value}"]
    if count:
        head, rows = table(found)
        lines += [f"  {line}" for line in _aligned([head, *(row[: len(head)] for row in rows)])]
        said = units.explained(found.unit, found.lights.intensity_unit)
        lines += [f"  {sentence}" for sentence in said]
    return "\n".join([*lines, *(f"  {sentence}" for sentence in sentences(found))])


def html(found: Localization) -> str:
    """The same for a notebook."""
    head, rows = table(found)
    cells = [f"<tr>{''.join(f'<td>{escape(c)}</td>' for c in r[: len(head)])}</tr>" for r in rows]
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    whole = f"<table><thead><tr>{titles}</tr></thead><tbody>{''.join(cells)}</tbody></table>"
    first, *_ = text(found).split("\n")
    below = [*units.explained(found.unit, found.lights.intensity_unit), *sentences(found)]
    said = "".join(f"<br>{escape(sentence)}" for sentence in below)
    return f"<p>{escape(first)}</p>{whole if rows else ''}<p>{said.removeprefix('<br>')}</p>"


def columns(found: Localization) -> dict[str, Any]:
    """Columns of numbers by name, a row for each light; the colours of RGB apart."""
    lights, result = found.lights, dict[str, Any]()
    for axis, name in enumerate("xyz"):
        result[name] = lights.positions[:, axis]
        result[f"{name}_error"] = found.position_error[:, axis]
    names = ["intensity"] if lights.channels == 1 else [f"intensity_{c}" for c in "rgb"]
    for channel, name in enumerate(names):
        result[name] = lights.intensities[:, channel]
        result[f"{name}_error"] = found.intensity_error[:, channel]
    result["width"] = found.width
    result["verdicts"] = [_doubts(found, i) for i in range(len(lights))]
    return result


def sentences(found: Localization) -> list[str]:
    """What is said below the table."""
    said = [verdict.sentence for verdict in found.verdicts]
    if len(found.lights) and found.reason.name in MISFITS:
        said.append(DOUBTED)
    if found.ambient.any():
        said.append(f"Ambient radiance: {', '.join(f'{a:.3g}' for a in found.ambient)}.")
    said += found.remarks
    if found.why:
        said.append(f"{found.why} Interreflected light was {found.way.value}.")
    told = {verdict.kind for verdict in found.verdicts}
    return said + [f"Fitted too: {d.sentence}." for d in found.departures if d.kind not in told]


def _doubts(found: Localization, i: int) -> str:
    """The kinds of the verdicts on a light, by its index; each once."""
    return ", ".join(dict.fromkeys(v.kind.name for v in found.verdicts if i in v.lights))


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = ([c.ljust(w) for c, w in zip(row, widths, strict=True)] for row in rows)
    return [GAP.join(row).rstrip() for row in padded]


def _known(value: float, error: float, unit: str) -> str:
    """The value to the two digits that its error has, and that.

    Examples
    --------
    >>> _known(861.4538, 26.31, "m"), _known(1.37219, 0.00081, "m"), _known(1270.4, 263.0, "mm")
    ('861 ± 26', '1.37219 ± 0.00081', '1270 ± 260')
    >>> _known(2.0, 0.0, "m"), _known(2.0, 3.1e-08, "m"), _known(2.0, np.inf, "m")
    ('2.0000 ± 0', '2.0000 ± 3e-08', '2.0000 ± inf')

    Nothing where another solver states no error:

    >>> _known(2.0, np.nan, "m")
    '2.0000'
    """
    if not LEAST < error < units.LARGE:
        return units.figure(value, unit) + ("" if np.isnan(error) else f" ± {error:.1g}")
    digits = 1 - int(np.floor(np.log10(error)))
    places = max(0, digits)
    return f"{round(value, digits):.{places}f} ± {round(error, digits):.{places}f}"
