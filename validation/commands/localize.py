"""`lightloc localize`: from observations to lights, with their errors and what can't be told."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from validation.commands.outputs import FIND, SEED, SET, UNIT, parameters, say, writable
from validation.jobs import ready, write_json

if TYPE_CHECKING:
    from lightloc import Options, Paper


class Method(StrEnum):
    search = "search"
    paper = "paper"


class Noise(StrEnum):
    given = "given"
    estimate = "estimate"


def localize_command(
    observations: Annotated[Path, typer.Argument(help="What `lightloc render` wrote, or an EXR.")],
    scene: Annotated[
        str | None, typer.Option(help="The scene, for its geometry; nothing occludes without it.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Found lights, JSON.")] = Path(
        "lights.json"
    ),
    method: Annotated[Method, typer.Option(help="Ours, or the paper's as published.")] = (
        Method.search
    ),
    rendered: Annotated[
        int,
        typer.Option(
            min=0,
            max=65_536,
            help="Paths per observation and light, to render the indirect light of what is found "
            "(needs --scene); 0: remove it with the observations themselves, which requires a "
            "largely diffuse room.",
        ),
    ] = 0,
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
    set_: SET = [],  # noqa: B006
    find: FIND = [],  # noqa: B006
    unit: UNIT = None,
    seed: SEED = 0,
) -> None:
    """Find the lights that explain the observations.

    Example: lightloc localize seen.npz --scene box_occluder -o found.json
    """
    writable(out)
    if rendered and not scene:
        raise ValueError("--rendered: needs --scene, the room that is rendered")
    if method is Method.paper and (rendered or ambient or noise is Noise.estimate):
        raise ValueError("--method paper: has no --rendered, --ambient or --noise estimate")
    region = box(bounds)
    from validation.commands.progress import Bar

    with Bar("searching") as bar:
        import render
        from lightloc import Observations, localize

        point = find or "point"
        room = render.load(scene, find=point, unit=unit, **parameters(set_)) if scene else None
        if observations.suffix.lower() == ".exr":
            seen = render.observe_view(observations, room)
        else:
            seen = Observations.load(observations)
            seen = render.attach(seen, room) if room else seen
        found = localize(
            seen,
            room.geometry if room else None,
            method=method.value,
            bounds=region,
            options=_options(method, ambient, noise),
            indirect=rendered or None,
            seed=seed,
            watch=lambda step: bar.say(f"{step.lights} lights, chi-square {step.chi2:.3g}"),
        )
        write_json(ready(out), found.to_dict())
    say(found, out)


def box(text: str | None) -> list[list[float]] | None:
    """The two corners of ``--bounds``.

    Examples
    --------
    >>> box("-2,-2,0,2,2,3")
    [[-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]]
    """
    if text is None:
        return None
    try:
        x0, y0, z0, x1, y1, z1 = (float(number) for number in text.split(","))
    except ValueError:
        raise ValueError(f"--bounds {text}: expected six numbers, X0,Y0,Z0,X1,Y1,Z1") from None
    return [[x0, y0, z0], [x1, y1, z1]]


def _options(method: Method, ambient: bool, noise: Noise) -> Options | Paper | None:
    from lightloc import Options

    return Options(ambient=ambient, noise=noise.value) if method is Method.search else None
