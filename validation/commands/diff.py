"""lightloc diff: two runs of a suite, case by case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from validation.commands.outputs import JSON, QUIET, tell, writable
from validation.jobs import ready

if TYPE_CHECKING:
    from validation.diff import Changes
    from validation.records import Result

SAME, DIFFERS = 0, 1


def diff_command(
    before: Annotated[Path, typer.Argument(help="Folder that `lightloc validate` filled.")],
    after: Annotated[Path, typer.Argument(help="Another, of the same cases.")],
    page: Annotated[
        Path | None, typer.Option(help="Also draw it as a page, HTML, whose sides can be swapped.")
    ] = None,
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Compare two runs of a suite. Exits with 1 where anything but a time got worse.

    Named is what fails or holds now, and what changed by more than errors and chance allow.

    Example: lightloc diff report-before report
    """
    writable(page)
    from validation.diff import changes

    old, new = read(before), read(after)
    found = changes(old, new)
    if page:
        from validation.report import write_diff

        write_diff(ready(page), (str(before), old), (str(after), new))
    tell("\n".join(lines(found)), content(found), json, quiet, page)
    raise typer.Exit(DIFFERS if found.bad else SAME)


def read(folder: Path) -> list[Result]:
    """The results of a run."""
    from validation.records import read_result, read_suite

    suite, _ = read_suite(folder)
    return [read_result(folder / "cases" / name)[0] for name in suite.cases]


def content(found: Changes) -> dict[str, Any]:
    """What changed, as JSON has it."""
    return {
        "cases": found.cases,
        "worse": found.bad,
        "changes": [
            {"case": one.case, "kind": one.kind.name, "said": one.said, "p": one.p}
            for one in found.changes
        ],
    }


def lines(found: Changes) -> list[str]:
    """A heading and a line each, what got worse first."""
    from validation.diff import Kind

    result = []
    for kind in Kind:
        some = found.of(kind)
        result += [f"{kind.value}:"] if some else []
        for one in some:
            chance = "" if one.p is None else f" (p {one.p:.1g})"
            result.append(f"  {one.case}: {one.said}{chance}")
    changed = len({one.case for one in found.changes})
    result.append(
        f"{found.bad} for the worse, {len(found.changes) - found.bad} otherwise; "
        f"{max(0, found.cases - changed)} of {found.cases} cases as before"
    )
    return result
