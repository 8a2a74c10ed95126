"""A room rendered in one material and localized as if it were of another."""

from __future__ import annotations

import base64
import time
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

import render
from lightloc import Geometry, Localization, Observations, PointLights
from render import Room
from validation.studies.brdf_rooms import lit, room_of
from validation.studies.scenes import ONE_PERCENT, parts
from validation.studies.solver import found
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
    named
        The kind of the first verdict, in words; "nothing" where there is none.
    true_lights, found_lights
        A row each: x, y, z and intensity; those found with the standard error of each behind.
    said
        What the answer says that it can't tell.
    walls
        (n, 5) x, y, z, B and the residual, half floats in base 64; of a cell's first room alone.
    """

    rendered: str
    assumed: str
    transport: str
    brighter: float | None
    outside: bool
    named: str
    true_lights: list[list[float]]
    found_lights: list[list[float]]
    said: list[str]
    walls: str


def brdf(name: str) -> BRDFTrial:
    """One seed of a cell: ``ggx3-diffuse-direct-000``."""
    (rendered, assumed, transport), number = parts(name)
    true, told = room_of(rendered), room_of(assumed)
    rng = np.random.default_rng([SEED, number])
    room = lit(room_of("diffuse"), LIGHTS, rng)  # the same places in every material
    seen = observed(render.relight(true, room.lights), transport, number)
    believed = observed(render.relight(told, room.lights), "direct", number)
    if not np.array_equal(seen.positions, believed.positions):
        raise ValueError("the two rooms are observed at other points")
    q = replace(seen, material=believed.material)
    clock = time.perf_counter()
    answer = found(q, told.geometry, seed=number)
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
        named=answer.verdicts[0].kind.value if answer.verdicts else "nothing",
        true_lights=np.hstack([room.lights.positions, room.lights.intensities]).tolist(),
        found_lights=found_lights(answer),
        said=[verdict.sentence for verdict in answer.verdicts],
        walls=packed(q, answer) if number == 0 else "",
    )


def found_lights(answer: Localization) -> list[list[float]]:
    """Of each light x, y, z and intensity, then the standard errors of these."""
    lights = answer.lights
    errors = [answer.position_error, answer.intensity_error]
    return np.hstack([lights.positions, lights.intensities, *errors]).tolist()


def packed(q: Observations, answer: Localization) -> str:
    """(n, 5) x, y, z, B and the residual, half floats in base 64."""
    B, z = q.radiance.mean(axis=1), answer.residual.mean(axis=1)
    values = np.column_stack([q.positions, B, z]).astype(np.float16)
    return base64.b64encode(values.tobytes()).decode()


def observed(room: Room, transport: str, seed: int) -> Observations:
    """What is seen of it, with 1 % noise."""
    way: Literal["full", "direct"] = "full" if transport == "full" else "direct"
    return render.observe(room, points=POINTS, spp=SPP, seed=seed, transport=way, noise=ONE_PERCENT)


def brighter(answer: Localization, truth: PointLights) -> float | None:
    """By how much the lights are too bright together, percent."""
    if len(answer.lights) != len(truth):
        return None
    return float(100 * (answer.lights.intensities.sum() / truth.intensities.sum() - 1))
