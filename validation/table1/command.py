"""lightloc table1: the paper's Table 1, run, resumed, printed and drawn."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from validation.outputs import writable

PASSED, CRASHED, STOPPED = 0, 1, 130  # 128 + SIGINT, as shells say it
PLAIN_WIDTH = 110  # columns of text where no terminal says its own


def table1_command(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the results.")] = Path(
        "table1"
    ),
    scenes: Annotated[int, typer.Option(min=1, max=100, help="Scenes a row, of 100.")] = 100,
    jobs: Annotated[int, typer.Option(min=0, help="Scenes at a time; 0: one a core.")] = 0,
    dask: Annotated[
        str | None, typer.Option(help="A Dask scheduler to run on, as tcp://10.0.0.1:8786.")
    ] = None,
    row: Annotated[list[str], typer.Option(help="Run this row only, as noisy-5.")] = [],  # noqa: B006
) -> None:
    """Run the paper's Table 1 and draw it. Exits with 1 where a scene crashed.

    What has ended is kept: stopped or killed, the same command goes on.

    Example: lightloc table1 --scenes 10 --row noisy-5
    """
    from validation.table1.published import ROWS

    for name in row:
        if name not in ROWS:
            raise ValueError(f"--row {name}: no such row; expected one of {', '.join(ROWS)}")
    if dask is not None and jobs:
        raise ValueError(f"--jobs {jobs}: the cluster at --dask {dask} has its own workers")
    writable(*(out / file for file in ("scenes.jsonl", "table1.md", "table1.json", "index.html")))

    from lightloc import backend
    from validation.progress import Bar
    from validation.table1 import columns
    from validation.table1.run import run
    from validation.table1.scenes import Ended, row_of, waiting

    names = columns.names(scenes)
    chosen = [name for name in names if not row or row_of(name) in row]
    if dask is None:
        backend.current()  # else every scene would crash, and say so at length
    left = waiting(chosen, out)
    try:
        with Bar("scenes", total=len(left)) as bar:

            def watch(ended: Ended) -> None:
                outcome = "crashed" if ended.error else "passed"
                bar.case({"name": ended.name, "outcome": outcome, "why": [ended.error]})

            run(columns.scene, chosen, out, jobs=jobs, dask=dask, watch=watch)
    except KeyboardInterrupt:
        kept = len(chosen) - len(waiting(chosen, out))
        said = f"stopped with {kept} of {len(chosen)} scenes; the same command goes on from there"
        print(f"lightloc: {said}", file=sys.stderr)
        raise typer.Exit(STOPPED) from None
    crashed = _show(out, names, chosen)
    raise typer.Exit(CRASHED if crashed else PASSED)


def _show(out: Path, names: list[str], chosen: list[str]) -> int:
    """Print the table and write it; the number of scenes that crashed."""
    from rich.console import Console

    from validation.made import made
    from validation.report import write_table1
    from validation.report.disk import write_text
    from validation.table1 import table
    from validation.table1.scenes import read

    ended = read(out)
    rows, how = table.tabulate(names, ended), made()
    console = Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH, highlight=False)
    console.print(table.terminal(rows))
    console.print(table.verdict(rows), markup=False, soft_wrap=True)
    scenes = [ended[name] for name in names if name in ended]
    write_text(out / "table1.md", table.markdown(rows, scenes, how))
    write_text(out / "table1.json", table.document(rows, scenes, how))
    print(write_table1(out))
    return sum(name in ended and bool(ended[name].error) for name in chosen)
