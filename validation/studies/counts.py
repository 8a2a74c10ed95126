"""Study: whether the counts that an answer allows hold the true one, and no more than they must."""

from __future__ import annotations

from collections.abc import Sequence

from validation.jobs import Ended
from validation.records import Row
from validation.studies.counts_trial import counts
from validation.studies.coverage import right
from validation.studies.many import converged
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    Measured,
    at_least,
    at_most,
    bounded,
    duration,
    records,
    tally,
)
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study

LIGHTS = range(1, 9)


def holds(field: str) -> Measured:
    return bounded(lambda record: record["lights"] in record[field])


def length(field: str) -> Measured:
    """How many counts a set has, on average."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        sizes = [len(record[field]) for record in records(scenes)]
        return (
            Figure(sum(sizes) / len(sizes), f"{sum(sizes) / len(sizes):.2f}")
            if sizes
            else NO_FIGURE
        )

    return measure


def longer(scenes: Sequence[Ended]) -> Figure:
    own, best = length("possible")(scenes).value, length("profile")(scenes).value
    return Figure(own / best, f"{own / best:.2f}") if own is not None and best else NO_FIGURE


def sure(record: Fields) -> bool:
    return converged(record) and len(record["possible"]) == 1


def doubt(record: Fields) -> str | None:
    if record["lights"] in record["possible"]:
        return None
    return f"{record['lights']} lights, allowed are {record['possible']}"


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    return (
        f"The true count is held: {whole.cell('Held').text}; {whole.cell('Longer').text} as long."
    )


STUDY = Study(
    name="counts",
    title="How many lights there may be",
    question="Do the counts of lights that an answer allows at 95 % hold the true one, with one to "
    "eight lights at 1 and 3 % noise? And are they no more than those of a profile likelihood that "
    "starts from the truth?",
    per_row=38,
    names=lambda per_row: numbered([f"lights-{k}" for k in LIGHTS], per_row),
    one=counts,
    measures=(
        Measure(
            "Held",
            "the true count is among those allowed",
            holds("possible"),
            {EVERY: at_least(0.95)},
        ),
        Measure("By the profile", "the same of fits that start at the truth", holds("profile")),
        Measure("Length", "how many counts are allowed, on average", length("possible")),
        Measure("of the profile", "the same of fits that start at the truth", length("profile")),
        Measure("Longer", "the one over the other", longer, {EVERY: at_most(1.1)}),
        Measure("Right count", "as many are found as there are", bounded(right)),
        Measure(
            "Right if sure",
            "of the answers that converged and allow one count, those with the right one",
            bounded(right, sure),
        ),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: f"{row.removeprefix('lights-')} lights",
    said=said,
    doubt=doubt,
    together=True,
)
