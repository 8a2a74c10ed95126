"""A suite runs every case whatever becomes of the others, goes on where it stopped, and leaves
results that the report draws without a renderer."""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import render
from validation.jobs import every, write_json
from validation.jobs.code import needed
from validation.jobs.pool import _until_one_fails
from validation.suite import Cases, read_suite, run_case, run_cases
from validation.suite.cases import Case
from validation.suite.solve import answer

LIGHTLOC = Path(sys.executable).with_name("lightloc")
TRUE = {"position", "intensity"}
FOUND = {"position_error", "intensity_error", "bound", "resolution", "width"}

TINY = """
name = "tiny"
[defaults]
points = 512
brdf = "diffuse"
claim = "A small case."
position_percent = 0.1
intensity_percent = 0.5
[[case]]
name = "box"
scene = "box_one"
[[case]]
name = "gone"
scene = "no_such_scene"
[[case]]
name = "strict"
scene = "box_one"
noise = 0.05
position_percent = 1e-9
"""

KEYS = {
    *("schema", "name", "scene", "claim", "brdf", "alpha", "transport", "noise", "gated"),
    *("points", "spp", "seed", "parameters", "outcome", "why", "limits", "diagonal", "lights"),
    *("comparison", "rerender", "search", "seconds", "peak_mb", "command", "made"),
}
CRASHED = {
    *("schema", "name", "scene", "claim", "brdf", "alpha", "transport", "noise", "gated"),
    *("method", "outcome", "why", "command", "made"),
}


def quick_case(case: Case, folder: Path, command: str) -> dict[str, Any]:
    """Stands in for `run_case`: done at once, killed by a signal, or never done."""
    if case.name == "killed":
        os.kill(os.getpid(), signal.SIGSEGV)
    if case.name == "slow":
        time.sleep(60)
    result = {"outcome": "passed", "name": case.name}
    write_json(folder / "result.json", result)
    return result


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Any:
    """(process, folder) of a real run of three cases: one passes, one crashes, one fails."""
    out = tmp_path_factory.mktemp("tiny")
    (out / "tiny.toml").write_text(TINY)
    command = [LIGHTLOC, "validate", "--suite", "tiny.toml", "--out", "run", "--jobs", "2"]
    done = subprocess.run(command, cwd=out, capture_output=True, text=True, check=False)
    return done, out / "run"


def result(out: Path, name: str) -> dict[str, Any]:
    return json.loads((out / "cases" / name / "result.json").read_text())


def test_every_case_has_its_outcome(tiny):
    """One passes, one crashes, one fails: the run ends with 1 and names the last two."""
    done, out = tiny
    assert done.returncode == 1, done.stderr
    outcomes = {name: result(out, name)["outcome"] for name in ("box", "gone", "strict")}
    assert outcomes == {"box": "passed", "gone": "crashed", "strict": "failed"}
    assert "1 passed, 1 failed, 1 crashed, 0 shown" in done.stdout
    assert len(done.stderr.splitlines()) == 2
    assert "crashed gone: " in done.stderr
    assert "no_such_scene: no such scene file" in done.stderr
    assert "failed strict: The worst position is off by" in done.stderr
    assert not list(out.rglob("*.part"))


def test_summary_counts_the_run(tiny):
    """suite.json holds the cases in the suite's order and how many came out how."""
    summary = json.loads((tiny[1] / "suite.json").read_text())
    assert (summary["schema"], summary["suite"]) == (1, "tiny")
    assert summary["cases"] == ["box", "gone", "strict"]
    assert [summary[kind] for kind in ("passed", "failed", "crashed", "shown")] == [1, 1, 1, 0]
    assert summary["seconds"] > 0
    assert summary["peak_mb"] > 0
    assert summary["started"]


