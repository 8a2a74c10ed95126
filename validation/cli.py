"""The command line. Heavy modules are imported inside the commands, so that --help is quick."""

from __future__ import annotations

import importlib.metadata
import os
import sys
import traceback
from typing import Annotated

import typer

from validation.commands.compare import compare_command
from validation.commands.diff import diff_command
from validation.commands.figures import figures_command
from validation.commands.localize import localize_command
from validation.commands.outputs import JSON, QUIET, sentence, tell
from validation.commands.paired import paired_command
from validation.commands.render import render_command
from validation.commands.report import report_command
from validation.commands.streams import cut_off, prepare
from validation.commands.study import study_command
from validation.commands.validate import validate_command

PASSED, FAILED, BAD_INPUT = 0, 1, 2

app = typer.Typer(
    name="lightloc",
    help="Find the point lights that light a room: how many, where, and how strong.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


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


app.command("render")(render_command)
app.command("localize")(localize_command)
app.command("compare")(compare_command)
app.command("validate")(validate_command)


app.command("study")(study_command)
app.command("diff")(diff_command)
app.command("paired")(paired_command)
app.command("figures")(figures_command)
app.command("report")(report_command)


@app.command("doctor")
def doctor_command(json: JSON = False, quiet: QUIET = False) -> None:
    """Print versions, the Dr.Jit backend and the LLVM in use, and try a tiny render."""
    from validation.commands.doctor import backend_rows, tiny_render, versions

    rows = versions() + backend_rows()
    good, said = tiny_render()
    rows.append(("tiny render", f"{'works' if good else 'FAILS'}: {said}"))
    tell("\n".join(f"{name:15} {value}" for name, value in rows), dict(rows), json, quiet)
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
