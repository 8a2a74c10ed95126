"""A suite is a TOML file with a row a case; each case runs in a child process of its own."""

from __future__ import annotations

import hashlib
import importlib.resources
import json
import os
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from validation.jobs import write_json

SCHEMA = 1
OUTCOMES = ("passed", "failed", "shown", "crashed")
TIMEOUT = 300.0  # seconds after which a case counts as crashed
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class Case(BaseModel):
    """One row: a scene, how it is observed, what must come out and how near.

    ``lights``, rows of [x, y, z, intensity], take the place of the scene's own where given. With
    ``rendered``, the indirect light of what is found is rendered.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$")  # a folder's name
    scene: str
    claim: str
    brdf: Literal["diffuse", "conductor", "plastic", "mixed"]
    parameters: dict[str, float] = {}
    lights: tuple[tuple[float, float, float, float], ...] = ()
    transport: Literal["direct", "full"] = "direct"
    noise: float = Field(0.0, ge=0, lt=1)
    points: int = Field(4096, ge=1, le=200_000)
    spp: int = Field(256, ge=2, le=65_536)
    rendered: int = Field(0, ge=0, le=65_536)  # samples a light; 0: footnote 1 alone
    seed: int = Field(0, ge=0)
    gated: bool = True
    closed_form: bool = False  # also judge B itself, in the integrating sphere
    position_percent: float = Field(gt=0)
    intensity_percent: float = Field(gt=0)

    @property
    def alpha(self) -> float | None:
        return self.parameters.get("alpha")


def read_suite(path: str | Path) -> tuple[str, list[Case]]:
    """(name, cases) of a suite: a TOML file, or the name of one that comes with the package.

    What stands under ``[defaults]`` holds for every row that does not say otherwise.
    Raises ValueError naming the file, the case and the field.
    """
    file = Path(path)
    if not file.is_file():
        packaged = importlib.resources.files("scenes") / f"{path}.toml"
        if not packaged.is_file():
            raise ValueError(f"{path}: no such suite file")
        file = Path(str(packaged))
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: {error}") from None
    defaults = content.get("defaults", {})
    rows = content.get("case", [])
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"{file}: has no [[case]]")
    if not isinstance(defaults, dict):
        raise ValueError(f"{file}: defaults is no table; expected [defaults]")
    cases = []
    for row in rows:
        try:
            cases.append(Case(**{**defaults, **row}))
        except ValidationError as error:
            first = error.errors()[0]
            field = ".".join(str(part) for part in first["loc"]) or "row"
            name = row.get("name", "?")
            raise ValueError(f"{file}: case '{name}': {field}: {first['msg']}") from None
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{file}: two cases are called '{name}'")
    return str(content.get("name", file.stem)), cases


def run(
    name: str,
    cases: Sequence[Case],
    out: Path,
    jobs: int,
    command: Callable[[Case], str],
    done: Callable[[dict[str, Any]], None] = lambda result: None,
    again: bool = False,
) -> dict[str, Any]:
    """Run cases in child processes, ``jobs`` at a time, and write OUT/suite.json.

    A case whose result was made by the same code from the same row is not run again (but for
    ``again``), so a run that was killed goes on where it stopped. A child that dies, or runs
    longer than `TIMEOUT`, fails its case and no other. With ``again``, the other cases of an
    earlier run of the suite stay listed in suite.json; what is returned counts this run's alone.
    """
    started, clock = datetime.now(UTC), time.perf_counter()
    lock = threading.Lock()

    def one(case: Case) -> dict[str, Any]:
        kept = None if again else _kept(case, out)
        result = kept or _child(case, out, command(case))
        with lock:
            done(result)
        return result

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        results = list(pool.map(one, cases))
    outcomes = [result["outcome"] for result in results]
    summary = {
        "schema": SCHEMA,
        "suite": name,
        "started": started.isoformat(timespec="seconds"),
        "seconds": round(time.perf_counter() - clock, 1),
        "peak_mb": max((result.get("peak_mb", 0) for result in results), default=0) * jobs,
        "cases": [case.name for case in cases],
        **{kind: outcomes.count(kind) for kind in OUTCOMES},
    }
    write_json(out / "suite.json", _merged(summary, out) if again else summary)
    return summary


def _merged(summary: dict[str, Any], out: Path) -> dict[str, Any]:
    """The summary with the cases of an earlier run of the same suite in OUT, in their order."""
    try:
        earlier = json.loads((out / "suite.json").read_text())
    except (OSError, ValueError):
        return summary
    rest = set(earlier.get("cases", [])) - set(summary["cases"])
    if earlier.get("suite") != summary["suite"] or not rest:
        return summary
    names = earlier["cases"] + [n for n in summary["cases"] if n not in earlier["cases"]]
    names = [n for n in names if (out / "cases" / n / "result.json").is_file()]
    results = [json.loads((out / "cases" / n / "result.json").read_text()) for n in names]
    outcomes = [result["outcome"] for result in results]
    return {
        **summary,
        "started": earlier["started"],
        "seconds": earlier["seconds"],
        "peak_mb": max(earlier["peak_mb"], summary["peak_mb"]),
        "cases": names,
        **{kind: outcomes.count(kind) for kind in OUTCOMES},
    }


def fingerprint(case: Case) -> str:
    """SHA-256 of the row and of all the code and scenes that make its result."""
    digest = hashlib.sha256(case.model_dump_json().encode())
    for package in ("lightloc", "render", "validation", "scenes"):
        root = Path(str(importlib.resources.files(package)))
        for file in sorted(root.rglob("*")):
            inside = file.relative_to(root)
            if file.suffix in (".py", ".xml", ".ply") and inside.parts[0] != "report":
                digest.update(str(inside).encode() + file.read_bytes())
    return digest.hexdigest()


def _kept(case: Case, out: Path) -> dict[str, Any] | None:
    try:
        result = json.loads((out / "cases" / case.name / "result.json").read_text())
    except (OSError, ValueError):
        return None
    return result if result.get("fingerprint") == fingerprint(case) else None


def _child(case: Case, out: Path, command: str) -> dict[str, Any]:
    folder = out / "cases" / case.name
    folder.mkdir(parents=True, exist_ok=True)
    environment = os.environ | dict.fromkeys(THREADS, "1")
    order = json.dumps({"case": case.model_dump(), "command": command})
    try:
        child = subprocess.run(
            [sys.executable, "-m", "validation.suite.case", str(folder)],
            input=order,
            capture_output=True,
            text=True,
            env=environment,
            timeout=TIMEOUT,
            check=False,
        )
        ended = f"the case's process ended with {child.returncode}"
        failed, errors = child.returncode != 0, child.stderr
    except subprocess.TimeoutExpired:
        ended, failed, errors = f"the case ran longer than {TIMEOUT:g} s", True, ""
    if not failed:
        return json.loads((folder / "result.json").read_text())
    crashed = {
        "schema": SCHEMA,
        **case.model_dump(
            include={"name", "scene", "claim", "brdf", "transport", "noise", "gated"}
        ),
        "alpha": case.alpha,
        "outcome": "crashed",
        "why": [ended, *errors.strip().splitlines()[-3:]],
        "command": command,
        "made": {"date": datetime.now(UTC).isoformat(timespec="seconds")},
    }
    write_json(folder / "result.json", crashed)
    return crashed
