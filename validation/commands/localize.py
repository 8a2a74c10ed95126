"""`lightloc localize`: from observations to lights, with their errors and what can't be told."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from validation.commands.asked import Noise, Transport, asked, box, paths, point
from validation.commands.observed import Given
from validation.commands.outputs import (
    FIND,
    JSON,
    QUIET,
    SEED,
    SET,
    UNIT,
    in_the_unit,
    parameters,
    tell,
    writable,
)
from validation.jobs import read_json, ready, write_json

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lightloc import Localization, Step
    from validation.methods import Method


SURE, UNSURE = 0, 3
BELIEVED = ("CONVERGED", "EXTENDED")


def localize_command(
    observations: Annotated[
        list[Path],
        typer.Argument(
            help="What `lightloc render` wrote, readings (CSV), or a picture (EXR), whose layers "
            "may be several files."
        ),
    ],
    scene: Annotated[
        str | None, typer.Option(help="The scene, for its geometry; nothing occludes without it.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Found lights, JSON.")] = Path(
        "lights.json"
    ),
    method: Annotated[
        str,
        typer.Option(
            help="search is ours, paper as published; or a function of yours, as module:function "
            "or file.py:function."
        ),
    ] = "search",
    indirect: Annotated[
        str | None,
        typer.Option(
            metavar="PATHS|gathered",
            help="How indirect light is removed: rendered for what is found, with so many paths "
            "per observation and light (needs --scene), or gathered from the observations, which "
            "requires a largely diffuse room, seen almost everywhere. By default whichever the "
            "observations allow.",
        ),
    ] = None,
    bounds: Annotated[
        str | None,
        typer.Option(
            help="Region that may hold lights, its lower and upper corner: X0,Y0,Z0,X1,Y1,Z1. "
            "By default what is observed, and beyond it where it is open."
        ),
    ] = None,
    ambient: Annotated[bool, typer.Option(help="Fit a constant ambient term too.")] = False,
    free: Annotated[
        str | None,
        typer.Option(
            metavar="WHAT",
            help="What is fitted together with the lights, and told with its errors: albedo, "
            "ambient, gamma, or several of them, with commas between.",
        ),
    ] = None,
    noise: Annotated[
        Noise,
        typer.Option(
            help="Take sigma as given; as right but for a factor; or not at all, and estimate how "
            "large noise is at which B."
        ),
    ] = Noise.given,
    false_alarm: Annotated[
        float | None,
        typer.Option(
            help="Probability, in the whole search, that a light is claimed which is not there. "
            "By default 0.001."
        ),
    ] = None,
    most_lights: Annotated[
        int | None, typer.Option(min=1, help="Largest number of lights. By default 24.")
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(help="Lights to begin with, JSON as this command or `lightloc render` wrote."),
    ] = None,
    fixed: Annotated[
        Path | None,
        typer.Option(help="Lights whose positions are known, JSON: only intensities are found."),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(help="Budget of time: the best lights by then are the answer."),
    ] = None,
    floor: Annotated[
        float | None,
        typer.Option(
            help="Of readings or observations: what is not above it is left out; 0 where values of "
            "0 are what they say."
        ),
    ] = None,
    saturated: Annotated[
        float | None,
        typer.Option(
            help="Of readings or observations: what is at least that was clipped, and is left out."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(help="Of readings or observations: the spacing of the values, an error too."),
    ] = None,
    sensor: Annotated[
        int | None, typer.Option(min=0, help="Of a picture: which of the scene's cameras took it.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(help="Of a picture without --scene: where it was taken from, X,Y,Z."),
    ] = None,
    transport: Annotated[
        Transport | None,
        typer.Option(
            help="Of a picture or readings: whether they hold interreflected light. By default "
            "pictures do, and readings do where there is a --scene."
        ),
    ] = None,
    max_depth: Annotated[
        int | None,
        typer.Option(
            help="Of a picture: length of its longest paths, as Mitsuba counts; 2 is direct light, "
            "-1 no end. By default as the scene's integrator has it, or -1."
        ),
    ] = None,
    albedo: Annotated[
        float | None, typer.Option(help="Of readings of luminance or radiance: the surface's.")
    ] = None,
    set_: SET = [],  # noqa: B006
    find: FIND = [],  # noqa: B006
    unit: UNIT = None,
    seed: SEED = 0,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Find the lights that explain the observations. Exits with 3 where the answer is not sure.

    Example: lightloc localize seen.npz --scene box_occluder -o found.json
    """
    writable(out)
    given = Given(
        observations,
        sensor,
        None if camera is None else point(camera),
        None if transport is None else transport.value,
        max_depth,
        albedo,
        unit,
        floor,
        saturated,
        step,
    )
    way = paths(indirect)
    if isinstance(way, int) and not scene:
        raise ValueError("--indirect: needs --scene, the room that is rendered")
    solver = named(method)
    given_more = isinstance(way, int) or ambient or noise is not Noise.given
    if method != "search" and given_more:
        raise ValueError(
            f"--method {method}: has no --indirect PATHS, --ambient, --noise scaled or --noise "
            "estimate"
        )
    for option, value in (
        ("--free", free),
        ("--false-alarm", false_alarm),
        ("--most-lights", most_lights),
        ("--start", start),
        ("--fixed", fixed),
    ):
        if method != "search" and value is not None:
            raise ValueError(f"--method {method}: has no {option}")
    if method == "paper" and seconds is not None:
        raise ValueError("--method paper: has no --seconds")
    if seconds is not None and not 0 < seconds < math.inf:
        raise ValueError(f"--seconds {seconds:g}: expected a number above 0")
    options = asked(method, ambient, noise, free, false_alarm, most_lights)
    region = box(bounds)
    from validation.commands.progress import Bar

    with Bar("searching", seconds, quiet) as bar:
        import render
        from lightloc import Assumption, PointLights, localize

        hidden = find or "point"
        room = render.load(scene, find=hidden, unit=unit, **parameters(set_)) if scene else None
        seen, said = given.read(room)
        if solver:
            from validation.methods import SECONDS, Scene, SolverFailed, solved

            where = Scene(scene, hidden, unit, parameters(set_)) if scene else None
            bar.say(method)
            try:
                log = None if quiet else sys.stderr.buffer.write
                found, _ = solved(
                    solver,
                    seen,
                    room,
                    where,
                    bounds=region,
                    seed=seed,
                    seconds=seconds or SECONDS,
                    log=log,
                )
            except SolverFailed as failed:
                raise ValueError(str(failed)) from None
        else:
            clock = time.monotonic()

            def watch(step: Step) -> None:
                bar.say(f"{step.action}: {step.lights} lights, chi-square {step.chi2:.3g}")
                bar.to(time.monotonic() - clock)

            found = localize(
                seen,
                room.geometry if room else None,
                method="paper" if method == "paper" else "search",
                bounds=region,
                options=options,
                indirect=way,
                start=None if start is None else in_the_unit(PointLights.load(start), unit, start),
                fixed=None if fixed is None else plan(fixed, seen.unit),
                seconds=seconds,
                seed=seed,
                watch=watch,
            )
        write_json(ready(out), found.to_dict())
    lines = [f"{observations[0]}: {said}"] if said else []
    if room:
        lines += room.notes
        if Assumption.KNOWN_LIGHT in found.assumed:
            count = len(room.known.emitters())
            lines.append(f"known light: {count} emitter(s), rendered and subtracted")
    text = "\n".join([*lines, str(found), *counted(found)])
    tell(text, found.to_dict(), json, quiet, out)
    raise typer.Exit(SURE if found.reason.name in BELIEVED else UNSURE)


