"""Study: what a budget of time buys, in rooms of three dimensions."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import render
from lightloc import localize
from validation.jobs import Ended
from validation.records import Curve, Line, Row
from validation.rooms import ROOMS, lit
from validation.studies.many import solved
from validation.studies.measures import (
    Fields,
    at_least,
    bounded,
    duration,
    share,
    tally,
    typical,
)
from validation.studies.rooms3d import SOLVED
from validation.studies.scenes import ONE_PERCENT, numbered, parts
from validation.studies.study import EVERY, Measure, Study, pooled
from validation.studies.trial import Trial, judged

BUDGETS = (1, 3, 10)  # seconds
FREE = "free"  # the row without a budget
TRANSPORTS = {"direct": "direct light", "full": "all light"}
POINTS, SPP = 4000, 1024
KEPT = 1.1  # of the budget: at most so long


@dataclass(frozen=True)
class BudgetTrial(Trial):
    """A trial with its budget of time, seconds; None where there was none."""

    budget: float | None


def names(per_row: int) -> list[str]:
    """All scenes: ``direct-3-017`` has 3 s."""
    rows = [f"{transport}-{end}" for transport in TRANSPORTS for end in (*BUDGETS, FREE)]
    return numbered(rows, per_row)


def budget(name: str) -> BudgetTrial:
    """One room: its number says which, and how many lights it has."""
    (transport, end), number = parts(name)
    room = lit(list(ROOMS)[number % len(ROOMS)], number)
    way: Literal["direct", "full"] = "full" if transport == "full" else "direct"
    seen = render.observe(
        room, points=POINTS, spp=SPP, seed=number, transport=way, noise=ONE_PERCENT
    )
    if (number + number // len(ROOMS)) % 2:  # of each kind of room in turn
        seen = seen.with_radiance(seen.radiance, None)  # nobody knows the noise
    limit = None if end == FREE else float(end)
    clock = time.perf_counter()
    answer = localize(seen, room.geometry, seconds=limit, seed=number)
    spent = time.perf_counter() - clock
    record = judged(
        name,
        answer,
        seen,
        room.lights,
        room.geometry,
        seconds=spent,
        tolerance=SOLVED,
        diagonal=float(room.diagonal),
    )
    return BudgetTrial(**vars(record), budget=limit)


def is_kept(record: Fields) -> bool:
    return bool(record["seconds"] <= KEPT * record["budget"])


def has_budget(record: Fields) -> bool:
    return record["budget"] is not None


def ends(record: Fields) -> bool:
    """Whether it says that the time was up."""
    return bool(record["reason"] == "OUT_OF_TIME")


def label(row: str) -> str:
    """A row as a reader meets it.

    Examples
    --------
    >>> label("direct-3"), label("full-free")
    ('direct light, 3 s', 'all light, no budget')
    """
    transport, end = row.split("-")
    return f"{TRANSPORTS[transport]}, {'no budget' if end == FREE else f'{end} s'}"


def doubt(record: Fields) -> str | None:
    if has_budget(record) and not is_kept(record):
        return "later than its budget"
    sure = record["reason"] in ("CONVERGED", "EXTENDED")
    return "not solved, yet sure of it" if sure and not solved(record) else None


def curve(rows: Sequence[Row], scenes: Sequence[Ended]) -> Curve:
    """The share that is solved against the budget."""
    by = {row.name: row.cell("Solved").value for row in rows}

    def line(transport: str, said: str) -> Line:
        solved_by = [by.get(f"{transport}-{end}") for end in BUDGETS]
        return Line(said, [float(end) for end in BUDGETS], solved_by)

    whole = tuple(
        (value, f"no budget, {said}")
        for transport, said in TRANSPORTS.items()
        if (value := by.get(f"{transport}-{FREE}")) is not None
    )
    return Curve(
        "Rooms that are solved within a budget of time",
        "budget (s)",
        "share that is solved",
        tuple(line(transport, said) for transport, said in TRANSPORTS.items()),
        whole,
        log_x=True,
    )


STUDY = Study(
    name="budget",
    title="A budget of time",
    question="How many rooms of three dimensions are solved in 1, 3 and 10 s, with one to eight "
    "lights, 1 % noise, unknown in every second room, and 4 000 observations? A budget should be "
    "kept to 10 %, on an idle machine, and an answer that was cut short should say so.",
    per_row=20,
    names=names,
    one=budget,
    measures=(
        Measure(
            "Kept",
            "answers that came within 1.1 times the budget",
            bounded(is_kept, has_budget),
            {EVERY: at_least(1.0)},
        ),
        Measure("Solved", "count, positions and intensities are right", share(solved)),
        Measure("Cut short", "answers that say that the time was up", share(ends)),
        Measure("Lights (%)", "median of the worst position error", typical("position")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=label,
    said=pooled("Kept", "Solved"),
    doubt=doubt,
    together=True,
    curve=curve,
)
