"""Study: lights among discs that cast shadows, beside the Cramér-Rao ceiling of every rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.jobs import Ended
from validation.records import Curve, Line, Row, Stroke
from validation.studies import scenes
from validation.studies.many import converged, says_so, solved
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    at_least,
    duration,
    records,
    share,
    tally,
    typical,
)
from validation.studies.study import Measure, Study

STROKES: tuple[tuple[str, Stroke], ...] = (("Solved", "line"), ("Ceiling", "dash"))
BELOW = -0.03  # how far a rate may stay below its ceiling


def ceiling(ended: Sequence[Ended]) -> Figure:
    """The mean probability of being solved at the bound, with the error of that mean."""
    known = [record["ceiling"] for record in records(ended)]
    if not known:
        return NO_FIGURE
    error = float(np.std(known) / np.sqrt(len(known)))
    return Figure(float(np.mean(known)), f"{np.mean(known):.2f}", error)


def over_ceiling(ended: Sequence[Ended]) -> Figure:
    """Solved less the ceiling, with the binomial error of the former: the rooms are the same."""
    rate, most = share(solved)(ended), ceiling(ended)
    if rate.value is None or most.value is None:
        return NO_FIGURE
    value = rate.value - most.value
    return Figure(value, f"{value:+.3f}".replace("-", "−"), rate.error)


def doubt(record: Fields) -> str | None:
    if solved(record):
        return None
    word = "says so" if says_so(record) else "sure of it"
    return f"not solved, {word}; the ceiling is {record['ceiling']:.2f}"


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    return (
        f"Solved: {whole.cell('Solved').text} of all; the ceiling is {whole.cell('Ceiling').text}."
    )


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
    lines = []
    for discs in scenes.DISCS:
        own = [row for row in rows if row.name.startswith(f"discs-{discs}-")]
        lights = [float(row.name.rpartition("-")[2]) for row in own]
        for title, kind in STROKES:
            cells = [row.cell(title) for row in own]
            errors = [cell.error for cell in cells] if kind == "line" else None
            name = f"{discs} discs, {title.lower()}"
            lines.append(Line(name, lights, [cell.value for cell in cells], errors, kind))
    return Curve(
        "Solved (full lines) and the ceiling (dashed)",
        "lights in the room",
        "share of the scenes",
        tuple(lines),
        caption="The ceiling is that of an unbiased estimator which knows what is visible. Shadow "
        "edges tell more than it counts, so a rate may lie above it.",
    )


STUDY = Study(
    name="occluders",
    title="Lights among occluders",
    question="How often are the lights found in square rooms with discs that cast shadows, at 1 % "
    "noise? A scene is solved with the right count and every light within 2 % of the side and 10 % "
    "of its intensity; the rate should be no more than 0.03 below the Cramér-Rao ceiling.",
    per_row=100,
    names=lambda per_row: scenes.numbered(
        [f"discs-{d}-lights-{k}" for d in scenes.DISCS for k in scenes.AMONG_DISCS], per_row
    ),
    one=scenes.occluders,
    measures=(
        Measure(
            "Solved",
            "the count is right, every light within 2 % of the side and 10 % of its intensity",
            share(solved),
        ),
        Measure("Ceiling", "mean probability of that for errors at the Cramér-Rao bound", ceiling),
        Measure("Solved − ceiling", "their difference", over_ceiling, at_least(BELOW)),
        Measure("Converged", "the answer says that it explains everything", share(converged)),
        Measure(
            "Right if converged", "solved, of the answers that converged", share(solved, converged)
        ),
        Measure(
            "Unsolved say so",
            "of those not solved, those whose answer shows it",
            share(says_so, lambda r: not solved(r)),
        ),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: "{1} discs, {3} lights".format(*row.split("-")),
    said=said,
    doubt=doubt,
    together=True,
    curve=curve,
    solvers=True,
)
