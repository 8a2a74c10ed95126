"""Study: how faint a light a search still finds, beside what the likelihood ratio tells."""

from __future__ import annotations

from collections.abc import Sequence

from validation.jobs import Ended
from validation.records import Curve, Line, Row
from validation.studies.measures import Fields, at_most, bounded, duration, tally
from validation.studies.power_trial import STRENGTHS, power
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study, pooled


def found(record: Fields) -> bool:
    return bool(record["found"] == record["lights"])


def by_ratio(record: Fields) -> bool:
    return bool(record["gain"] > record["needed"])


def too_many(record: Fields) -> bool:
    return bool(record["found"] > record["lights"])


def doubt(record: Fields) -> str | None:
    if by_ratio(record) and not found(record):
        return f"not found, though it gains {record['gain']:.0f} of {record['needed']:.0f} needed"
    return "too many lights" if too_many(record) else None


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
    single = [row for row in rows if row.name != EVERY]
    strengths = [float(row.name.removeprefix("x")) for row in single]
    lines = []
    for title in ("Found", "By the ratio"):
        cells = [row.cell(title) for row in single]
        values, errors = [cell.value for cell in cells], [cell.error for cell in cells]
        kind = "line" if title == "Found" else "dash"
        lines.append(Line(title, strengths, values, errors, kind))  # type: ignore[arg-type]
    return Curve(
        "How often a faint light is found",
        "its intensity, in errors at the bound",
        "share of the rooms",
        tuple(lines),
        log_x=True,
    )


STUDY = Study(
    name="power",
    title="Faint lights",
    question="How faint a light is still found beside one or two bright ones, at 1 % noise and a "
    "false alarm of 5 %? Beside it stands the likelihood ratio with known noise, which is told "
    "where the light is: its gain in chi-square against what noise alone gains in one search of "
    "twenty.",
    per_row=100,
    names=lambda per_row: numbered([f"x{strength:g}" for strength in STRENGTHS], per_row),
    one=power,  # type: ignore[arg-type]  # a record of its own
    measures=(
        Measure("Found", "the count is right", bounded(found)),
        Measure("By the ratio", "the gain of a fit from the truth is enough", bounded(by_ratio)),
        Measure(
            "Stated errors",
            "found, where the data state theirs",
            bounded(found, lambda r: r["stated"]),
        ),
        Measure("Unknown", "found, where they do not", bounded(found, lambda r: not r["stated"])),
        Measure("Too many", "more are found", bounded(too_many), {EVERY: at_most(0.06)}),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: f"{row.removeprefix('x')} × the least",
    said=pooled("Found", "By the ratio"),
    doubt=doubt,
    together=True,
    curve=curve,
)
