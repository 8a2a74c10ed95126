"""What the commands that run scenes share: a bar, exit codes, and what Ctrl-C says."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from validation.jobs import Ended, Scene

PASSED, CRASHED, STOPPED = 0, 1, 130  # 128 + SIGINT, as shells say it
PLAIN_WIDTH = 150  # columns of text where no terminal says its own


def carry_out(
    scene: Scene,
    names: Sequence[str],
    out: Path,
    *,
    jobs: int = 0,
    dask: str | None = None,
    quiet: bool = False,
) -> None:
    """Run the scenes that have no result yet, with a bar; Ctrl-C ends it in a sentence.

    Raises
    ------
    typer.Exit
        If it was stopped; what had ended is kept.
    """
    from lightloc import backend
    from validation.commands.progress import Bar
    from validation.jobs import run, waiting

    if dask is None:
        backend.current()  # else every scene would crash, and say so at length
    left = waiting(names, out, scene)
    with stoppable(scene, names, out, "scenes"), Bar("scenes", len(left), quiet) as bar:

        def watch(ended: Ended) -> None:
            outcome = "crashed" if ended.error else "passed"
            bar.case({"name": ended.name, "outcome": outcome, "why": [ended.error]})

        run(scene, names, out, jobs=jobs, dask=dask, watch=watch)


@contextmanager
def stoppable(scene: Scene, names: Sequence[str], out: Path, what: str) -> Iterator[None]:
    """Ctrl-C within ends a run in a sentence: how much is kept, and how to go on."""
    from validation.jobs import waiting

    try:
        yield
    except KeyboardInterrupt:
        kept = len(names) - len(waiting(names, out, scene))
        said = f"stopped with {kept} of {len(names)} {what}; the same command goes on from there"
        print(f"lightloc: {said}", file=sys.stderr)
        raise typer.Exit(STOPPED) from None


def console() -> Console:
    """Where tables are printed: as wide as the terminal, or as a page of text."""
    from rich.console import Console

    class Plain(Console):
        def on_broken_pipe(self) -> None:  # of its own it ends with 1: a scene crashed
            raise BrokenPipeError

    return Plain(width=None if sys.stdout.isatty() else PLAIN_WIDTH, highlight=False)
