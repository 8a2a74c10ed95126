"""lightloc compare: found lights beside the true ones."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from validation.commands.outputs import (
    FIND,
    JSON,
    QUIET,
    SET,
    UNIT,
    in_the_unit,
    parameters,
    tell,
)
from validation.jobs import read_json

if TYPE_CHECKING:
    from lightloc import PointLights
    from validation.judge import Comparison, Pair

SAME, DIFFERS = 0, 1


def compare_command(
    found: Annotated[Path, typer.Argument(help="Found lights, JSON.")],
    truth: Annotated[str, typer.Argument(help="True lights: JSON, or a scene.")],
    within: Annotated[float, typer.Option(help="Allowed error, percent of the diagonal.")] = 1.0,
    intensity: Annotated[
        float, typer.Option(help="Allowed error of the intensity, percent.")
    ] = 5.0,
    set_: SET = [],  # noqa: B006
    find: FIND = [],  # noqa: B006
    unit: UNIT = None,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Judge found lights by the true ones. Exits with 1 where they differ.

    Example: lightloc compare found.json box_occluder
    """
    from lightloc import PointLights
    from validation.judge import compare

    lights = in_the_unit(PointLights.load(found), unit, found)
    diagonal = None
    if truth.endswith(".json"):
        true = in_the_unit(PointLights.load(truth), unit, truth)
        diagonal = diagonal_in(truth)
    else:
        import render

        room = render.load(truth, find=find or "point", unit=unit, **parameters(set_))
        true, diagonal = room.lights, room.diagonal
    verdict = compare(lights, true, diagonal)
    missed = shortfalls(verdict, within, intensity)
    rows = read_json(found)["lights"]
    try:
        z = [in_errors(rows[one.found], lights, true, one) for one in verdict.pairs]
    except ValueError as error:
        raise ValueError(f"{found}: {error}") from None
    values = {
        **{"count_true": verdict.count_true, "count_found": verdict.count_found},
        "pairs": [
            {**asdict(one), "true": one.true + 1, "found": one.found + 1, "standard_errors": far}
            for one, far in zip(verdict.pairs, z, strict=True)
        ],
        "missed": [i + 1 for i in verdict.missed],
        "ghosts": [j + 1 for j in verdict.ghosts],
        **{"worst_position_percent": verdict.worst_position_percent},
        **{"worst_intensity_percent": verdict.worst_intensity_percent},
        **{"diagonal": verdict.diagonal, "unit": verdict.unit, "missed_limits": missed},
    }
    stated = [far for far in z if far is not None]
    said = [f"At most {max(stated):.2g} of the stated standard errors off."] if stated else []
    tell("\n".join([str(verdict), *said, *missed]), values, json, quiet)
    raise typer.Exit(DIFFERS if missed else SAME)


def in_errors(row: Any, found: PointLights, true: PointLights, pair: Pair) -> float | None:
    """The largest error of a found light, in what its row of a file states as standard errors.

    Of its position, along each axis, and of its intensity; None where the file states none. Raises
    ValueError where what it states is no such number.
    """
    import numpy as np

    from lightloc import units

    length = units.conversion(found.unit, true.unit) or np.nan
    here, power = found.in_unit(true.unit), 1.0 if found.intensity_unit else length**2
    z: list[float] = []
    for name, off, unit in (
        ("position_error", here.positions[pair.found] - true.positions[pair.true], length),
        ("intensity_error", here.intensities[pair.found] - true.intensities[pair.true], power),
    ):
        if row.get(name) is None:
            continue
        try:
            stated = np.broadcast_to(np.array(row[name], float), off.shape) * unit
        except (TypeError, ValueError):
            raise ValueError(
                f"{name} of light {pair.found + 1}: expected {off.size} number(s)"
            ) from None
        z += (np.abs(off)[stated > 0] / stated[stated > 0]).tolist()
    return max((one for one in z if np.isfinite(one)), default=None)


def shortfalls(verdict: Comparison, within: float, intensity: float) -> list[str]:
    """Which limit is missed, a sentence each: of positions, percent of which diagonal."""
    from lightloc import units

    said = []
    if not verdict.count_right:
        said.append(f"There are {verdict.count_true} lights; {verdict.count_found} were found.")
    if verdict.missed:
        named = ", ".join(str(i + 1) for i in verdict.missed)
        several = "s" * (len(verdict.missed) > 1)
        said.append(f"No found light is near true light{several} {named}.")
    worst = verdict.worst_position_percent
    if worst is not None and worst > within:
        said.append(
            f"The worst position is off by {worst:.3g} % of the diagonal of "
            f"{units.length(verdict.diagonal, verdict.unit, 4)}; allowed is {within:g} %."
        )
    worst = verdict.worst_intensity_percent
    if worst is not None and worst > intensity:
        said.append(f"The worst intensity is off by {worst:.3g} %; allowed is {intensity:g} %.")
    return said


def diagonal_in(file: str) -> float | None:
    """The room's diagonal, where `lightloc render` wrote the file of lights."""
    from lightloc.checks import number

    value = read_json(Path(file)).get("diagonal")
    if value is None:
        return None
    number(f"{file}: diagonal", value, above=True)
    return float(value)
