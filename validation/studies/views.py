"""Study: rooms that another renderer made and saw from one camera, with noise nobody tells."""

from __future__ import annotations

from collections.abc import Sequence

from validation.records import Row
from validation.studies.cycles import names, one
from validation.studies.many import converged
from validation.studies.measures import (
    Fields,
    at_least,
    bounded,
    duration,
    tally,
    typical,
)
from validation.studies.study import EVERY, Measure, Study

NEAR = {"direct": 0.3, "all": 3.0}  # cm: how far a light may be from its own, by kind of light
LIMIT = {"direct": 5.0, "all": 30.0}  # seconds of two idle cores, rendering included
KINDS = {"direct": "direct light", "all": "all light"}


def kind(record: Fields) -> str:
    return str(record["name"]).partition("-")[0]


def due(record: Fields) -> bool:
    """Whether the bound allows 1 cm."""
    return bool(record["due"])


def counted(record: Fields) -> bool:
    return bool(record["counted"])


def near(record: Fields) -> bool:
    return counted(record) and record["off"] <= NEAR[kind(record)]


def label(row: str) -> str:
    light, _, room = row.partition("-")
    return f"{room}, {KINDS[light]}"


def doubt(record: Fields) -> str | None:
    if not counted(record):
        return f"{record['found']} of {record['lights']} lights"
    said = [f"{record['off']:.2g} cm off"] * (not near(record))
    said += [record["reason"]] * (not converged(record))
    said += ["slow"] * (record["seconds"] > LIMIT[kind(record)])
    return ", ".join(said) or None


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    return f"Right count: {whole.cell('Right count').text}; near: {whole.cell('Near').text}."


STUDY = Study(
    name="views",
    title="Rooms that others made",
    question="Are two to four lights found in rooms that another renderer made and saw from one "
    "camera, with direct light and with all of it, where nothing says how large the noise is? "
    "The count should be right wherever the Cramér-Rao bound allows 1 cm, every light within 0.3 "
    "cm with direct light and 3 cm with all of it, the answer should say that it converged, and "
    "come in 5 s and in 30 s. The environment variable LIGHTLOC_ROOMS names the folders of rooms.",
    per_row=11,  # all subsets of four lights
    names=names,
    one=one,  # type: ignore[arg-type]  # a record of its own
    measures=(
        Measure(
            "Right count",
            "of the trials in which the bound allows 1 cm",
            bounded(counted, due),
            {EVERY: at_least(1.0)},
        ),
        Measure(
            "Near",
            "the same with every light within 0.3 cm, or 3 cm with all light",
            bounded(near, due),
            {EVERY: at_least(1.0)},
        ),
        Measure(
            "Converged where right",
            "of the answers with the right count",
            bounded(converged, counted),
            {EVERY: at_least(1.0)},
        ),
        Measure("Off (cm)", "median of the worst distance", typical("off")),
        Measure("Bound (cm)", "median of the largest bound", typical("bound")),
        Measure("Intensity (%)", "median of the worst error", typical("intensity")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Way", "how interreflected light was treated", tally("way")),
        Measure("Median (s)", "rendering included", duration()),
        Measure("Max (s)", "rendering included", duration(max)),
        Measure(
            "In time",
            "5 s with direct light, 30 s with all",
            bounded(lambda record: record["seconds"] <= LIMIT[kind(record)]),
            {EVERY: at_least(1.0)},
        ),
    ),
    label=label,
    said=said,
    doubt=doubt,
    together=True,
)