def test_result_holds_what_the_report_reads(tiny):
    """Every key of schema 1, with finite numbers of the right shapes, and the arrays beside it."""
    _, out = tiny
    assert set(result(out, "gone")) == CRASHED
    assert "no such scene file" in result(out, "gone")["why"][-1]
    for name in ("box", "strict"):
        r = result(out, name)
        assert set(r) >= KEYS
        assert r["command"] == f"lightloc validate --suite {out.parent / 'tiny.toml'} --case {name}"
        assert [set(light) for light in r["lights"]["true"]] == [TRUE]
        assert [set(light) for light in r["lights"]["found"]] == [TRUE | FOUND]
        assert r["comparison"]["pairs"][0]["found"] == 0
        assert len(r["comparison"]["pairs"][0]["intensity_percent"]) == 1
        assert r["comparison"]["worst_position_percent"] is not None
        assert set(r["rerender"]) == {"z_mean", "z_std", "relative_rms"}
        assert {"reason", "message", "history", "chi2_per_dof", "verdicts"} <= set(r["search"])
        assert {"step", "lights", "chi2", "detail"} <= set(r["search"]["history"][0])
        assert {"load", "observe", "localize", "judge", "total"} <= set(r["seconds"])
        assert {"date", "commit", "versions"} <= set(r["made"])
        assert set(r["made"]["versions"]) >= {"lightloc", "mitsuba", "drjit", "python"}
        arrays = {
            file: set(np.load(out / "cases" / name / f"{file}.npz"))
            for file in ("room", "fields", "view")
        }
        assert arrays["room"] >= {"vertices", "faces", "points", "radiance", "residual"}
        assert arrays["fields"] >= {"D", "L", "limiter", "V", "extent", "height"}
        assert arrays["view"] >= {"rendered", "rerendered"}
        assert (out / "cases" / name / "view.exr").stat().st_size


