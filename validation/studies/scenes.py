"""The scenes of the studies whose model is right: a name in, a trial out."""

from __future__ import annotations

from functools import cache

import numpy as np

from lightloc import Observations
from validation.judge import Tolerance
from validation.rooms import SAMPLES, PlaneRoom, rooms, rooms_with_discs, shot_noise
from validation.studies.trial import SOLVED, Trial, trial

MANY = (8, 10, 15, 20)  # lights in one room
DISCS, AMONG_DISCS = (2, 4, 8), (2, 3, 4, 5)  # occluders, and lights among them
FEW = (2, 3)  # lights, where the question is how sure the answer is
NOISES = (0.02, 0.05, 0.1, 0.2)  # k of section 6.1
COUNTS = (50, 100, 200, 400, 1000, 3000, 10_000)  # observations of a room
COVERED = ("square", "discs2", "discs4")  # rooms whose intervals are tested
COVERED_NOISES = (0.02, 0.03, 0.04, 0.05)  # k of section 6.1, one after another
ONE_PERCENT = 0.01  # of sqrt(B mean B): the standard error where noise is stated in percent
AMONG = Tolerance(0.02, 10.0)  # what counts as solved among occluders


def numbered(rows: list[str], per_row: int) -> list[str]:
    """The names of all scenes, row by row.

    Examples
    --------
    >>> numbered(["lights-8", "lights-10"], 1)
    ['lights-8-000', 'lights-10-000']
    """
    return [f"{row}-{number:03}" for row in rows for number in range(per_row)]


def parts(name: str) -> tuple[list[str], int]:
    """The words of a scene's row, and the scene's number.

    Examples
    --------
    >>> parts("discs-2-lights-3-017")
    (['discs', '2', 'lights', '3'], 17)
    """
    *words, number = name.split("-")
    return words, int(number)


@cache
def room_list(discs: int, lights: int) -> list[PlaneRoom]:
    """Square rooms with so many discs and lights: those of Table 1 where there is no disc."""
    return rooms_with_discs(discs, lights) if discs else rooms(lights)


def noise_of(q: Observations, share: float = ONE_PERCENT) -> float:
    """The k of section 6.1 whose standard error is this share of sqrt(B mean B)."""
    return share * float(np.sqrt(q.radiance.mean()))


def with_error(q: Observations, k: float) -> Observations:
    """Observations without noise that carry its standard error."""
    return q.with_radiance(q.radiance, shot_noise(q.radiance, k))


def many(name: str) -> Trial:
    """Many lights in an empty square room, without noise: ``lights-8-017``."""
    (_, lights), number = parts(name)
    room = room_list(0, int(lights))[number]
    return trial(name, room.observe(), room.lights)


def occluders(name: str) -> Trial:
    """Discs that cast shadows, 1 % noise: ``discs-2-lights-3-017``."""
    (_, discs, _, lights), number = parts(name)
    room = room_list(int(discs), int(lights))[number]
    k = noise_of(room.observe())
    return _noisy(name, room, k, tolerance=AMONG)


def noisy(name: str) -> Trial:
    """Table 1's scene of that name, with its noise: ``noisy-4-017``."""
    (_, lights), number = parts(name)
    return _noisy(name, room_list(0, int(lights))[number], NOISES[1], seed=number)


def coverage(name: str) -> Trial:
    """Two or three lights, noise that differs from scene to scene: ``discs2-3-017``."""
    (make, lights), number = parts(name)
    discs = int(make.removeprefix("discs")) if make != "square" else 0
    room = room_list(discs, int(lights))[number]
    return _noisy(name, room, COVERED_NOISES[number % len(COVERED_NOISES)])


def noise(name: str) -> Trial:
    """Two and three lights in turn, more and more noise: ``k0.05-017``."""
    (word,), number = parts(name)
    k = float(word.removeprefix("k"))
    return _noisy(name, _few(number), k, seed=NOISES.index(k))  # else the same noise, scaled


def points(name: str) -> Trial:
    """Two and three lights in turn, more and more observations: ``n400-017``."""
    (n,), number = parts(name)
    return _noisy(name, _few(number), NOISES[1], int(n.removeprefix("n")))


def _few(number: int) -> PlaneRoom:
    return room_list(0, FEW[number % len(FEW)])[number]


def _noisy(
    name: str,
    room: PlaneRoom,
    k: float,
    n: int = SAMPLES,
    tolerance: Tolerance = SOLVED,
    seed: int = 0,
) -> Trial:
    q, known = room.observe(n, noise=k, seed=seed), with_error(room.observe(n), k)
    return trial(name, q, room.lights, room.geometry, known=known, tolerance=tolerance)
