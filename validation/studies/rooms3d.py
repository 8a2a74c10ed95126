"""Study: one to eight lights in furnished and glossy rooms, in direct and in all light."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import Localization, Observations, localize
from lightloc.interreflection import Indirect
from validation.judge import Tolerance, compare, is_solved
from validation.records import Row
from validation.rooms import MOST, ROOMS, lit
from validation.studies.many import converged, solved
from validation.studies.measures import Fields, at_least, below, duration, share, tally, typical
from validation.studies.occluders import ceiling
from validation.studies.rooms import most
from validation.studies.scenes import numbered
from validation.studies.study import Measure, Study

TRANSPORTS = ("direct", "full")
POINTS = 4000  # |Q| of the issue
SPP = 4096  # at 1024 the faintest of eight lights among metal is known to 8 % only (measured)
RENDERED = 512  # samples per light: eight times as many as it, all lights together
SOLVED = Tolerance(0.01, 5.0)  # of the diagonal and in percent, as in the suite


@dataclass(frozen=True)
class RoomTrial:
    """One room: a line of the study's data. Fields as in `Trial`.

    ``seconds`` are of all searches without the rendering, ``rendering`` of that; ``ceiling`` is
    the probability of being solved at the bound. For ``full``, the ``footnote_...`` fields are of
    footnote 1 alone on the same observations.
    """

    name: str
    lights: int
    found: int
    missed: int
    ghosts: int
    position: float | None
    intensity: float | None
    solved: bool
    reason: str
    verdicts: list[str]
    certificate: float
    chi2: float
    seconds: float
    rendering: float
    turns: int
    ceiling: float
    footnote_solved: bool | None
    footnote_position: float | None
    footnote_intensity: float | None


def names(per_row: int) -> list[str]:
    return numbered([f"{transport}-{room}" for transport in TRANSPORTS for room in ROOMS], per_row)


def one(name: str) -> RoomTrial:
    """One room: ``full-metal_a1-007``, which has eight lights."""
    transport, kind, number = name.split("-")
    room = lit(kind, int(number))
    seen = render.observe(room, points=POINTS, spp=SPP, seed=int(number), transport=transport)  # type: ignore[arg-type]
    clock = time.perf_counter()
    if transport == "direct":
        return _record(name, room, localize(seen, room.geometry), time.perf_counter() - clock)
    spent: list[float] = []
    indirect = render.interreflected(room, seen, spp=RENDERED, seed=int(number))
    answer = rendered(seen, room, indirect, int(number), spent)
    seconds = time.perf_counter() - clock - sum(spent)
    plain = localize(seen, room.geometry, indirect="gathered")
    at_best = most(seen, room, indirect, SOLVED)
    return _record(name, room, answer, seconds, spent, plain, at_best)


def rendered(
    seen: Observations, room: render.Room, indirect: Indirect, seed: int, spent: list[float]
) -> Localization:
    """Rounds of search and rendering; ``spent`` gets the seconds of each rendering."""

    def timed(positions: NDArray) -> tuple[NDArray, NDArray]:
        clock = time.perf_counter()
        columns = indirect(positions)
        spent.append(time.perf_counter() - clock)
        return columns

    return localize(seen, room.geometry, indirect=timed, seed=seed)


def _record(
    name: str,
    room: render.Room,
    answer: Localization,
    seconds: float,
    spent: Sequence[float] = (),
    plain: Localization | None = None,
    at_best: float = 1.0,
) -> RoomTrial:
    judged = compare(answer.lights, room.lights, room.diagonal)
    first = footnote = None
    if plain:
        first = compare(plain.lights, room.lights, room.diagonal)
        footnote = is_solved(plain.lights, room.lights, SOLVED, room.diagonal)
    return RoomTrial(
        name=name,
        lights=len(room.lights),
        found=len(answer.lights),
        missed=len(judged.missed),
        ghosts=len(judged.ghosts),
        position=judged.worst_position_percent,
        intensity=judged.worst_intensity_percent,
        solved=is_solved(answer.lights, room.lights, SOLVED, room.diagonal),
        reason=answer.reason.name,
        verdicts=sorted({verdict.kind.name for verdict in answer.verdicts}),
        certificate=float(answer.certificate),
        chi2=float(answer.chi2),
        seconds=round(seconds, 3),
        rendering=round(sum(spent), 3),
        turns=len(spent),
        ceiling=at_best,
        footnote_solved=footnote,
        footnote_position=first.worst_position_percent if first else None,
        footnote_intensity=first.worst_intensity_percent if first else None,
    )


def label(row: str) -> str:
    transport, kind = row.split("-")
    name, parameters = ROOMS[kind]
    roughness = f", α {parameters['alpha']:g}" if parameters else ""
    light = "all light" if transport == "full" else "direct light"
    return f"{name.removeprefix('box_')}{roughness}, {light}"


def doubt(record: Fields) -> str | None:
    if solved(record):
        return None
    return "not solved, yet sure of it" if converged(record) else "not solved, and says so"


def said(rows: Sequence[Row]) -> str:
    shares = []
    for transport, word in zip(TRANSPORTS, ("direct light", "all light"), strict=True):
        cells = [row.cell("Solved") for row in rows if row.name.startswith(transport)]
        known = [cell.value for cell in cells if cell.value is not None]
        if known:
            shares.append(f"{np.mean(known):.2f} with {word}")
    return f"Solved: {', '.join(shares)}." if shares else ""


GOALS = {
    f"{transport}-{room}": at_least(1.0 if transport == "direct" else 0.95)
    for transport in TRANSPORTS
    for room in ROOMS
}
STUDY = Study(
    name="rooms3d",
    title="Rooms in three dimensions",
    question="One to eight lights in diffuse, plastic, mixed and all-metal rooms, with furniture "
    "in two of them, 4 000 observations. All should be solved with direct light, and 95 % with "
    "full interreflection, whose indirect part is rendered for the lights found so far; footnote "
    "1 alone stands beside it. A room is solved with the right count and every light within 1 % "
    "of the diagonal and 5 % of its intensity.",
    per_row=MOST,
    names=names,
    one=one,  # type: ignore[arg-type]  # a record of its own
    measures=(
        Measure("Solved", "count, positions and intensities are right", share(solved), GOALS),
        Measure("Ceiling", "mean probability of that for errors at the Cramér-Rao bound", ceiling),
        Measure(
            "Footnote 1",
            "the same where indirect light is only removed with the observations themselves",
            share(lambda r: bool(r["footnote_solved"]), lambda r: r["footnote_solved"] is not None),
        ),
        Measure("Position (%)", "median of the worst, of the diagonal", typical("position")),
        Measure("by footnote 1", "the same", typical("footnote_position")),
        Measure("Intensity (%)", "median of the worst", typical("intensity")),
        Measure("of footnote 1", "the same", typical("footnote_intensity")),
        Measure("Rounds", "median of the renderings", typical("turns")),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of all searches on one thread", duration()),
        Measure("Max (s)", "of all searches on one thread", duration(max), below(10.0)),
        Measure("Rendering (s)", "median, of all columns", typical("rendering")),
    ),
    label=label,
    said=said,
    doubt=doubt,
)
