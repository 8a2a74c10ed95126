"""`lightloc localize`: from observations to lights, with their errors and what can't be told."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from validation.commands.observed import Given
from validation.commands.outputs import FIND, SEED, SET, UNIT, parameters, say, writable
from validation.jobs import ready, write_json

if TYPE_CHECKING:
    from lightloc import Options, Paper


MOST_PATHS = 65_536


class Method(StrEnum):
    search = "search"
    paper = "paper"


class Transport(StrEnum):
    direct = "direct"
    full = "full"


class Noise(StrEnum):
    given = "given"
    estimate = "estimate"


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
    method: Annotated[Method, typer.Option(help="Ours, or the paper's as published.")] = (
        Method.search
    ),
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
    noise: Annotated[
        Noise, typer.Option(help="Take sigma as given, or estimate it from what is left.")
    ] = Noise.given,
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
    albedo: Annotated[
        float | None, typer.Option(help="Of readings of luminance or radiance: the surface's.")
    ] = None,
    set_: SET = [],  # noqa: B006
    find: FIND = [],  # noqa: B006
    unit: UNIT = None,
    seed: SEED = 0,
) -> None:
    """Find the lights that explain the observations.

    Example: lightloc localize seen.npz --scene box_occluder -o found.json
    """
    writable(out)
    given = Given(
        observations,
        sensor,
        None if camera is None else point(camera),
        None if transport is None else transport.value,
        albedo,
        unit,
    )
    way = paths(indirect)
    if isinstance(way, int) and not scene:
        raise ValueError("--indirect: needs --scene, the room that is rendered")
    if method is Method.paper and (isinstance(way, int) or ambient or noise is Noise.estimate):
        raise ValueError("--method paper: has no --indirect PATHS, --ambient or --noise estimate")
    region = box(bounds)
    from validation.commands.progress import Bar

    with Bar("searching") as bar:
        import render
        from lightloc import Assumption, localize

        hidden = find or "point"
        room = render.load(scene, find=hidden, unit=unit, **parameters(set_)) if scene else None
        seen, said = given.read(room)
        found = localize(
            seen,
            room.geometry if room else None,
            method=method.value,
            bounds=region,
            options=_options(method, ambient, noise),
            indirect=way,
            seed=seed,
            watch=lambda step: bar.say(f"{step.lights} lights, chi-square {step.chi2:.3g}"),
        )
        write_json(ready(out), found.to_dict())
    lines = [f"{observations[0]}: {said}"] if said else []
    if room:
        lines += room.notes
        if Assumption.KNOWN_LIGHT in found.assumed:
            count = len(room.known.emitters())
            lines.append(f"known light: {count} emitter(s), rendered and subtracted")
    say("\n".join([*lines, str(found)]), out)


def paths(text: str | None) -> int | Literal["gathered"] | None:
    """What ``--indirect`` asks for.

    Examples
    --------
    >>> paths("256"), paths("gathered"), paths(None)
    (256, 'gathered', None)
    """
    if text is None:
        return None
    if text == "gathered":
        return "gathered"
    if not (text.isdecimal() and text.isascii() and len(text) < 6 and 2 <= int(text) <= MOST_PATHS):
        raise ValueError(
            f"--indirect {text}: expected a number from 2 to {MOST_PATHS}, or gathered"
        )
    return int(text)


def point(text: str) -> list[float]:
    """The position of ``--camera``.

    Examples
    --------
    >>> point("0.3,0.3,1.7")
    [0.3, 0.3, 1.7]
    """
    return _numbers("--camera", text, "X,Y,Z")


def _numbers(option: str, text: str, expected: str) -> list[float]:
    """As many numbers as there are words in what is expected."""
    words = text.split(",")
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    count = len(expected.split(","))
    if len(values) != count or not all(map(math.isfinite, values)):
        raise ValueError(f"{option} {text}: expected {SPELLED[count]} numbers, {expected}")
    return values


SPELLED = {3: "three", 6: "six"}


def box(text: str | None) -> list[list[float]] | None:
    """The two corners of ``--bounds``.

    Examples
    --------
    >>> box("-2,-2,0,2,2,3")
    [[-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]]
    """
    if text is None:
        return None
    corners = _numbers("--bounds", text, "X0,Y0,Z0,X1,Y1,Z1")
    return [corners[:3], corners[3:]]


def _options(method: Method, ambient: bool, noise: Noise) -> Options | Paper | None:
    from lightloc import Options

    return Options(ambient=ambient, noise=noise.value) if method is Method.search else None
