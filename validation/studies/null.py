"""Study: how often a search claims a light that is not there, where nothing is left to explain."""

from __future__ import annotations

from validation.studies.coverage import right
from validation.studies.many import converged
from validation.studies.measures import Fields, at_most, bounded, duration, tally
from validation.studies.null_trial import ROWS, null
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study, pooled

LABELS = {
    "2d-stated": "2D, standard errors stated",
    "2d-unknown": "2D, unknown",
    "3d-stated": "3D, standard errors stated",
    "3d-unknown": "3D, unknown",
}
TIMES = {2: 10, 3: 2}  # scenes of a row, for each that is asked for
MOST = at_most(0.06)


def names(per_row: int) -> list[str]:
    """All rooms, row by row: 2 000 in two dimensions and 400 in three.

    Examples
    --------
    >>> len(names(100))
    2400
    """
    return [name for row in ROWS for name in numbered([row], TIMES[int(row[0])] * per_row)]


def too_many(record: Fields) -> bool:
    return bool(record["found"] > record["lights"])


def doubt(record: Fields) -> str | None:
    return None if right(record) else f"{record['found']} lights, of {record['lights']}"


STUDY = Study(
    name="null",
    title="Lights that are not there",
    question="How often does a full search claim a light too many, where one to three lights "
    "explain all data but 1 % of noise? It is asked for a false alarm in at most 5 % of the "
    "searches, and should keep to 6 %.",
    per_row=100,
    names=names,
    one=null,
    measures=(
        Measure(
            "Too many",
            "more lights are found than there are",
            bounded(too_many),
            dict.fromkeys((*ROWS, EVERY), MOST),
        ),
        Measure("Right count", "as many as there are", bounded(right)),
        Measure("Converged", "the answer says that it explains everything", bounded(converged)),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: LABELS[row],
    said=pooled("Too many"),
    doubt=doubt,
    together=True,
)
