"""The columns of Table 1: one scene, solved in every way that the table compares."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from lightloc import Observations, Paper, Perimeter, PointLights, Reason, localize, radiance
from lightloc.fit import NEARBY, Descents, Problem, Unknown, descend
from validation.judge import Tolerance, compare, is_solved
from validation.rooms import PlaneRoom, rooms

SEED = 2018
SAMPLES, NOISE = 400, 0.05  # section 6.1
LOW_ERROR, OF_THE_TRUTH = 0.0025, 1.05  # of MSE, without noise and with it (section 6.1)
SOLVED = Tolerance(0.01, 5.0)  # of the side; percent
EXACTLY = Tolerance(0.001, 5.0)  # our search without noise
NEAR = 0.1  # of the side: what counts as a match
RANDOM_STARTS = 100  # "with random initialization 100 times on each of the scenes" (6.1)
FAINTEST, BRIGHTEST = 1.0, 5.0  # of the random starts, as of the lights themselves
STEPS = 100  # of Levenberg-Marquardt, everywhere
COUNTS = (2, 3, 4, 5)
PER_ROW = 100  # scenes (section 6.1)


@dataclass(frozen=True)
class Record:
    """One scene: a row of the data behind Table 1.

    Parameters
    ----------
    name
        As ``noisy-3-017``: the row and the room's number.
    lights
        How many there are.
    noise
        k.
    random
        Share of the random starts of Levenberg-Marquardt, the count known, that reach a low error.
    votes
        Whether the first round of voting led to a low error.
    full
        Whether the whole algorithm did.
    solved
        Whether its lights are the true ones.
    oracle
        Whether Levenberg-Marquardt started at the truth ends at lights that count as solved; no
        method can do much better under noise.
    seconds
        Of the whole algorithm, on one thread.
    count_found
        Its lights.
    mse
        Of its answer against the B that it was given.
    mse_truth
        Of the true lights.
    reason
        Why it stopped.
    ours_full, ours_solved, ours_seconds, ours_found, ours_reason
        The same of our search, which is not told what a low error is; without noise, solved is
        within `EXACTLY`.
    ours_position
        Its light that is furthest off, in parts of the side; None where the count is wrong or one
        lies outside `NEAR`.
    ours_certificate
        Its certificate.
    """

    name: str
    lights: int
    noise: float
    random: float
    votes: bool
    full: bool
    solved: bool
    oracle: bool
    seconds: float
    count_found: int
    mse: float
    mse_truth: float
    reason: str
    ours_full: bool
    ours_solved: bool
    ours_seconds: float
    ours_found: int
    ours_reason: str
    ours_position: float | None
    ours_certificate: float


def names(per_row: int = PER_ROW) -> list[str]:
    """All scenes, row by row.

    Examples
    --------
    >>> names(1)[:2], len(names())
    (['noiseless-2-000', 'noiseless-3-000'], 800)
    """
    kinds = ("noiseless", "noisy")
    return [f"{kind}-{k}-{i:03}" for kind in kinds for k in COUNTS for i in range(per_row)]


@cache
def data_set(lights: int) -> list[PlaneRoom]:
    return rooms(lights, seed=SEED)


def observed(name: str) -> tuple[PlaneRoom, Observations]:
    """The room of that name and what is seen of it."""
    kind, lights, number = name.split("-")
    room = data_set(int(lights))[int(number)]
    return room, room.observe(SAMPLES, noise=NOISE if kind == "noisy" else 0.0, seed=int(number))


def scene(name: str) -> Record:
    """Run one scene through all columns."""
    room, q = observed(name)
    noise = NOISE if name.startswith("noisy") else 0.0
    low = LOW_ERROR if not noise else OF_THE_TRUTH * error(q, room.lights)
    edge = Perimeter(*room.outline.along(q.positions))
    random = random_starts(q, len(room.lights), low, int(name.rpartition("-")[2]))
    oracle = from_the_truth(q, room.lights)
    clock = time.perf_counter()
    found = localize(q, method="paper", options=Paper(low_error=low), surface=edge)
    seconds = time.perf_counter() - clock
    full = found.reason is Reason.CONVERGED
    clock = time.perf_counter()
    ours = localize(q)
    ours_seconds = time.perf_counter() - clock
    return Record(
        name=name,
        lights=len(room.lights),
        noise=noise,
        random=random,
        votes=full and found.history[-1].turn == 0,
        full=full,
        solved=full and is_solved(found.lights, room.lights, SOLVED),
        oracle=is_solved(oracle, room.lights, SOLVED),
        seconds=round(seconds, 3),
        count_found=len(found.lights),
        mse=error(q, found.lights),
        mse_truth=error(q, room.lights),
        reason=found.reason.name,
        ours_full=error(q, ours.lights) < low,
        ours_solved=is_solved(ours.lights, room.lights, SOLVED if noise else EXACTLY),
        ours_seconds=round(ours_seconds, 3),
        ours_found=len(ours.lights),
        ours_reason=ours.reason.name,
        ours_position=furthest(ours.lights, room.lights),
        ours_certificate=round(ours.certificate, 3),
    )


def error(q: Observations, lights: PointLights) -> float:
    """Mean squared error of B, the measure of section 6.1."""
    return float(np.square(q.radiance - radiance(q, lights)).mean())


def furthest(found: PointLights, true: PointLights) -> float | None:
    """How far off the worst light is, in parts of the side; None where the lights do not match."""
    verdict = compare(found, true, diagonal=1.0, radius=NEAR)
    if verdict.missed or verdict.ghosts:
        return None
    return max(pair.distance for pair in verdict.pairs)


def problem(q: Observations) -> Problem:
    """The least squares that every column minimizes: weighted where the noise is known."""
    sigma = q.known_sigma if (q.known_sigma > 0).all() else np.ones_like(q.known_sigma)
    return Problem.of(q, sigma, None, q.bounds)


def random_starts(q: Observations, count: int, low: float, seed: int) -> float:
    """The share of random starts, the count known, that reach a low error.

    The solver is the published method's. Starts are drawn anywhere in the room, though lights keep
    their clearance: with it, five lights would be found twice as often as the paper has it.
    """
    rng = np.random.default_rng([SEED, count, seed])
    low_corner, high_corner = q.bounds
    p = rng.uniform(low_corner, high_corner, (RANDOM_STARTS, count, 3))
    I = rng.uniform(FAINTEST, BRIGHTEST, (RANDOM_STARTS, count, 1))
    free = Unknown.FREE
    there = descend(problem(q), Descents.of(p, I), steps=STEPS, unknown=free, damping=Paper.damping)
    plain = replace(problem(q), sigma=np.ones_like(q.sigma))
    unweighted = descend(plain, there, steps=0, unknown=free)
    return float((unweighted.chi2 / q.radiance.size < low).mean())


def from_the_truth(q: Observations, lights: PointLights) -> PointLights:
    """Where Levenberg-Marquardt comes to rest that starts at the true lights."""
    there = descend(
        problem(q),
        Descents.of(lights.positions[None], lights.intensities[None]),
        steps=STEPS,
        unknown=Unknown.POSITIVE,
        damping=NEARBY,
    )
    return PointLights(there.positions[0], there.intensities[0])
