"""lightloc table1: the paper's Table 1, run, resumed, printed and drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands.outputs import writable
from validation.commands.running import CRASHED, PASSED, carry_out, console


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
    from validation.studies.published import ROWS

    for name in row:
        if name not in ROWS:
            raise ValueError(f"--row {name}: no such row; expected one of {', '.join(ROWS)}")
    if dask is not None and jobs:
        raise ValueError(f"--jobs {jobs}: the cluster at --dask {dask} has its own workers")
    writable(*(out / file for file in ("scenes.jsonl", "table1.md", "table1.json", "index.html")))

    from validation.jobs import row_of
    from validation.studies import columns

    names = columns.names(scenes)
    chosen = [name for name in names if not row or row_of(name) in row]
    carry_out(columns.scene, chosen, out, jobs=jobs, dask=dask)
    crashed = _show(out, names, chosen)
    raise typer.Exit(CRASHED if crashed else PASSED)


def _show(out: Path, names: list[str], chosen: list[str]) -> int:
    """Print the table and write it; the number of scenes that crashed."""
    from validation.jobs import made, read, write_text
    from validation.report import write_table1
    from validation.studies import columns
    from validation.studies import table1 as table

    ended = read(out, columns.scene)
    rows, how = table.tabulate(names, ended), made()
    terminal = console()
    terminal.print(table.terminal(rows))
    terminal.print(table.verdict(rows), markup=False, soft_wrap=True)
    scenes = [ended[name] for name in names if name in ended]
    write_text(out / "table1.md", table.markdown(rows, scenes, how))
    write_text(out / "table1.json", table.document(rows, scenes, how))
    print(write_table1(out))
    return sum(name in ended and bool(ended[name].error) for name in chosen)