def test_report_needs_no_renderer(tiny, tmp_path):
    """The report is drawn from the files where neither Mitsuba nor Dr.Jit can be imported."""
    out = tmp_path / "run"
    shutil.copytree(tiny[1], out)
    blocked = (
        "import sys; sys.modules.update(mitsuba=None, drjit=None)\n"
        "from pathlib import Path\n"
        "from validation.report import write\n"
        "print(write(Path(sys.argv[1])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", blocked, str(out)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    page = out / "index.html"
    assert done.stdout.strip() == str(page)
    text = page.read_text()
    assert all(name in text for name in ("box", "gone", "strict"))


def rows(*names: str, **more: Any) -> list[Case]:
    common = {"scene": "box_one", "claim": "A small case.", "brdf": "diffuse"}
    limits = {"position_percent": 0.1, "intensity_percent": 0.5}
    return [Case(**{**common, **limits, **more, "name": name}) for name in names]


@pytest.fixture
def quick(tmp_path) -> Callable[..., tuple[dict[str, Any], dict[str, int]]]:
    """Run cases into tmp_path/run quickly; gives the summary and when each result was made."""
    out = tmp_path / "run"

    def go(cases: list[Case], again: bool = False) -> tuple[dict[str, Any], dict[str, int]]:
        summary = run_cases("quick", Cases(cases, out, "quick", quick_case), 2, again=again)
        files = {case.name: out / "cases" / case.name / "result.json" for case in cases}
        return summary, {name: file.stat().st_mtime_ns for name, file in files.items()}

    return go


def test_a_case_that_kills_its_process_fails_alone(quick, tmp_path):
    """Killed by a signal, a case has crashed, says so, and the others still run."""
    summary, _ = quick(rows("one", "killed", "two"))
    assert (summary["passed"], summary["crashed"]) == (2, 1)
    crashed = result(tmp_path / "run", "killed")
    assert set(crashed) == CRASHED
    assert crashed["why"] == ["its process died"]


def test_no_case_is_lost_where_a_process_dies_as_the_next_begins(monkeypatch):
    """The pool takes no more then: the next waits for another pool, and what ran is looked at."""

    class Pool:
        def __init__(self, *given: Any, **more: Any) -> None:
            self.taken = 0

        def submit(self, one: Any, name: str) -> Future[str]:
            self.taken += 1
            if self.taken > 1:
                raise BrokenExecutor
            return Future()

        def shutdown(self, **how: Any) -> None:
            pass

    monkeypatch.setattr("joblib.externals.loky.ProcessPoolExecutor", Pool)
    queue, failed = deque(["one", "two"]), []

    def ran() -> Any:
        failed.append((yield from _until_one_fails(str, queue, 2, 60.0)))

    assert list(ran()) == []
    assert failed[0].suspects == ["one"] and list(queue) == ["two"]


def test_a_case_that_hangs_is_ended(quick, monkeypatch, tmp_path):
    """A case that runs too long has crashed, and no other."""
    monkeypatch.setattr("validation.suite.run.LIMIT", 8.0)
    summary, _ = quick(rows("one", "slow", "two"))
    assert (summary["passed"], summary["crashed"]) == (2, 1)
    assert result(tmp_path / "run", "slow")["why"] == ["it ran longer than 8 s"]


def test_a_run_goes_on_where_it_stopped(quick, tmp_path):
    """Of a run that was cut short, only what is missing or broken is run again."""
    names = ("one", "two", "three")
    cases = rows(*names)
    _, first = quick(cases)
    assert quick(cases)[1] == first
    folder = tmp_path / "run" / "cases"
    (folder / "two" / "result.json").unlink()
    (folder / "three" / "result.json").write_text('{"outcome": "pas')
    summary, second = quick(cases)
    assert {name for name in names if second[name] != first[name]} == {"two", "three"}
    assert summary["passed"] == 3


def test_a_crashed_case_is_tried_again(quick):
    """What crashed is never kept: the next run tries it again."""
    _, first = quick(rows("killed"))
    summary, second = quick(rows("killed"))
    assert summary["crashed"] == 1
    assert second != first


def test_a_stale_result_is_made_again(quick, tmp_path):
    """A row that changed, or a result of other code, is run again, and no other."""
    _, first = quick(rows("one", "two"))
    _, second = quick(rows("one") + rows("two", seed=1))
    assert second["one"] == first["one"]
    assert second["two"] != first["two"]
    file = tmp_path / "run" / "scenes.jsonl"
    of = {ended.name: ended.fingerprint for ended in every(file.parent)}
    file.write_text(file.read_text().replace(of["one"], of["two"]))
    _, third = quick(rows("one") + rows("two", seed=1))
    assert third["one"] != second["one"]
    assert third["two"] == second["two"]


def test_a_row_taken_out_of_the_suite_is_forgotten(quick, tmp_path):
    """What an earlier run of other rows left in the folder is passed over; the rest is kept."""
    _, first = quick(rows("one", "two"))
    summary, second = quick(rows("two", "three"))
    assert summary["cases"] == ["two", "three"] and summary["passed"] == 2
    assert second["two"] == first["two"]


def test_standard_suite_is_complete():
    """Every standard scene, both transports, all three noises, 40 rows or more, no name twice."""
    name, cases = read_suite("standard")
    assert name == "standard"
    assert len(cases) >= 40
    names = [case.name for case in cases]
    assert len(set(names)) == len(names)
    assert {case.scene for case in cases} == set(render.standard_scenes())
    every = set(itertools.product(("direct", "full"), (0.0, 0.01, 0.05)))
    assert {(case.transport, case.noise) for case in cases} == every
    kinds = {case.brdf for case in cases}
    assert kinds >= {"diffuse", "conductor", "plastic", "mixed", "rough diffuse", "measured"}
    assert len(kinds) >= 13
    assert sum(case.gated for case in cases) >= 40
    assert all(case.claim.endswith(".") for case in cases)
    seeds = [case.seed for case in cases]
    assert len(set(seeds)) == len(seeds)


def test_standard_rows_load(load):
    """Each row's scene and parameters load, and its lights lie inside the room."""
    for case in read_suite("standard")[1]:
        room = load(case.scene, **case.parameters)
        lights = np.array(case.lights)[:, :3] if case.lights else room.lights.positions
        lower, upper = room.bounds
        assert ((lights > lower) & (lights < upper)).all(), case.name


def test_one_case_again_keeps_the_others(quick, tmp_path):
    """A case repeated by name runs though nothing changed, and the run's other cases stay."""
    _, before = quick(rows("a", "b"))
    summary, after = quick(rows("a"), again=True)
    assert summary["passed"] == 1
    assert after["a"] > before["a"]
    listed = json.loads((tmp_path / "run" / "suite.json").read_text())
    assert (listed["cases"], listed["passed"]) == (["a", "b"], 2)


def test_a_scene_of_ones_own_is_followed_to_its_files(quick, tmp_path):
    """A mesh that was edited makes the cases of its scene anew, and no others."""
    scene = tmp_path / "mine.xml"
    scenes = Path(render.__file__).parents[1] / "scenes"
    scene.write_text((scenes / "furnished.xml").read_text())
    shutil.copytree(scenes / "meshes", tmp_path / "meshes")
    cases = rows("one") + rows("mine", scene=str(scene))
    _, first = quick(cases)
    assert quick(cases)[1] == first
    with (tmp_path / "meshes" / "vase.ply").open("ab") as mesh:
        mesh.write(b"\n")
    _, second = quick(cases)
    assert {name for name in first if second[name] != first[name]} == {"mine"}


def test_what_only_draws_makes_no_case_anew():
    """The code of a case holds the judge and the renderer, not the report, figures or studies."""
    made = set(needed(run_case.__module__))
    assert {"validation.judge.match", "render.observe", "validation.suite.pictures"} < made
    assert not [name for name in made if re.match(r"validation\.(report|figures|studies)", name)]


def test_ctrl_c_says_how_to_go_on(tmp_path):
    """One sentence and the shell's code for it; the same command then does what is left."""
    (tmp_path / "tiny.toml").write_text(TINY)
    command = [LIGHTLOC, "validate", "--suite", "tiny.toml", "--out", "run", "--jobs", "1"]
    with subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        while not (tmp_path / "run" / "cases" / "box").exists() and process.poll() is None:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, ""), err
    (line,) = err.splitlines()
    assert re.fullmatch(r"lightloc: stopped with \d of 3 cases; the same command .*", line)