def plan(file: Path, unit: str) -> NDArray[np.float64]:
    """(k, 3) positions of the lights in a file, in a unit of length; intensities need not be there.

    Raises ValueError where it has none, or in no unit that can be converted.
    """
    import numpy as np

    from lightloc import units

    try:
        content = read_json(file)
        own = str(content.get("unit", "m"))
        positions = np.array([row["position"] for row in content["lights"]], float)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        if str(error).startswith(f"{file}: "):
            raise
        raise ValueError(
            f'{file}: has no positions; expected {{"unit": "m", "lights": [{{"position": '
            "[x, y, z]}, ...]}"
        ) from None
    if not units.is_other(own, unit):
        return positions
    factor = units.conversion(own, unit)
    if factor is None:
        raise ValueError(f"{file} is in {own}, the observations are in {unit}")
    return np.asarray(positions * factor)


def named(method: str) -> Method | None:
    """A function of the user's; None of a method of ours."""
    if method in ("search", "paper"):
        return None
    from validation.methods import Method

    return Method.of(method, Path.cwd())


def counted(found: Localization) -> list[str]:
    """That no other number of lights is possible; where one is, a verdict says so."""
    from lightloc import Kind, Reason

    sure = found.reason in (Reason.CONVERGED, Reason.UNDECIDED)
    several = any(verdict.kind is Kind.CLUSTER for verdict in found.verdicts)
    alone = sure and not several and found.counts and len(found.possible) == 1
    return ["  No other number of lights is possible (95 %)."] if alone else []
