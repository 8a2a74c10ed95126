"""Study: against what a user would do instead, on the same scenes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import Observations, PointLights, shading
from render import Room
from validation.jobs import Ended
from validation.judge import compare, is_solved
from validation.records import Curve, Line, Row
from validation.studies.measures import Fields, duration, share, total, typical
from validation.studies.rival_solvers import RIVALS
from validation.studies.scenes import ONE_PERCENT, numbered, parts
from validation.studies.study import Measure, Study
from validation.studies.trial import SOLVED

ROOMS = ("box_one", "box_occluder", "box_conductor", "box_plastic", "furnished")
COUNTS = (1, 2, 3, 4, 5, 8)  # lights
POINTS = 4096  # observations of a room
INTENSITIES = (5.0, 25.0)  # W/sr, as those of the rooms' own lights
CLEARANCE = 0.05  # of the diagonal, between lights and to the next observed point
LIT = 0.2  # share of the observations that a light reaches: none is inside a piece of furniture
ATTEMPTS = 10_000  # at placing lights
SEED = 2018


@dataclass(frozen=True)
class Outcome:
    """What one rival made of one scene.

    Parameters
    ----------
    name
        As ``lights-3-adam-004``: how many lights, the rival, the scene's number.
    room
        The scene file's name.
    lights, found, missed, ghosts
        Counts, by the judge's own radius.
    position
        The worst distance of a matched light, percent of the diagonal.
    intensity
        The worst error of a matched light's intensity, percent.
    solved
        Whether the count is right, all lights within 1 % of the diagonal and 5 % of intensity.
    seconds
        Of the rival, with the compilation of its kernels.
    """

    name: str
    room: str
    lights: int
    found: int
    missed: int
    ghosts: int
    position: float | None
    intensity: float | None
    solved: bool
    seconds: float


def names(per_row: int) -> list[str]:
    """All scenes for all rivals, the rivals beside one another.

    Examples
    --------
    >>> names(1)[:2]
    ['lights-1-ours-000', 'lights-1-random-000']
    """
    return numbered([f"lights-{k}-{rival.name}" for k in COUNTS for rival in RIVALS], per_row)


def one(name: str) -> Outcome:
    """Let one rival solve one scene."""
    (_, lights, who), number = parts(name)
    rival = next(rival for rival in RIVALS if rival.name == who)
    room, q = scene(int(lights), number)
    clock = time.perf_counter()
    found = rival.solve(q, room, int(lights))
    seconds = time.perf_counter() - clock
    return judged(name, room, found, seconds)


def judged(name: str, room: Room, found: PointLights, seconds: float) -> Outcome:
    """What was found, beside the room's own lights."""
    verdict = compare(found, room.lights, room.diagonal)
    return Outcome(
        name=name,
        room=room.name,
        lights=len(room.lights),
        found=len(found),
        missed=len(verdict.missed),
        ghosts=len(verdict.ghosts),
        position=verdict.worst_position_percent,
        intensity=verdict.worst_intensity_percent,
        solved=is_solved(found, room.lights, SOLVED, room.diagonal),
        seconds=round(seconds, 3),
    )


def scene(lights: int, number: int) -> tuple[Room, Observations]:
    """A room with so many lights, rendered by Mitsuba: direct light, 1 % noise.

    Rooms take turns. The first round has a room's own lights where it has as many.
    """
    room = _room(ROOMS[number % len(ROOMS)])
    if number >= len(ROOMS) or len(room.lights) != lights:
        rng = np.random.default_rng([SEED, lights, number])
        room = render.relight(room, random_lights(room, lights, rng))
    return room, render.observe(
        room, points=POINTS, seed=number, transport="direct", noise=ONE_PERCENT
    )


@cache
def _room(name: str) -> Room:
    return render.load(name)


