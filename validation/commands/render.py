"""lightloc render: from a scene to observations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands.asked import Transport
from validation.commands.outputs import (
    FIND,
    JSON,
    QUIET,
    SEED,
    SET,
    UNIT,
    parameters,
    tell,
    writable,
)
from validation.jobs import ready, write_json

SCENE = Annotated[
    str, typer.Argument(help="A Mitsuba XML file, a mesh (PLY, OBJ, glTF), or a standard scene.")
]


def render_command(
    scene: SCENE,
    out: Annotated[Path, typer.Option("--out", "-o", help="The .npz file to write.")] = Path(
        "observations.npz"
    ),
    points: Annotated[
        int, typer.Option(min=1, max=10_000_000, help="How many surface points are observed.")
    ] = 4096,
    spp: Annotated[
        int, typer.Option(min=2, max=65_536, help="Path samples per point (full transport).")
    ] = 256,
    seed: SEED = 0,
    transport: Transport = Transport.full,
    noise: Annotated[float, typer.Option(help="Shot-noise level k, e.g. 0.01.")] = 0.0,
    set_: SET = [],  # noqa: B006
    find: FIND = [],  # noqa: B006
    unit: UNIT = None,
    view: Annotated[Path | None, typer.Option(help="Also write the camera's view, as EXR.")] = None,
    sensor: Annotated[int, typer.Option(min=0, help="Which of the scene's cameras.")] = 0,
    lights: Annotated[Path | None, typer.Option(help="Also write the true lights, JSON.")] = None,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Render a scene and write what is seen of it (never its lights).

    Example: lightloc render box_occluder -o seen.npz --lights truth.json
    """
    writable(out, view, lights)
    from validation.commands.progress import Bar

    with Bar("rendering", total=1.0, quiet=quiet) as bar:
        import render
        from lightloc import units

        room = render.load(scene, find=find or "point", unit=unit, **parameters(set_))
        seen = render.observe(
            room,
            points=points,
            spp=spp,
            seed=seed,
            transport=transport.value,
            noise=noise,
            watch=bar.to,
        )
        picture = (
            render.photograph(
                room, sensor=sensor, spp=max(2, spp), seed=seed, transport=transport.value
            )
            if view
            else None
        )
        seen.save(ready(out))
        if lights:
            truth = {**room.lights.to_dict(), "diagonal": room.diagonal}
            write_json(ready(lights), truth)
        if view and picture:
            render.write_exr(picture, ready(view))
    own = "the scene's own unit (--unit would name it)"
    lengths = own if room.unit == units.UNKNOWN else room.unit
    said = (
        f"{out}: {len(seen)} observations of {room.name}, {seen.channels} channel(s), "
        f"lengths in {lengths}"
    )
    if room.unobserved:
        left = "; ".join(f"{name} {why}" for name, why in room.unobserved.items())
        said += f"\nnot observed: {left}"
    values = {
        **{"observations": len(seen), "channels": seen.channels, "scene": room.name},
        **{"unit": room.unit, "not_observed": dict(room.unobserved), "notes": list(room.notes)},
    }
    tell("\n".join([said, *room.notes]), values, json, quiet, out, view, lights)
