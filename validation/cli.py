"""The command line. Heavy modules are imported inside the commands, so that --help is quick."""

from __future__ import annotations

import importlib.metadata
import os
import sys
import traceback
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from validation.commands.diff import diff_command
from validation.commands.figures import figures_command
from validation.commands.localize import localize_command
from validation.commands.outputs import (
    FIND,
    SEED,
    SET,
    UNIT,
    in_the_unit,
    parameters,
    say,
    sentence,
    writable,
)
from validation.commands.paired import paired_command
from validation.commands.running import stoppable
from validation.commands.streams import cut_off, prepare
from validation.commands.study import study_command
from validation.jobs import ready

PASSED, FAILED, BAD_INPUT = 0, 1, 2

app = typer.Typer(
    name="lightloc",
    help="Find the point lights that light a room: how many, where, and how strong.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


class Transport(StrEnum):
    direct = "direct"
    full = "full"


SCENE = Annotated[
    str, typer.Argument(help="A Mitsuba XML file, a mesh (PLY, OBJ, glTF), or a standard scene.")
]


def say_version(asked: bool) -> None:
    """Print the version that is installed, and stop."""
    if asked:
        print(f"lightloc {importlib.metadata.version('lightloc')}")
        raise typer.Exit(PASSED)


@app.callback()
def common(
    debug: Annotated[bool, typer.Option(help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool,
        typer.Option("--version", callback=say_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    if debug:
        os.environ["LIGHTLOC_DEBUG"] = "1"


@app.command("render")
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
) -> None:
    """Render a scene and write what is seen of it (never its lights).

    Example: lightloc render box_occluder -o seen.npz --lights truth.json
    """
    writable(out, view, lights)
    from validation.commands.progress import Bar

    with Bar("rendering", total=1.0) as bar:
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
            room.lights.save(ready(lights))
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
    say("\n".join([said, *room.notes]), out, view, lights)


app.command("localize")(localize_command)


@app.command("compare")
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
    else:
        import render

        room = render.load(truth, find=find or "point", unit=unit, **parameters(set_))
        true, diagonal = room.lights, room.diagonal
    verdict = compare(lights, true, diagonal)
    print(verdict)
    near = all(
        worst is None or worst <= limit
        for worst, limit in (
            (verdict.worst_position_percent, within),
            (verdict.worst_intensity_percent, intensity),
        )
    )
    right = verdict.count_right and not verdict.missed
    raise typer.Exit(PASSED if right and near else FAILED)


@app.command("validate")
def validate_command(
    suite: Annotated[str, typer.Option(help="A suite's TOML file, or 'standard'.")] = "standard",
    case: Annotated[list[str], typer.Option(help="Run only this case, even if it is done.")] = [],  # noqa: B006
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the results.")] = Path(
        "report"
    ),
    method: Annotated[
        list[str],
        typer.Option(
            help="What finds the lights: search, paper, or a function of yours, as "
            "module:function or file.py:function. Several are judged side by side."
        ),
    ] = [],  # noqa: B006
    jobs: Annotated[int, typer.Option(min=0, help="Cases at a time; 0: one per core.")] = 0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List the cases and stop.")] = False,
) -> None:
    """Run a suite, several cases at a time. Exits with 1 where a case failed.

    Example: lightloc validate --case box_two-direct
    """
    from validation.commands.progress import Bar
    from validation.suite import Cases, by_methods, read_suite, run_case, run_cases

    name, rows = read_suite(suite)
    if case:
        unknown = set(case) - {row.name for row in rows}
        if unknown:
            raise ValueError(f"--case {sorted(unknown)[0]}: no such case in {suite}; see --dry-run")
        rows = [row for row in rows if row.name in case]
    if method:
        rows = by_methods(rows, method, Path.cwd())
    if dry_run:
        for row in rows:
            print(f"{row.name:34} {row.claim}")
        return
    from lightloc import backend

    writable(out / "suite.json")
    backend.current()  # else every case would crash, and say so at length
    cases = Cases(rows, out, suite, run_case)
    names = [row.name for row in rows]
    with stoppable(cases, names, out, "cases"), Bar("cases", total=len(rows)) as bar:
        summary = run_cases(name, cases, jobs, bar.case, again=bool(case))
    doubt = f" ({summary['unexplained']} unexplained)" if summary["unexplained"] else ""
    print(
        f"{summary['passed']} passed{doubt}, {summary['failed']} failed, "
        f"{summary['crashed']} crashed, {summary['shown']} shown, in {summary['seconds']:.0f} s"
    )
    raise typer.Exit(FAILED if summary["failed"] or summary["crashed"] else PASSED)


app.command("study")(study_command)
app.command("diff")(diff_command)
app.command("paired")(paired_command)
app.command("figures")(figures_command)


@app.command("report")
def report_command(
    out: Annotated[
        Path,
        typer.Argument(help="A folder that `lightloc validate` filled."),
    ] = Path("report"),
) -> None:
    """Draw OUT/index.html from the results of `lightloc validate`; does not render again."""
    from validation.commands.progress import Bar
    from validation.report import write

    with Bar("drawing"):
        page = write(out)
    print(page)


@app.command("doctor")
def doctor_command() -> None:
    """Print versions, the Dr.Jit backend and the LLVM in use, and try a tiny render."""
    from validation.commands.doctor import backend_rows, tiny_render, versions

    for name, value in versions() + backend_rows():
        print(f"{name:15} {value}")
    good, said = tiny_render()
    print(f"{'tiny render':15} {'works' if good else 'FAILS'}: {said}")
    raise typer.Exit(PASSED if good else FAILED)


def main() -> None:
    """Entry point: one plain sentence and exit code 2 for bad input."""
    output = prepare()
    os.environ["PYTHONSAFEPATH"] = "1"  # no child imports what lies in the user's folder
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
        sys.stdout.flush()
    except SystemExit:
        if sys.stdout is not output:  # typer puts another there where it was cut off
            sys.exit(cut_off())
        raise
    except Exception as error:
        if isinstance(error, BrokenPipeError) and error.filename is None:
            sys.exit(cut_off())
        said = sentence(error)
        if said is None:
            raise
        if os.environ.get("LIGHTLOC_DEBUG"):
            traceback.print_exc()
        print(f"lightloc: {said}", file=sys.stderr)
        sys.exit(BAD_INPUT)
    sys.exit(code)