def random_lights(room: Room, count: int, rng: np.random.Generator) -> PointLights:
    """Lights in free space that are apart from each other and from the surfaces.

    Raises ValueError where there is no place for so many.
    """
    seen = render.observe(room, points=POINTS, seed=0, transport="direct")
    apart = CLEARANCE * room.diagonal
    places: NDArray[np.float64] = np.zeros((0, 3))
    for _ in range(ATTEMPTS):
        if len(places) == count:
            return PointLights(places, rng.uniform(*INTENSITIES, count))
        p = rng.uniform(*room.bounds)
        taken = np.concatenate([seen.positions, places])
        if np.linalg.norm(taken - p, axis=1).min() < apart:
            continue
        if (shading(seen, p[None], room.geometry) > 0).any(axis=2).mean() >= LIT:
            places = np.concatenate([places, p[None]])
    raise ValueError(f"{room.name}: no free place for {count} lights {apart:g} m apart")


def solved(record: Fields) -> bool:
    return bool(record["solved"])


def doubt(record: Fields) -> str | None:
    """Ours needs a look where it fails; that a rival does is what is measured."""
    return None if record["solved"] or "-ours-" not in record["name"] else "not solved"


def said(rows: Sequence[Row]) -> str:
    """How often each rival solved the scenes, over all counts."""
    rates = []
    for rival in RIVALS:
        mine = [row for row in rows if row.name.endswith(f"-{rival.name}") and row.ended]
        hits = sum((row.cell("Solved").value or 0.0) * row.ended for row in mine)
        rates.append(f"{rival.title} {hits:.0f} of {sum(row.ended for row in mine)}")
    return f"Solved: {', '.join(rates)}."


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
    """The share solved against the number of lights, a line for each rival."""
    lines = []
    for rival in RIVALS:
        cells = [row.cell("Solved") for row in rows if row.name.endswith(f"-{rival.name}")]
        rates, errors = [cell.value for cell in cells], [cell.error for cell in cells]
        lines.append(Line(rival.title, [float(k) for k in COUNTS], rates, errors))
    return Curve("Solved", "lights in the room", "share of the scenes", tuple(lines))


def label(row: str) -> str:
    """A row as a reader meets it.

    Examples
    --------
    >>> label("lights-1-grid"), label("lights-3-adam")
    ('1 light, NNLS on a grid', '3 lights, Mitsuba and Adam (count known)')
    """
    _, lights, who = row.split("-")
    rival = next(rival for rival in RIVALS if rival.name == who)
    told = " (count known)" * rival.counts
    return f"{lights} light{'s' * (lights != '1')}, {rival.title}{told}"


STUDY = Study(
    name="rivals",
    title="Against what a user would do instead",
    question="How often, how exactly and how fast are lights found in rendered rooms (diffuse, "
    "metal, plastic, with occluders; direct light, 1 % noise, 4096 observations) by lightloc, by "
    "Levenberg-Marquardt from 100 random starts, by non-negative least squares on a fixed grid, "
    "and by Adam on Mitsuba's differentiable rendering from 32 random starts? A scene is solved "
    "with the right count and every light within 1 % of the diagonal and 5 % of its intensity.",
    per_row=len(ROOMS),
    names=names,
    one=one,
    measures=(
        Measure(
            "Solved",
            "the count is right, every light within 1 % of the diagonal and 5 % of its intensity",
            share(solved),
        ),
        Measure(
            "Position (%)",
            "median of each scene's worst error of a light that was found, percent of the diagonal",
            typical("position"),
        ),
        Measure("Intensity (%)", "median of each scene's worst such error", typical("intensity")),
        Measure(
            "Missed", "true lights that no found one lies near, in all scenes", total("missed")
        ),
        Measure("Ghosts", "found lights that lie near no true one, in all scenes", total("ghosts")),
        Measure("Median (s)", "of the whole search", duration()),
        Measure("Max (s)", "of the whole search", duration(max)),
    ),
    label=label,
    said=said,
    doubt=doubt,
    curve=curve,
)
