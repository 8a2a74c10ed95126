"""Table 1's run: every scene ends once, whatever becomes of the others, killed or not."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from validation.cli import app
from validation.commands.study import find
from validation.jobs.code import fingerprint, needed
from validation.jobs.pool import DIED, ONE_THREAD, one, run
from validation.jobs.store import FILE, Ended, read, waiting

LIGHTLOC = Path(sys.executable).with_name("lightloc")
SLOW = 60.0  # seconds: longer than any wait here, so that only a kill ends it


@dataclass(frozen=True)
class Record:
    """The fields of the real one, in short."""

    name: str
    lights: int
    random: float
    votes: bool
    full: bool
    solved: bool
    oracle: bool
    seconds: float
    ours_full: bool
    ours_solved: bool
    ours_seconds: float
    count_found: int
    mse: float
    mse_truth: float
    reason: str


def record(name: str, solved: bool = True, **changes: Any) -> Record:
    lights = int(name.split("-")[1])
    values = {
        **{"name": name, "lights": lights, "random": 0.5, "full": True, "solved": solved},
        **{"votes": False, "oracle": True, "ours_full": True, "ours_solved": True},
        **{"seconds": 0.5, "ours_seconds": 0.25, "count_found": lights},
        **{"mse": 1e-3, "mse_truth": 2e-3},
        "reason": "converged",
    }
    return Record(**{**values, **changes})


def fine(name: str) -> Record:
    return record(name, seconds=int(name[-3:]) / 10)


def troubled(name: str) -> Record:
    """One scene raises, one kills its process; the others are fine."""
    if name.endswith("001"):
        raise FloatingPointError("the matrix\nis singular")
    if name.endswith("003"):
        os.kill(os.getpid(), signal.SIGKILL)
    return fine(name)


def forgetful(name: str) -> Record:
    """Fine only where a file beside the run says so: a run that is tried again."""
    if name.endswith("001") and not Path(os.environ["MENDED"]).exists():
        raise ValueError("not yet")
    return fine(name)


def threads(name: str) -> Record:
    """How many threads BLAS and Dr.Jit have in a worker, as the count found and the reason."""
    import drjit

    set_to = {os.environ.get(variable, "unset") for variable in ONE_THREAD}
    return record(name, count_found=drjit.thread_count(), reason=",".join(set_to))


def never(name: str) -> Record:
    time.sleep(0.01 if name.endswith("000") else SLOW)
    return fine(name)


def names(count: int, *rows: str) -> list[str]:
    return [f"{row}-{i:03d}" for row in rows or ("noisy-2",) for i in range(count)]


def kept(out: Path) -> list[dict[str, Any]]:
    file = out / FILE
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def test_every_scene_ends_and_trouble_stays_where_it_was(tmp_path):
    """One raises and one dies by SIGKILL: both have crashed, say of what, and the rest is fine."""
    watched: list[Ended] = []
    run(troubled, names(6), tmp_path, jobs=2, watch=watched.append)
    found = read(tmp_path)
    assert sorted(found) == names(6) == sorted(scene.name for scene in watched)
    crashed = {name: scene.error for name, scene in found.items() if scene.record is None}
    assert set(crashed) == {"noisy-2-001", "noisy-2-003"}
    said = crashed["noisy-2-001"]
    assert said.startswith("FloatingPointError: the matrix is singular (test_table1.py, line")
    assert crashed["noisy-2-003"] == DIED
    assert found["noisy-2-005"].record == asdict(fine("noisy-2-005"))


def test_a_worker_has_one_thread(tmp_path):
    """Runtimes are of one thread: BLAS is told so before it loads, Dr.Jit before each scene.

    The control: this process is not told.
    """
    run(threads, names(1), tmp_path, jobs=1)
    found = read(tmp_path)["noisy-2-000"].record
    assert found is not None
    assert (found["count_found"], found["reason"]) == (1, "1")
    assert any(os.environ.get(name) != "1" for name in ONE_THREAD) or os.cpu_count() == 1


def test_a_run_goes_on_where_it_stopped(tmp_path):
    """What is there is not run again; what is missing, torn or of other code is."""
    run(fine, names(4), tmp_path, jobs=2)
    lines = (tmp_path / FILE).read_text().splitlines()
    lines[1] = lines[1].replace(fingerprint(), "0" * 64)  # of other code
    (tmp_path / FILE).write_text("\n".join([*lines[:3], "null", "[]", lines[3][:40]]))
    missing = {json.loads(lines[1])["name"], json.loads(lines[3])["name"]}
    assert set(waiting(names(4), tmp_path)) == missing
    again: list[Ended] = []
    run(fine, names(4), tmp_path, jobs=2, watch=again.append)
    assert {scene.name for scene in again} == missing
    assert sorted(read(tmp_path)) == names(4)
    run(fine, names(4), tmp_path, watch=lambda scene: pytest.fail(f"{scene.name} ran again"))


def test_a_crashed_scene_is_tried_again(tmp_path, monkeypatch):
    """What crashed is kept for the table, and run anew by the next run; its last line counts."""
    monkeypatch.setenv("MENDED", str(tmp_path / "mended"))
    run(forgetful, names(3), tmp_path, jobs=1)
    assert waiting(names(3), tmp_path) == ["noisy-2-001"]
    (tmp_path / "mended").touch()
    run(forgetful, names(3), tmp_path, jobs=1)
    assert not waiting(names(3), tmp_path)
    assert len(kept(tmp_path)) == 4


def child(out: Path) -> subprocess.Popen[str]:
    """A run of two scenes in a process of its own, of which the second never ends."""
    code = "import test_table1 as t; from pathlib import Path; import sys\n"
    code += "t.run(t.never, t.names(2), Path(sys.argv[1]), jobs=2)"
    here = str(Path(__file__).parent)
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(out)],
        env={**os.environ, "PYTHONPATH": here},
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not kept(out):
        assert process.poll() is None and time.monotonic() < deadline, process.communicate()
        time.sleep(0.05)
    return process


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_killed_at_any_instant_nothing_is_lost_and_no_process_stays(how, tmp_path):
    """After Ctrl-C or a kill the ended scene is there and the workers are gone, in seconds."""
    import psutil

    process = child(tmp_path)
    workers = psutil.Process(process.pid).children(recursive=True)
    assert workers
    process.send_signal(how)
    process.communicate(timeout=20)
    _, alive = psutil.wait_procs(workers, timeout=20)
    assert not alive
    assert [scene["name"] for scene in kept(tmp_path)] == names(1)


def test_two_runs_in_one_folder_are_refused(tmp_path, refuses):
    """The second says so and the first goes on."""
    process = child(tmp_path)
    try:
        with refuses(str(tmp_path / FILE)) as error:
            run(fine, names(3), tmp_path, jobs=1)
        assert "another run" in str(error.value)
        assert process.poll() is None
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)


def test_code_that_changes_under_a_run_ends_it(tmp_path, monkeypatch):
    """A worker that started after an edit has other code: its scene is not kept as this run's."""
    monkeypatch.setattr("validation.jobs.pool.fingerprint", lambda *of: "of before the edit")
    with pytest.raises(ValueError, match="other code"):
        run(fine, names(2), tmp_path, jobs=1)
    assert not kept(tmp_path)


