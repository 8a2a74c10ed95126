"""A trial in a room of crossed factors whose noise nobody tells."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import Bound, Localization, PointLights, cramer_rao, localize
from validation.judge import RADIUS, compare, countable
from validation.studies.crossed_rooms import SEED, Clean, clean, drawn
from validation.studies.scenes import parts
from validation.studies.sensors import SENSORS, Reading
from validation.studies.trial import Trial, judged
from validation.studies.wild import KINDS

NOISE, PLACES = 1, 0  # streams of random numbers
GAIN = {2: 20.0, 3: 24.0}  # in chi-square that noise reaches once in a thousand searches (measured)
APART = 5.0  # standard errors: what is nearer than that is no outlier
SPREAD = 4.0  # errors at the bound that a light may be off and still be the one
CENTRAL = (0.05, 0.95)  # quantiles of what is lit between which its error is to be predicted


@dataclass(frozen=True)
class CrossedTrial(Trial):
    """A trial in a room of crossed factors; `ghosts` allow for errors at the bound.

    Parameters
    ----------
    dimensions, surface, occluders, share, kind
        Its factors, as drawn.
    allowed
        Probability that all lights stand out of the noise, for errors at the Cramér-Rao bound.
    sigma_off
        The largest relative error of the predicted standard error over the central 90 % of B; None
        where there is no noise to be predicted.
    wild, wild_found
        Share of the observations, of those that are measurements, that lie `APART` from the truth;
        what the answer says.
    """

    dimensions: int
    surface: str
    occluders: int
    share: float
    kind: str
    allowed: float
    sigma_off: float | None
    wild: float
    wild_found: float


def crossed(name: str) -> CrossedTrial:
    """One room: ``shot-017``."""
    (sensor,), number = parts(name)
    levels = drawn(list(SENSORS).index(sensor) + len(SENSORS) * number)
    own = [SEED, list(SENSORS).index(sensor), number]
    room = clean(levels, np.random.default_rng([*own, PLACES]))
    reading, far = read(room, sensor, levels["share"], levels["kind"], [*own, NOISE])
    q = room.q.with_radiance(reading.B, None)
    clock = time.perf_counter()
    answer = localize(q, room.geometry)
    seconds = time.perf_counter() - clock
    known = room.q.with_radiance(room.q.radiance, reading.sigma).at(reading.tells & ~far)
    bound = cramer_rao(known, room.lights, room.geometry)
    solid = levels["dimensions"] == 3
    done = judged(
        name,
        answer,
        q,
        room.lights,
        room.geometry,
        seconds=seconds,
        known=known,
        diagonal=room.size if solid else None,
    )
    return CrossedTrial(
        **{**vars(done), "ghosts": ghosts(answer.lights, room, bound, solid)},
        **{name: level for name, level in levels.items() if name != "lights"},
        allowed=countable(bound, room.lights, GAIN[levels["dimensions"]]),
        sigma_off=None if sensor == "exact" else sigma_off(answer, room, reading, far),
        wild=float(far[reading.tells].mean()),
        wild_found=answer.noise.share,
    )


def read(
    room: Clean, sensor: str, share: float, kind: str, seed: list[int]
) -> tuple[Reading, NDArray[np.bool_]]:
    """What is read of a room with outliers in it, and which of its points are some."""
    rng = np.random.default_rng(seed)
    B = room.q.radiance.copy()
    count = round(share * len(room.q))
    which, values = KINDS[kind](room.q, room.lights, room.geometry, count, rng)
    B[which] = values
    reading = SENSORS[sensor](B, rng)
    chosen = np.zeros(len(B), bool)
    chosen[which] = True
    off = np.abs(B - room.q.radiance) > APART * reading.sigma
    return reading, chosen & off[:, 0] & reading.tells


def ghosts(found: PointLights, room: Clean, bound: Bound, solid: bool) -> int:
    """Found lights near no true one, as near as errors at the bound let it be."""
    diagonal = room.size if solid else np.sqrt(2) * room.size
    off = np.linalg.norm(bound.position, axis=1).max()
    radius = max(RADIUS * diagonal, SPREAD * off) if np.isfinite(off) else np.inf
    return len(compare(found, room.lights, radius=radius).ghosts)


def sigma_off(answer: Localization, room: Clean, reading: Reading, far: NDArray[np.bool_]) -> float:
    """The largest relative error of the predicted standard error over the central B: of the law at
    the true B, since a light a millimetre off has other B along the edge of its shadow."""
    B, law = room.q.radiance[:, 0], answer.noise
    low, high = np.quantile(B[B > 0], CENTRAL)
    asked = reading.tells & ~far & (low <= B) & (high >= B)
    predicted = np.sqrt(law.read**2 + law.shot * B[asked] + np.square(law.relative * B[asked]))
    return float(np.nanmax(np.abs(predicted / reading.sigma[asked, 0] - 1)))
