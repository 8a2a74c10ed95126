"""lightloc report: the pages of a suite's run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands.outputs import JSON, QUIET, tell


def report_command(
    out: Annotated[
        Path,
        typer.Argument(help="A folder that `lightloc validate` filled."),
    ] = Path("report"),
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Draw OUT/index.html from the results of `lightloc validate`; does not render again."""
    from validation.commands.progress import Bar
    from validation.report import write

    with Bar("drawing", quiet=quiet):
        page = write(out)
    tell(page, {"page": str(page)}, json, quiet)
