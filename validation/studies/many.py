"""Study: many lights in one room, and whether an answer that says it is right is right."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from validation.jobs import Ended
from validation.records import Curve, Line, Row, Stroke
from validation.studies import scenes
from validation.studies.measures import (
    NOTHING,
    Fields,
    Figure,
    at_least,
    duration,
    records,
    share,
    tally,
)
from validation.studies.study import EVERY, Measure, Study

CHANCE = 5.0  # standard errors: a certificate of about 4 comes by chance alone
ROWS = [f"lights-{count}" for count in scenes.MANY]
HARD = ROWS[2:]  # rows in which not solving is allowed, but not in silence


def converged(record: Fields) -> bool:
    return record["reason"] == "CONVERGED"


def solved(record: Fields) -> bool:
    return record["solved"]


def says_so(record: Fields) -> bool:
    """Whether an answer shows that it may be wrong: its reason, a verdict, or the certificate."""
    doubtful = bool(record["verdicts"]) or (record["certificate"] or 0.0) > CHANCE
    return doubtful or not converged(record)


def certificate_of_unsolved(ended: Sequence[Ended]) -> Figure:
    """The median certificate of the scenes that were not solved."""
    known = [r["certificate"] for r in records(ended) if not solved(r)]
    known = [value for value in known if value is not None]
    if not known:
        return Figure(None, NOTHING)
    return Figure(statistics.median(known), f"{statistics.median(known):.2g}")


def doubt(record: Fields) -> str | None:
    if solved(record):
        return None
    return "not solved, and says so" if says_so(record) else "not solved, yet sure of it"


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    right = whole.cell("Right if converged").text
    return f"Solved: {whole.cell('Solved').text} of all. Right of those that converged: {right}."


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
    lights = [float(count) for count in scenes.MANY]
    single = [row for row in rows if row.name != EVERY]

    def line(title: str, kind: Stroke = "line") -> Line:
        cells = [row.cell(title) for row in single]
        return Line(
            title, lights, [cell.value for cell in cells], [cell.error for cell in cells], kind
        )

    return Curve(
        "Solved against the number of lights",
        "lights in the room",
        "share of the scenes",
        (line("Solved"), line("Within 0.1 %", "dash"), line("Right if converged")),
        ((0.95, "goal for 8 and 10"),),
    )


STUDY = Study(
    name="many",
    title="Many lights",
    question="How many lights can be told apart in one empty square room with 400 observations "
    "and no noise? At least 95 % of the rooms with 8 and with 10 should be solved, and of the "
    "answers that say they converged, at least 99 % should be right.",
    per_row=50,
    names=lambda per_row: scenes.numbered(ROWS, per_row),
    one=scenes.many,
    measures=(
        Measure(
            "Solved",
            "the count is right, every light within 1 % of the side and 5 % of its intensity",
            share(solved),
            dict.fromkeys(("lights-8", "lights-10"), at_least(0.95)),
        ),
        Measure(
            "Within 0.1 %",
            "solved, every light within 0.1 % of the side",
            share(lambda r: r["tight"]),
        ),
        Measure("Converged", "the answer says that it explains everything", share(converged)),
        Measure(
            "Right if converged",
            "solved, of the answers that converged",
            share(solved, converged),
            {EVERY: at_least(0.99)},
        ),
        Measure(
            "Unsolved say so",
            "of those not solved, the answers whose reason, verdict or certificate shows it",
            share(says_so, lambda r: not solved(r)),
            dict.fromkeys(HARD, at_least(1.0)),
        ),
        Measure(
            "Certificate",
            "its median over those not solved, standard errors; about 4 by chance alone",
            certificate_of_unsolved,
        ),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Verdicts", "scenes with a verdict of that kind", tally("verdicts")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: f"{row.partition('-')[2]} lights",
    said=said,
    doubt=doubt,
    together=True,
    curve=curve,
    solvers=True,
)
