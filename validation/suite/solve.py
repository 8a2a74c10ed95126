"""What a case's search is told, what its method finds, and what a user's metric says of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

import render
from lightloc import Localization, Observations, localize
from lightloc.interreflection import Indirect
from render import Room
from validation.methods import Scene, SolverFailed, function, no_answer, solved
from validation.suite.cases import Case, settings

THIRD_SEED = 15_838
SAME = 1e-5
"""Of the diagonal: points of two scenes that are no farther apart are the same."""


def observe(case: Case, room: Room, seed: int) -> Observations:
    """The case's observations of a room."""
    return render.observe(
        room,
        points=case.points,
        spp=case.spp,
        seed=seed,
        transport=case.transport,
        noise=case.noise,
    )


def assumed(case: Case, seen: Observations, room: Room) -> tuple[Observations, Room]:
    """What the search is told: the observations and the room, in the materials that are assumed.

    Raises ValueError where the assumed scene has other shapes.
    """
    if case.assumed_file is None:
        return seen, room
    values: dict[str, Any] = dict(case.assumed_parameters)
    other = render.load(case.assumed_file, unit=case.unit, **values)
    there = render.observe(other, points=case.points, seed=case.seed, transport="direct")
    if there.positions.shape != seen.positions.shape or not np.allclose(
        there.positions, seen.positions, atol=SAME * room.diagonal
    ):
        raise ValueError(f"assumed scene '{case.assumed}' has other shapes than '{case.scene}'")
    return replace(seen, material=there.material), other


def measured(
    case: Case, found: Localization, room: Room, seen: Observations
) -> tuple[Mapping[str, float], list[str]]:
    """What the user's own metric says of an answer, and where it exceeds what is allowed."""
    if case.measure is None:
        return {}, []
    try:
        given = function(case.measure)(found, room, seen)
        named = given if isinstance(given, Mapping) else {case.measure.label: given}
        values = {str(name): float(value) for name, value in named.items()}
    except Exception as error:  # it is the user's
        return {}, [f"The metric failed: {type(error).__name__}: {' '.join(str(error).split())}."]
    most = math.inf if case.metric_most is None else case.metric_most
    return values, [
        f"The metric {name} is {value:.3g}; the row allows {most:g}."
        for name, value in values.items()
        if not value <= most
    ]


@dataclass(frozen=True)
class Given:
    """What a row's method gives.

    Parameters
    ----------
    found
        The lights; none where it failed.
    seconds
        Its own, where it ran in a process of its own and came to its end.
    why
        What went wrong, a sentence; empty where nothing did.
    """

    found: Localization
    seconds: float | None = None
    why: str = ""


def answer(case: Case, seen: Observations, room: Room, log: Callable[[bytes], object]) -> Given:
    """What the row's method finds; ``log`` is given what another than ours prints."""
    if case.solver.is_own:
        common: dict[str, Any] = dict(options=settings(case), bounds=case.bounds, seed=case.seed)
        if case.method == "paper":
            return published(seen, room, common)
        indirect: Indirect | Literal["gathered"] = "gathered"
        if case.rendered:
            spp, seed = case.rendered, case.seed + THIRD_SEED
            indirect = render.interreflected(room, seen, spp=spp, seed=seed)
        budget = case.seconds if "seconds" in case.model_fields_set else None
        return Given(localize(seen, room.geometry, indirect=indirect, seconds=budget, **common))
    scene = Scene(case.scene_file, case.find, case.unit, dict(case.parameters))
    if case.assumed_file is not None:
        scene = Scene(case.assumed_file, "point", case.unit, dict(case.assumed_parameters))
    try:
        found, seconds = solved(
            case.solver,
            seen,
            room,
            scene,
            bounds=case.bounds,
            seed=case.seed,
            seconds=case.seconds,
            memory_mb=case.memory_mb,
            log=log,
        )
    except SolverFailed as failed:
        return Given(no_answer(seen), why=str(failed))
    return Given(found, seconds)


def published(seen: Observations, room: Room, common: dict[str, Any]) -> Given:
    """What the published method finds; why not, where it can't look at what is seen."""
    try:
        return Given(localize(seen, room.geometry, method="paper", **common))
    except ValueError as error:
        return Given(no_answer(seen), why=f"The published method failed: {error}.")
