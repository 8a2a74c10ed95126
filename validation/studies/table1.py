"""Study: the paper's Table 1 from our own scenes, with the published method and with our search."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from validation.jobs import Ended
from validation.records import Curve, Line, Row, Stroke
from validation.studies import columns, published
from validation.studies.measures import Fields, Goal, Measured, duration, mean, reaches, share
from validation.studies.study import Measure, Study


def papers(column: str, judged: bool = False, digits: int = 2) -> dict[str, Goal]:
    """The paper's figure of each row: to stand beside ours or, ``judged``, to be reached."""
    figures = {row: published.figure(row, column) for row in published.ROWS}
    return {
        row: reaches(value, digits) if judged else Goal(f"{value:.{digits}f}")
        for row, value in figures.items()
        if value is not None
    }


def times(field: str) -> tuple[tuple[str, Measured, dict[str, Goal]], ...]:
    """Median and longest of a method's seconds, each with the paper's beside it."""
    return (
        ("median (s)", duration(statistics.median, field), papers("Median", digits=0)),
        ("max (s)", duration(max, field), papers("Max", digits=0)),
    )


def of(field: str) -> Measured:
    """The share of scenes of which a field is true."""
    return share(lambda record: record[field])


def doubt(record: Fields) -> str | None:
    if record["solved"]:
        return None
    return "low error, other lights" if record["full"] else "no low error"


def said(rows: Sequence[Row]) -> str:
    known = [row for row in rows if row.ended]
    ours, oracle = (
        statistics.fmean(row.cell(title).value or 0.0 for row in known)
        for title in ("Search: Solved", "Oracle")
    )
    return f"Our search solves {ours:.2f}, a fit that starts at the true lights {oracle:.2f}."


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
    noisy = [row for row in rows if row.name.startswith("noisy")]
    lights = [float(row.name.rpartition("-")[2]) for row in noisy]

    def line(name: str, title: str, kind: Stroke = "line") -> Line:
        cells = [row.cell(title) for row in noisy]
        return Line(name, lights, [c.value for c in cells], [c.error for c in cells], kind)

    paper = [published.figure(row.name, "Solved") for row in noisy]
    return Curve(
        "Solved under noise",
        "lights",
        "share of the scenes",
        (
            line("our search", "Search: Solved"),
            line("from the truth", "Oracle", "dash"),
            line("the published method", "Solved"),
            Line("the paper", lights, paper),
        ),
    )


STUDY = Study(
    name="table1",
    title="The paper's Table 1",
    question="How often does the published method find the lights of section 6.1's scenes, beside "
    "the paper's own figures, which stand in brackets, and how often does our search? Full and "
    "Solved of both should reach the paper's.",
    per_row=columns.PER_ROW,
    names=columns.names,
    one=columns.scene,
    measures=(
        Measure(
            "Random",
            "random starts of the published method's solver that reach a low error, the number of "
            "lights known",
            mean("random"),
            papers("Random"),
        ),
        Measure("V(p)", "a low error after one round of voting", of("votes"), papers("V(p)")),
        Measure(
            "Full",
            "a low error by the published method: an MSE of B below 0.0025, or 1.05 of the true "
            "lights' under noise",
            of("full"),
            papers("Full", judged=True),
        ),
        Measure(
            "Solved",
            "these are the true lights: as many, each within 1 % of the side and 5 % of its "
            "intensity",
            of("solved"),
            papers("Solved", judged=True),
        ),
        Measure("Oracle", "solved by a fit that starts at the true lights", of("oracle")),
        *(
            Measure(title.capitalize(), "of the published method on one thread", measure, beside)
            for title, measure, beside in times("seconds")
        ),
        Measure(
            "Search: Full", "the same of our search", of("ours_full"), papers("Full", judged=True)
        ),
        Measure(
            "Search: Solved",
            "the same of our search; without noise within 0.1 % of the side",
            of("ours_solved"),
            papers("Solved", judged=True),
        ),
        *(
            Measure(f"Search: {title}", "of our search on one thread", measure, beside)
            for title, measure, beside in times("ours_seconds")
        ),
    ),
    label=lambda row: row.replace("-", ", "),
    said=said,
    doubt=doubt,
    curve=curve,
)
