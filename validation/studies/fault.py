"""A trial in a room that is not as believed, beside one in the same room where it is."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import Localization, Observations, PointLights, localize
from validation.judge import compare, fitted
from validation.rooms import shot_noise
from validation.studies.fault_models import MODELS, Fault
from validation.studies.scenes import noise_of, parts
from validation.studies.trial import Trial, judged

SEED = 61_027
UNLIKELY = 5.0  # standard deviations of chi-square that noise alone does not leave
FIREFLY = 1e4  # times the mean B
FAR = 4.0  # of its stated standard errors: a light outside them is not where the answer says
NAMED = ("MATERIAL", "EMISSION", "GEOMETRY", "INDIRECT", "OUTSIDE", "ENCODING", "NOISE", "EXTENDED")


@dataclass(frozen=True)
class FaultTrial(Trial):
    """A trial in a room that is not as believed.

    Parameters
    ----------
    more
        How many lights the answer may have beside the true ones.
    told
        Whether the fault shows: no fit of the true number of lights, from the truth, leaves what
        noise alone leaves.
    named
        The first verdict of a kind of fault, or "nothing".
    outside
        True lights outside four of their stated standard errors along some axis, or not found.
    right_found, right_reason, right_seconds
        The same search's answer where the room is as believed, with the same noise.
    """

    more: int
    told: bool
    named: str
    outside: int
    right_found: int
    right_reason: str
    right_seconds: float


def fault(name: str) -> FaultTrial:
    """One scene of a fault: ``albedo-30-017``. Of two in turn one states its standard errors."""
    words, number = parts(name)
    model = "-".join(words)
    rng = np.random.default_rng([SEED, list(MODELS).index(model), number])
    scene = MODELS[model](number, rng)
    noise = rng.normal(size=scene.q.radiance.shape)
    stated = number % 2 == 0
    q = with_fireflies(noisy(scene.q, noise, stated), scene.wild)
    right, quick = timed(noisy(scene.right(), noise, stated), scene)
    answer, seconds = timed(q, scene)
    diagonal = float(np.linalg.norm(np.ptp(q.bounds if scene.region is None else scene.region, 0)))
    done = judged(name, answer, q, scene.lights, scene.geometry, seconds=seconds, diagonal=diagonal)
    kinds = [verdict.kind.name for verdict in answer.verdicts]
    return FaultTrial(
        **vars(done),
        more=scene.more,
        told=told(scene, noisy(scene.q, noise, True)),
        named=next((kind for kind in kinds if kind in NAMED), "nothing"),
        outside=outside(answer, scene.lights),
        right_found=len(right.lights),
        right_reason=right.reason.name,
        right_seconds=round(quick, 3),
    )


def timed(q: Observations, scene: Fault) -> tuple[Localization, float]:
    clock = time.perf_counter()
    answer = localize(q, scene.geometry, bounds=scene.region)
    return answer, time.perf_counter() - clock


def noisy(q: Observations, noise: NDArray[np.float64], stated: bool) -> Observations:
    """1 % of noise, whose standard error the data state or do not."""
    sigma = shot_noise(q.radiance, noise_of(q))
    seen = np.maximum(q.radiance + sigma * noise, 0.0)
    return q.with_radiance(seen, sigma if stated else None)


def with_fireflies(q: Observations, at: tuple[int, ...]) -> Observations:
    """The observations with values at some of them that are far too bright."""
    B = q.radiance.copy()
    B[list(at)] = FIREFLY * B.mean()
    return q.with_radiance(B, q.sigma)


def told(scene: Fault, q: Observations) -> bool:
    """Whether a fit from the truth leaves more than noise does, of what are measurements."""
    rest = q.at(np.setdiff1d(np.arange(len(q)), scene.wild))
    free = len(rest) - 4 * len(scene.lights)
    left = fitted(rest, scene.lights, scene.geometry, rest.known_sigma).chi2
    return left / free > 1 + UNLIKELY * math.sqrt(2 / free)


def outside(answer: Localization, truth: PointLights) -> int:
    """How many true lights are further off than `FAR` of their stated errors, or not found."""
    pairs = compare(answer.lights, truth, radius=math.inf).pairs
    z = [
        np.abs(answer.lights.positions[pair.found] - truth.positions[pair.true])
        / np.maximum(answer.position_error[pair.found], np.finfo(float).tiny)
        for pair in pairs
    ]
    return len(truth) - sum(bool((each <= FAR).all()) for each in z)
