"""Run a suite's cases and keep what each leaves: OUT/suite.json and OUT/cases/NAME/."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote
from typing import Any

from validation.jobs import Ended, run, waiting, write_json
from validation.records import SCHEMA, UNEXPLAINED
from validation.suite.cases import Case, is_packaged

OUTCOMES = ("passed", "failed", "shown", "crashed")
PICTURES = ("room.npz", "fields.npz", "view.npz", "view.exr")
LEFT = ("result.json", "observations.npz", "printed.txt", *PICTURES)
LIMIT = 300.0  # seconds after which a case counts as crashed
MARGIN = 60.0  # of them, beyond what a solver may take


@dataclass(frozen=True)
class Done:
    """A case that has come to its end, whatever came out."""

    name: str
    outcome: str
    peak_mb: int


@dataclass(frozen=True, eq=False)
class Cases:
    """Runs the cases of a suite by name.

    Parameters
    ----------
    rows
        The cases.
    out
        Where each leaves its files, in cases/NAME.
    suite
        As the command line names it.
    one
        Runs one case and leaves its files in a folder; returns what result.json holds.
    """

    rows: Sequence[Case]
    out: Path
    suite: str
    one: Callable[[Case, Path, str], dict[str, Any]]

    def __call__(self, name: str) -> Done:
        case, folder = self.case(name), self.folder(name)
        folder.mkdir(parents=True, exist_ok=True)
        for former in LEFT:  # else a room that crashes would be drawn as it was
            (folder / former).unlink(missing_ok=True)
        result = self.one(case, folder, self.command(name))
        return Done(name, result["outcome"], result.get("peak_mb", 0))

    def given(self, name: str) -> Iterator[str | Path]:
        """What decides a case's result beside the code: its row, and the files of its scene.

        Nothing for a case of an earlier run that is no row any more.
        """
        import render

        if name not in (row.name for row in self.rows):
            return
        case = self.case(name)
        yield case.model_dump_json()
        for one in (case.solver, case.measure):
            if one and one.file:
                yield one.file
        try:
            yield from render.files_of(case.scene_file, **case.parameters)
            if case.assumed_file:
                yield from render.files_of(case.assumed_file, **case.assumed_parameters)
        except (ValueError, RuntimeError, OSError):  # it will crash, and say why
            return

    def case(self, name: str) -> Case:
        """The row of that name."""
        return next(row for row in self.rows if row.name == name)

    def folder(self, name: str) -> Path:
        """Where a case leaves its files."""
        return self.out / "cases" / name

    def command(self, name: str) -> str:
        """What repeats a case, in any folder."""
        case = self.case(name)
        suite = self.suite if is_packaged(self.suite) else str(Path(self.suite).resolve())
        where = "" if suite == "standard" else f"--suite {quote(suite)} "
        who = f"--method {quote(case.method)} " if case.asked else ""
        return f"lightloc validate {where}{who}--case {case.row}"

    def result(self, name: str) -> dict[str, Any] | None:
        """What result.json holds; None where there is none, or half of one."""
        try:
            return dict(json.loads((self.folder(name) / "result.json").read_text()))
        except (OSError, ValueError):
            return None


def run_cases(
    title: str,
    cases: Cases,
    jobs: int = 0,
    done: Callable[[dict[str, Any]], None] = lambda result: None,
    again: bool = False,
) -> dict[str, Any]:
    """Run cases, ``jobs`` at a time (0: one per core), and write OUT/suite.json.

    A case whose result was made by the same code from the same row and scene is not run again
    (but for ``again``), so a run that was killed goes on where it stopped. A case whose process
    dies, or that runs longer than `LIMIT`, has crashed, and no other has. With ``again``, the
    other cases of an earlier run of the suite stay listed in suite.json; what is returned counts
    this run's alone.
    """
    started, clock = datetime.now(UTC), time.perf_counter()
    names, out = [row.name for row in cases.rows], cases.out
    jobs = jobs or os.cpu_count() or 1
    left = names if again else waiting(names, out, cases)
    left = [name for name in names if name in left or cases.result(name) is None]
    for name in names:
        if name not in left:
            done(cases.result(name) or {})

    def watch(ended: Ended) -> None:
        if ended.error:
            write_json(cases.folder(ended.name) / "result.json", crashed(cases, ended))
        done(cases.result(ended.name) or {})

    threads = max(1, (os.cpu_count() or 1) // jobs)
    others = [row.seconds + MARGIN for row in cases.rows if not row.solver.is_own]
    limit = max([LIMIT, *others])
    run(cases, left, out, jobs=jobs, threads=threads, limit=limit, watch=watch, again=True)
    results = [cases.result(name) or {} for name in names]
    summary = {
        "schema": SCHEMA,
        "suite": title,
        "started": started.isoformat(timespec="seconds"),
        "seconds": round(time.perf_counter() - clock, 1),
        "peak_mb": jobs * max((result.get("peak_mb", 0) for result in results), default=0),
        "cases": names,
        **counts(results),
    }
    write_json(out / "suite.json", with_earlier(summary, cases) if again else summary)
    return summary


def counts(results: Sequence[dict[str, Any]]) -> dict[str, int]:
    """How many came out how, and how many that passed are unexplained by their own answer."""
    outcomes = [result["outcome"] for result in results]
    return {
        **{kind: outcomes.count(kind) for kind in OUTCOMES},
        "unexplained": sum(is_unexplained(result) for result in results),
    }


def is_unexplained(result: dict[str, Any]) -> bool:
    """Whether a case passed with an answer that says itself that it does not explain the data."""
    reason = (result.get("search") or {}).get("reason", "")
    return result["outcome"] == "passed" and reason.lower() in UNEXPLAINED


def with_earlier(summary: dict[str, Any], cases: Cases) -> dict[str, Any]:
    """The summary with the cases of an earlier run of the same suite, in their order."""
    try:
        earlier = json.loads((cases.out / "suite.json").read_text())
    except (OSError, ValueError):
        return summary
    if earlier.get("suite") != summary["suite"]:
        return summary
    names = dict.fromkeys([*earlier.get("cases", []), *summary["cases"]])
    results = {name: result for name in names if (result := cases.result(name))}
    return {
        **summary,
        "started": earlier["started"],
        "seconds": earlier["seconds"],
        "peak_mb": max(earlier["peak_mb"], summary["peak_mb"]),
        "cases": list(results),
        **counts(list(results.values())),
    }


def crashed(cases: Cases, ended: Ended) -> dict[str, Any]:
    """The result of a case that has none of its own."""
    case = cases.case(ended.name)
    named = {"name", "scene", "claim", "brdf", "transport", "noise", "gated"}
    return {
        "schema": SCHEMA,
        **case.model_dump(include=named | {"method"}),
        "alpha": case.alpha,
        "outcome": "crashed",
        "why": [ended.error],
        "command": cases.command(ended.name),
        "made": {"date": datetime.now(UTC).isoformat(timespec="seconds")},
    }
