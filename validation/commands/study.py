"""lightloc study: one of the studies, run, resumed, printed and drawn."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from validation.commands.outputs import JSON, QUIET, tell, writable
from validation.commands.running import CRASHED, PASSED, carry_out, console
from validation.jobs import row_of
from validation.studies import GROUPS, NAMES

if TYPE_CHECKING:
    from validation.studies.study import Study

KNOWN = (*NAMES, *GROUPS)
FILES = ("scenes.jsonl", "study.md", "study.json", "index.html")


def study_command(
    name: Annotated[list[str], typer.Argument(help=f"One or more of {', '.join(KNOWN)}.")],
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="Folder for the results, one subfolder per study."),
    ] = Path("studies"),
    scenes: Annotated[
        int | None,
        typer.Option(min=1, max=100, help="Scenes per row; by default the study's own."),
    ] = None,
    row: Annotated[list[str], typer.Option(help="Run this row only, e.g. noisy-5.")] = [],  # noqa: B006
    jobs: Annotated[int, typer.Option(min=0, help="Scenes at a time; 0: one per core.")] = 0,
    dask: Annotated[
        str | None, typer.Option(help="A Dask scheduler to run on, e.g. tcp://10.0.0.1:8786.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="A solver in our search's place: paper, or a function of yours, as "
            "module:function or file.py:function."
        ),
    ] = None,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Run studies and draw them. Exits with 1 where a scene crashed; a missed goal is no failure.

    Finished scenes are kept: after an interruption, the same command resumes.

    Example: lightloc study many --scenes 2
    """
    for one in name:
        if one not in KNOWN:
            raise ValueError(f"{one}: no such study; expected one of {', '.join(KNOWN)}")
    name = list(dict.fromkeys(each for one in name for each in GROUPS.get(one, (one,))))
    if dask is not None and jobs:
        raise ValueError(f"--jobs {jobs}: the cluster at --dask {dask} has its own workers")
    studies = [find(one) for one in name]
    if method is not None:
        from validation.methods import Method
        from validation.studies.solver import by

        studies = [by(study, Method.of(method, Path.cwd())) for study in studies]
    writable(*(out / study.name / file for study in studies for file in FILES))
    for asked in row:
        known = {row_of(scene) for study in studies for scene in study.names(1)}
        if asked not in known:
            raise ValueError(
                f"--row {asked}: no such row; expected one of {', '.join(sorted(known))}"
            )

    def run(study: Study, names: Sequence[str]) -> None:
        chosen = [scene for scene in names if not row or row_of(scene) in row]
        carry_out(study.one, chosen, out / study.name, jobs=jobs, dask=dask, quiet=quiet)

    said = not (json or quiet)
    crashed = sum(_study(study, out / study.name, scenes, run, said) for study in studies)
    if json:
        tell("", [_content(out / study.name) for study in studies], json, quiet)
    raise typer.Exit(CRASHED if crashed else PASSED)


def find(name: str) -> Study:
    """The study of that name, whose file is named as it is."""
    return importlib.import_module(f"validation.studies.{name}").STUDY


def _content(out: Path) -> dict[str, Any]:
    """What study.json holds, without its scenes; nothing where nothing could be run."""
    from validation.jobs import read_json

    file = out / "study.json"
    whole = read_json(file) if file.exists() else {}
    return {name: value for name, value in whole.items() if name != "scenes"}


def _study(
    study: Study,
    out: Path,
    scenes: int | None,
    run: Callable[[Study, Sequence[str]], None],
    said: bool,
) -> int:
    """Run one study, print its table and write it; the number of scenes that crashed."""
    from validation.jobs import made, read, write_text
    from validation.report import write_study
    from validation.studies import study as rows_of
    from validation.studies import table

    per_row = scenes or study.per_row
    names = study.names(per_row)
    if not names:
        if said:
            print(f"{study.name}: there is nothing to run here. {study.question}")
        return 0
    run(study, names)
    found = read(out, study.one)
    ended = [found[name] for name in names if name in found]
    rows, how = rows_of.tabulate(study, names, found), made()
    write_text(out / "study.md", table.markdown(study, per_row, rows, how))
    write_text(out / "study.json", table.document(study, per_row, rows, ended, how))
    page = write_study(out)
    if said:
        terminal = console()
        terminal.print(table.terminal(study, rows))
        terminal.print(" ".join(rows_of.outcome(study, rows)), markup=False, soft_wrap=True)
        print(page)
    return sum(bool(scene.error) for scene in ended)
