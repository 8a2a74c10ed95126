"""lightloc paired: two runs of the same scenes, room by room."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands.outputs import JSON, QUIET, tell
from validation.commands.running import console

KEPT, LOST = 0, 1


def paired_command(
    old: Annotated[Path, typer.Argument(help="Folder of the run to compare with.")],
    new: Annotated[Path, typer.Argument(help="Folder of the run that must lose nothing.")],
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Compare two runs of the same scenes, room by room: what `lightloc study` wrote.

    Exits with 1 where significantly many rooms are lost, all rows together.

    Example: lightloc paired studies-before/hard studies/hard
    """
    from validation.studies.paired import count, paired, show

    pairs, alone = paired(old, new)
    lost = [pair for pair in pairs if pair.old and not pair.new]
    worse = count(pairs).significantly_lost
    if json or quiet:
        names = [{"name": pair.name, "said": pair.said} for pair in lost]
        values = {"scenes": len(pairs), "alone": alone, "lost": names, "worse": bool(worse)}
        tell("", values, json, quiet)
    else:
        console().print(show(pairs))
        if alone:
            print(f"{alone} scenes have ended in one of the runs only, and are left out.")
        for pair in lost:
            print(f"lost: {pair.name} ({pair.said})")
    raise typer.Exit(LOST if worse else KEPT)
