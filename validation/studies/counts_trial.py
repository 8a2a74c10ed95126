"""The counts of lights that an answer allows, beside those of a profile that knows the truth."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from lightloc import Localization, PointLights, cramer_rao, localize
from validation.judge import Further, fitted
from validation.studies.explained_rooms import ALPHA, Explained, Rng, empty, explained
from validation.studies.scenes import parts
from validation.studies.trial import Trial, judged

SEED = 83_011
NOISES = (0.01, 0.03)  # as `ONE_PERCENT` is
MORE = 2  # lights that the profile adds to the true ones
UNLIKELY = float(chi2.ppf(1 - ALPHA, 1))  # a difference in chi-square beyond which a count is out


@dataclass(frozen=True)
class CountsTrial(Trial):
    """A trial with the counts that are allowed.

    Parameters
    ----------
    possible
        The counts that the answer allows.
    profile
        Those that fits from the truth allow.
    """

    possible: list[int]
    profile: list[int]


def counts(name: str) -> CountsTrial:
    """One room: ``lights-4-017``. Dimensions, stated and unknown errors, and noises take turns."""
    (_, lights), number = parts(name)
    d, stated = 2 + number % 2, number // 2 % 2 == 0
    rng = np.random.default_rng([SEED, int(lights), number])
    noise = NOISES[number // 4 % len(NOISES)]
    room = explained(empty(d, int(lights), rng), d, rng, noise)
    q = room.told(stated)
    clock = time.perf_counter()
    answer = localize(q, room.geometry)
    seconds = time.perf_counter() - clock
    done = judged(
        name,
        answer,
        q,
        room.lights,
        room.geometry,
        seconds=seconds,
        diagonal=room.size if d == 3 else None,
    )
    return CountsTrial(**vars(done), possible=possible(answer), profile=profile(room, rng))


def possible(answer: Localization) -> list[int]:
    """The counts that an answer allows; those that are likely enough where it does not say."""
    said = getattr(answer, "possible", None)
    if said is not None:
        return [int(count) for count in said]
    least = math.exp(-UNLIKELY / 2)
    return [len(count.lights) for count in answer.counts if count.likely >= least]


def profile(room: Explained, rng: Rng) -> list[int]:
    """Counts whose best fit, each light being charged what noise lets one gain, is likely enough.

    Fits start at the truth: with fewer lights, the one that gains least is left out, again and
    again; with more, the place that gains most is added.
    """
    q, sigma, geometry = room.q, room.sigma, room.geometry
    fit = fitted(q, room.lights, geometry, sigma)
    left = {len(room.lights): fit.chi2}
    further = Further.of(q, fit.lights, geometry, sigma, room.places())
    price = further.gain(ALPHA, rng)
    more = fit
    for _ in range(MORE):
        more = fitted(q, _with(more.lights, further.best(more.residual)), geometry, sigma)
        left[len(more.lights)] = more.chi2
        further = Further.of(q, more.lights, geometry, sigma, room.places())
    while len(fit.lights) > 1:
        error = cramer_rao(q, fit.lights, geometry).intensity
        fit = fitted(
            q, _without(fit.lights, int((fit.lights.intensities / error).argmin())), geometry, sigma
        )
        left[len(fit.lights)] = fit.chi2
    charged = {count: cost + price * count for count, cost in left.items()}
    most = min(charged.values()) + UNLIKELY
    return sorted(count for count, cost in charged.items() if cost <= most)


def _with(lights: PointLights, one: PointLights) -> PointLights:
    return PointLights(
        np.concatenate([lights.positions, one.positions]),
        np.concatenate([lights.intensities, one.intensities]),
    )


def _without(lights: PointLights, i: int) -> PointLights:
    return PointLights(
        np.delete(lights.positions, i, axis=0), np.delete(lights.intensities, i, axis=0)
    )