@pytest.mark.parametrize(("method", "reason"), [("search", "OUT_OF_TIME"), ("paper", None)])
def test_a_row_s_seconds_are_a_budget_for_the_search_alone(method, reason):
    """The published method has none, and takes its time; a row without them has none either."""
    short, free = rows("short", method=method, seconds=1e-3) + rows("free")
    room = render.load("box_one")
    seen = render.observe(room, points=400, transport="direct", noise=0.01)
    given = answer(short, seen, room, print)
    assert not given.why
    assert (given.found.reason.name == "OUT_OF_TIME") == (reason is not None)
    assert answer(free, seen, room, print).found.reason.name == "CONVERGED"


def test_the_published_method_is_asked_what_it_can_do():
    """It gathers where a row would render, and of three channels it says that it takes one."""
    room = render.load("box_one")
    seen = render.observe(room, points=400, spp=16)
    (row,) = rows("rendered", method="paper", transport="full", rendered=16)
    assert not answer(row, seen, room, print).why
    (row,) = rows("colours", method="paper", scene="box_colored")
    room = render.load("box_colored")
    colours = render.observe(room, points=100, transport="direct")
    given = answer(row, colours, room, print)
    assert given.why.startswith("The published method failed: method 'paper' takes one channel")
    assert not len(given.found.lights)


def test_a_wrong_key_among_the_defaults_is_named_as_theirs(tmp_path, refuses):
    file = tmp_path / "s.toml"
    file.write_text('[defaults]\npionts = 3\n[[case]]\nname = "a"\n')
    with refuses(f"{file}: [defaults]: there is no key 'pionts'; did you mean points?"):
        read_suite(file)


def test_a_packaged_suite_s_case_is_repeated_by_the_suite_s_name(tmp_path):
    cases = Cases(rows("one"), tmp_path, "quick", quick_case)
    assert cases.command("one") == "lightloc validate --suite quick --case one"