def test_numbers_that_json_lacks_are_none(tmp_path):
    """NaN and infinity are kept as nothing; a field that no JSON can hold crashes its scene."""
    import numpy as np

    odd = one(lambda name: record(name, mse=float("nan"), seconds=np.float32("inf")), "noisy-2-000")
    assert odd.record is not None and odd.record["mse"] is odd.record["seconds"] is None
    assert one(lambda name: record(name, solved=np.True_), "noisy-2-000").record["solved"] is True
    assert one(lambda name: record(name, reason=object()), "noisy-2-000").error.startswith("Type")
    assert one(lambda name: 3, "noisy-2-000").error.startswith("TypeError")


def test_fingerprint_is_of_what_makes_a_record():
    """The judge, the rooms and the columns count, those that only run and show do not."""
    from validation.studies import columns

    assert {"validation.judge.match", "validation.rooms.plane"} < set(needed(columns.__name__))
    shown = ("cli", "suite.cases", "jobs.pool", "studies.table1", "report.studies")
    assert not {f"validation.{name}" for name in shown} & set(needed(columns.__name__))
    assert len({fingerprint(), fingerprint(fine), fingerprint(columns.scene)}) == 2


def test_a_crashed_scene_makes_exit_code_1(tmp_path, monkeypatch):
    """The command says which, goes on, writes everything; and 0 once the scene has come through."""
    forgets = replace(find("table1"), one=forgetful)
    monkeypatch.setattr("validation.commands.study.find", lambda name: forgets)
    monkeypatch.setenv("MENDED", str(tmp_path / "mended"))
    out = tmp_path / "run"
    own = ("--row", "noisy-2", "--jobs", "1", "-o", str(out))
    command = ["study", "table1", "--scenes", "3", *own]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 1, done.output
    assert "crashed noisy-2-001: ValueError: not yet" in done.stderr
    assert "1 of 3 scenes crashed. 3 of 24 scenes have been run." in done.stdout
    assert sorted(path.name for path in (out / "table1").iterdir()) == [
        *("index.html", "scenes.jsonl", "study.json", "study.md")
    ]
    (tmp_path / "mended").touch()
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "scenes crashed" not in done.output


def test_ctrl_c_says_how_to_go_on(tmp_path):
    """At a terminal Ctrl-C reaches the workers too: one sentence and the shell's code for it."""
    with subprocess.Popen(
        [LIGHTLOC, "study", "table1", "--row", "noiseless-2", "-o", "run", "--jobs", "2"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        while not kept(tmp_path / "run" / "table1") and process.poll() is None:
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (130, ""), err
    (line,) = err.splitlines()
    assert re.fullmatch(r"lightloc: stopped with \d+ of 100 scenes; the same command .*", line)


BAD = {
    "unknown row": (("--row", "noisy-9"), "noisy-9", "noiseless-2"),
    "jobs": (("--jobs", "-1"), "--jobs", "0"),
    "scenes": (("--scenes", "0"), "--scenes", "1"),
    "under a file": (("-o", "file/run"), "file/run", "written"),
    "folder is a file": (("-o", "file"), "file", "written"),
    "under /proc": (("-o", "/proc/x"), "/proc/x", "written"),
    "jobs of a cluster": (("--jobs", "2", "--dask", "tcp://127.0.0.1:1"), "--jobs 2", "--dask"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_before_any_work(case, tmp_path):
    """Exit code 2, one sentence that names it, and nothing written."""
    arguments, *said = BAD[case]
    (tmp_path / "file").write_text("a file")
    done = subprocess.run(
        [LIGHTLOC, "study", "table1", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("lightloc: ") and all(words in line for words in said), line
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
