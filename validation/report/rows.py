"""A case's lights: rows of the page's table, and marks in its figures."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from validation.draw import Light
from validation.records import FoundLight, Pair, Result, TrueLight
from validation.report.words import intensity, length, measured, number, percent


@dataclass(frozen=True)
class LightRow:
    """One line of the table; `kind` is 'pair', 'missed' or 'ghost'."""

    kind: str
    name: str
    true_position: list[str]
    found_position: list[str]
    distance: str
    distance_percent: str
    deviation: str
    true_intensity: str
    found_intensity: list[str]
    intensity_percent: str
    bound: str


def light_rows(result: Result) -> list[LightRow]:
    """List a case's lights: pairs in the order of the true lights, then missed, then ghosts."""
    if result.lights is None or result.comparison is None:
        return []
    true, found = result.lights.true, result.lights.found
    rows = [
        _row(
            "pair",
            result.unit,
            f"{pair.true + 1} ↔ {pair.found + 1}",
            true[pair.true],
            found[pair.found],
            pair,
        )
        for pair in sorted(result.comparison.pairs, key=lambda pair: pair.true)
    ]
    rows += [
        _row("missed", result.unit, str(i + 1), true=true[i]) for i in result.comparison.missed
    ]
    rows += [
        _row("ghost", result.unit, str(i + 1), found=found[i]) for i in result.comparison.ghosts
    ]
    return rows


def light_marks(result: Result) -> list[Light]:
    """A case's lights as its figures show them."""
    if result.lights is None or result.comparison is None:
        return []
    true, comparison = result.lights.true, result.comparison
    marks = []
    for i, light in enumerate(true):
        text = f"true light {i + 1}: {intensity(light.intensity, result.unit)}"
        marks.append(Light("missed" if i in comparison.missed else "true", light.position, text))
    partner = {pair.found: pair for pair in comparison.pairs}
    for i, light in enumerate(result.lights.found):
        text = f"found light {i + 1}: {intensity(light.intensity, result.unit)}<br>"
        pair = partner.get(i)
        if pair is None:
            text += "a ghost: no true light is near"
            marks.append(Light("ghost", light.position, text))
            continue
        off = f"{length(pair.distance, result.unit)} ({percent(pair.distance_percent)})"
        text += f"{off} from true light {pair.true + 1}"
        marks.append(Light("found", light.position, text, true[pair.true].position))
    return marks


def deviation(true: TrueLight, found: FoundLight) -> float | None:
    """Return the position's error in standard errors, the root mean square over the axes.

    About 1 where the standard errors are honest; None where one is missing or zero.

    Examples
    --------
    >>> true = TrueLight(position=[0, 0, 0], intensity=[1])
    >>> deviation(true, FoundLight(position=[2, 2, 2], intensity=[1], position_error=[1, 1, 1]))
    2.0
    >>> deviation(true, FoundLight(position=[2, 2, 2], intensity=[1]))
    """
    squares = []
    for at, truth, error in zip(found.position, true.position, found.position_error, strict=True):
        if at is None or truth is None or not error:
            return None
        squares.append(((at - truth) / error) ** 2)
    return math.sqrt(sum(squares) / len(squares))


def _row(
    kind: str,
    unit: str,
    name: str,
    true: TrueLight | None = None,
    found: FoundLight | None = None,
    pair: Pair | None = None,
) -> LightRow:
    apart = deviation(true, found) if true and found else None
    return LightRow(
        kind=kind,
        name=name,
        true_position=_list(true.position, []) if true else [],
        found_position=_list(found.position, found.position_error) if found else [],
        distance=length(pair.distance, unit) if pair else "",
        distance_percent=percent(pair.distance_percent) if pair else "",
        deviation=f"{number(apart, 2)} σ" if apart is not None else "",
        true_intensity=intensity(true.intensity, unit) if true else "",
        found_intensity=_list(found.intensity, found.intensity_error) if found else [],
        intensity_percent=" · ".join(percent(e) for e in pair.intensity_percent) if pair else "",
        bound=intensity(found.bound, unit) if found and found.bound else "",
    )


def _list(values: Sequence[float | None], errors: Sequence[float | None]) -> list[str]:
    padded = [*errors, *[None] * len(values)]
    if not errors:
        return [number(value, 4) for value in values]
    return [measured(value, error) for value, error in zip(values, padded, strict=False)]
