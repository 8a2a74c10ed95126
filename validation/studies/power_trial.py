"""A faint light beside bright ones: does the search find it, and does the likelihood ratio?"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from lightloc import PointLights, cramer_rao, localize
from validation.judge import Further, fitted
from validation.rooms import under
from validation.studies.crossed_rooms import Clean
from validation.studies.explained_rooms import (
    ALPHA,
    OFF,
    Rng,
    empty,
    explained,
    free,
    options,
)
from validation.studies.scenes import noise_of, parts, with_error

SEED = 83_010
STRENGTHS = (
    1.0,
    1.5,
    2.0,
    2.5,
    3.0,
    4.0,
    6.0,
    12.0,
    30.0,
)  # times the least, whose error at the bound is itself
LIGHTS = (1, 2)  # beside it
APART = 0.15  # of the room's size: from them


@dataclass(frozen=True)
class PowerTrial:
    """One room with a faint light.

    Parameters
    ----------
    name
        The row and the scene's number.
    dimensions, stated
        2 or 3, and whether the data state their standard errors.
    lights, found
        How many there are, the faint one among them, and how many the answer has.
    gain, needed
        Of a fit from the truth over one without the faint light, in chi-square, and what noise
        alone gains in one search of twenty.
    reason
        Why the search stopped.
    seconds
        Of the search, on one thread.
    """

    name: str
    dimensions: int
    stated: bool
    lights: int
    found: int
    gain: float
    needed: float
    reason: str
    seconds: float


def power(name: str) -> PowerTrial:
    """One room: ``x1.5-017``. Two and three dimensions, stated and unknown errors take turns."""
    (word,), number = parts(name)
    strength = float(word.removeprefix("x"))
    d, stated = 2 + number % 2, number // 2 % 2 == 0
    rng = np.random.default_rng([SEED, number, STRENGTHS.index(strength)])
    room = with_faint(empty(d, LIGHTS[number // 4 % len(LIGHTS)], rng), strength, rng)
    seen = explained(room, d, rng)
    clock = time.perf_counter()
    answer = localize(seen.told(stated), seen.geometry, options=options())
    seconds = time.perf_counter() - clock
    bright = PointLights(room.lights.positions[:-1], room.lights.intensities[:-1])
    fewer = fitted(seen.q, bright, seen.geometry, seen.sigma)
    more = fitted(seen.q, room.lights, seen.geometry, seen.sigma)
    further = Further.of(seen.q, fewer.lights, seen.geometry, seen.sigma, seen.places())
    return PowerTrial(
        name=name,
        dimensions=d,
        stated=stated,
        lights=len(room.lights),
        found=len(answer.lights),
        gain=fewer.chi2 - more.chi2,
        needed=further.gain(ALPHA, rng),
        reason=answer.reason.name,
        seconds=round(seconds, 3),
    )


def with_faint(room: Clean, strength: float, rng: Rng) -> Clean:
    """The room with one light more, so many times as bright as its own error at the bound."""
    low, high = room.q.bounds
    while True:
        p = rng.uniform(low, high)
        near = np.linalg.norm(room.lights.positions - p, axis=1).min()
        if near > APART * room.size and free(room.geometry, p[None], OFF * (high - low).max())[0]:
            break
    places = np.append(room.lights.positions, p[None], axis=0)
    known = with_error(room.q, noise_of(room.q))
    one = PointLights(places, np.append(room.lights.intensities[:, 0], 1.0))
    least = cramer_rao(known, one, room.geometry).intensity[-1, 0]
    lights = PointLights(places, np.append(room.lights.intensities[:, 0], strength * least))
    return Clean(under(room.q, lights, room.geometry), lights, room.geometry, room.size)
