"""A room rendered in one material and localized as if it were of another."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

import render
from lightloc import Geometry, Localization, Observations, PointLights, localize
from render import Room
from validation.studies.brdf_rooms import MATERIALS, lit, room_of
from validation.studies.scenes import ONE_PERCENT, parts
from validation.studies.trial import Trial, judged

SEED = 60_601
POINTS, SPP, LIGHTS = 2048, 256, 2
SURE = 4.0  # standard errors within which a true light should be


@dataclass(frozen=True)
class BRDFTrial(Trial):
    """A trial with what was rendered and what was assumed.

    Parameters
    ----------
    rendered, assumed, transport
        The cell.
    brighter
        Mean over the lights of the intensity's error, percent; None where the count is wrong.
    outside
        Whether a true light is outside four stated standard errors, or not found.
    """

    rendered: str
    assumed: str
    transport: str
    brighter: float | None
    outside: bool


def brdf(name: str) -> BRDFTrial:
    """One seed of a cell: ``ggx3-diffuse-direct-000``."""
    (rendered, assumed, transport), number = parts(name)
    true, told = _room(rendered), _room(assumed)
    rng = np.random.default_rng([SEED, number])
    room = lit(_room("diffuse"), LIGHTS, rng)  # the same places in every material
    seen = observed(render.relight(true, room.lights), transport, number)
    believed = observed(render.relight(told, room.lights), "direct", number)
    if not np.array_equal(seen.positions, believed.positions):
        raise ValueError("the two rooms are observed at other points")
    q = replace(seen, material=believed.material)
    clock = time.perf_counter()
    answer = localize(q, told.geometry, seed=number)
    seconds = time.perf_counter() - clock
    own: Geometry = told.geometry
    done = judged(name, answer, q, room.lights, own, seconds=seconds, diagonal=float(room.diagonal))
    return BRDFTrial(
        **vars(done),
        rendered=rendered,
        assumed=assumed,
        transport=transport,
        brighter=brighter(answer, room.lights),
        outside=any(abs(z) > SURE for light in done.z for z in light) if done.z else True,
    )


@cache
def _room(material: str) -> Room:
    assert material in MATERIALS
    return room_of(material)


def observed(room: Room, transport: str, seed: int) -> Observations:
    """What is seen of it, with 1 % noise."""
    way: Literal["full", "direct"] = "full" if transport == "full" else "direct"
    return render.observe(room, points=POINTS, spp=SPP, seed=seed, transport=way, noise=ONE_PERCENT)


def brighter(answer: Localization, truth: PointLights) -> float | None:
    """By how much the lights are too bright together, percent."""
    if len(answer.lights) != len(truth):
        return None
    return float(100 * (answer.lights.intensities.sum() / truth.intensities.sum() - 1))
