"""Study: what each part and each constant of the search is worth, on the hard set's rooms."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

from validation.jobs import Ended
from validation.records import Row
from validation.studies.ablated import CHANGES, ablated, names, rooms
from validation.studies.measures import NO_FIGURE, Figure, duration, records, share
from validation.studies.paired import sign_test
from validation.studies.study import Measure, Study


def lost(r: dict[str, Any]) -> bool:
    return bool(r["as_is"] and not r["solved"])


def won(r: dict[str, Any]) -> bool:
    return bool(r["solved"] and not r["as_is"])


def count(kind: Any) -> Any:
    """How many scenes are of a kind."""

    def counted(ended: Sequence[Ended]) -> Figure:
        n = sum(kind(r) for r in records(ended))
        return Figure(n, str(n))

    return counted


def chance(ended: Sequence[Ended]) -> Figure:
    """The p of as uneven a split of what is lost and won."""
    some = list(records(ended))
    p = sign_test(sum(map(lost, some)), sum(map(won, some)))
    return Figure(p, f"{p:.2g}") if some else NO_FIGURE


def ratio(ended: Sequence[Ended]) -> Figure:
    """The seconds of all, over those of the search as it is."""
    some = list(records(ended))
    if not some:
        return NO_FIGURE
    value = sum(r["seconds"] for r in some) / sum(r["seconds_as_is"] for r in some)
    return Figure(value, f"{value:.2f}")


def each(ended: Sequence[Ended]) -> Figure:
    """The median of every room's own ratio."""
    some = [r["seconds"] / r["seconds_as_is"] for r in records(ended) if r["seconds_as_is"]]
    value = statistics.median(some) if some else None
    return NO_FIGURE if value is None else Figure(value, f"{value:.2f}")


def said(rows: Sequence[Row]) -> str:
    """What no change that loses nothing would save."""
    free = [row.label for row in rows if row.ended and row.cell("Lost").value == 0]
    return f"Nothing is lost by: {'; '.join(free)}." if free else "Every change loses a room."


STUDY = Study(
    name="ablation",
    title="What the search is made of",
    question="What is lost, or saved, where a part of the search is switched off or a constant "
    "halved or doubled? Each change is made beside the search as it is, room by room in one "
    "process, on the hard set without its longest rows.",
    per_row=len(rooms()),
    names=names,
    one=ablated,
    measures=(
        Measure("Solved", "rooms with the change", share(lambda r: r["solved"])),
        Measure("As it is", "rooms without it", share(lambda r: r["as_is"])),
        Measure("Lost", "rooms that only the search as it is solves", count(lost)),
        Measure("Won", "rooms that only the changed one solves", count(won)),
        Measure("p", "chance of a split of these at least as uneven", chance),
        Measure("Time", "seconds of all rooms, over those without the change", ratio),
        Measure("Time, median", "median of each room's own ratio", each),
        Measure("Median (s)", "of the changed search", duration()),
    ),
    label=lambda row: CHANGES[row].label,
    said=said,
    doubt=lambda r: "lost" if lost(r) else None,
)
