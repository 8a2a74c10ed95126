"""lightloc validate: a suite of cases, run, resumed, and held against a former run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.commands.diff import content, read
from validation.commands.diff import lines as diff_lines
from validation.commands.outputs import JSON, QUIET, tell, writable
from validation.commands.running import stoppable

PASSED, FAILED = 0, 1


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
    check: Annotated[
        Path | None,
        typer.Option(
            help="A former run's folder: print what changed since, and judge by that alone. Also "
            "writes OUT/junit.xml."
        ),
    ] = None,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Run a suite, several cases at a time. Exits with 1 where a case failed.

    With --check, where anything got worse than it was.

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
        text = "\n".join(f"{row.name:34} {row.claim}" for row in rows)
        tell(text, [row.model_dump(mode="json") for row in rows], json, quiet)
        return
    from lightloc import backend

    writable(out / "suite.json")
    before = read(check) if check else None
    backend.current()  # else every case would crash, and say so at length
    cases = Cases(rows, out, suite, run_case)
    names = [row.name for row in rows]
    with stoppable(cases, names, out, "cases"), Bar("cases", len(rows), quiet) as bar:
        summary = run_cases(name, cases, jobs, bar.case, again=bool(case))
    doubt = f" ({summary['unexplained']} unexplained)" if summary["unexplained"] else ""
    lines = [
        f"{summary['passed']} passed{doubt}, {summary['failed']} failed, "
        f"{summary['crashed']} crashed, {summary['shown']} shown, in {summary['seconds']:.0f} s"
    ]
    bad = bool(summary["failed"] or summary["crashed"])
    if before is not None:
        from validation.diff import changes
        from validation.records import read_suite as read_run
        from validation.report import write_junit

        after = [one for one in read(out) if one.name in names]
        write_junit(out, read_run(out)[0], after)
        found = changes([one for one in before if not case or one.name in names], after)
        lines += [f"Since {check}:", *diff_lines(found)]
        summary, bad = {**summary, "since": content(found)}, bool(found.bad)
    tell("\n".join(lines), summary, json, quiet)
    raise typer.Exit(FAILED if bad else PASSED)
