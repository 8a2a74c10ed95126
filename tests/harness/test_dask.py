"""Table 1 on a real Dask cluster: a scheduler and two worker processes on loopback, started with
Dask's own commands, in folders that are not the repository's."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from test_table1 import Record, fine, names, record

import validation.jobs.cluster
from validation.jobs.pool import DIED, run
from validation.jobs.store import read

DASK = Path(sys.executable).with_name("dask")
LIGHTLOC = Path(sys.executable).with_name("lightloc")
HERE = str(Path(__file__).parent)  # where the workers find this file's scenes
START_SECONDS = 60
HASTE = 0.5
BACKENDS = {"llvm": "cuda", "cuda": "llvm"}


def troubled(name: str) -> Record:
    if name.endswith("001"):
        raise FloatingPointError("singular")
    return fine(name)


def deadly(name: str) -> Record:
    """One scene kills every worker that it is given to."""
    if name.endswith("002"):
        os._exit(1)
    return fine(name)


def where(name: str) -> Record:
    """Say which process ran a scene; long enough for both to get some, and alone or not at all."""
    running = Path(f"{os.getpid()}.running")
    running.touch(exist_ok=False)  # fails where a second scene runs in this process
    time.sleep(0.2)
    running.unlink()
    return record(name, reason=str(os.getpid()))


def endless(name: str) -> Record:
    """Scene 0 ends at once; the others first tell who runs them, and end when they are let."""
    if not name.endswith("000"):
        Path(os.environ["TOLD"], f"{name}.{os.getpid()}").touch()
        while not Path(os.environ["TOLD"], "go").exists():
            time.sleep(0.05)
    return fine(name)


@contextmanager
def started(*arguments: str, cwd: Path, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    log = (cwd / f"{arguments[0]}-{time.monotonic_ns()}.log").open("wb")
    with (
        log,
        subprocess.Popen(
            [DASK, *arguments],
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": HERE, **environment},
            stdout=log,
            stderr=subprocess.STDOUT,
        ) as process,
    ):
        try:
            yield process
        finally:
            process.kill()


def wait_for(what: Callable[[], Any], seconds: float = START_SECONDS) -> Any:
    end = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < end
        time.sleep(0.05)
    return found


@contextmanager
def scheduler(folder: Path, **environment: str) -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    with started(
        *("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"),
        cwd=folder,
        **environment,
    ):
        wait_for(lambda: listening(port))
        yield address


def listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def worker(address: str, folder: Path, *more: str, **environment: str) -> Any:
    own = ("worker", address, "--no-dashboard", "--local-directory", str(folder), *more)
    return started(*own, cwd=folder, **environment)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[str]:
    """The address of a scheduler with two workers, each with a nanny and two threads.

    It gives a scene up when two workers have died of it, not four, so that the tests are quick.
    """
    folder = tmp_path_factory.mktemp("cluster")
    with ExitStack() as stack:
        patient = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
        address = stack.enter_context(scheduler(folder, **patient))
        for _ in range(2):
            stack.enter_context(worker(address, folder, "--nthreads", "2"))
        wait_for_workers(address, 2)
        yield address


def wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=START_SECONDS)


def same(first: Path, second: Path) -> None:
    """Two folders hold the same scenes, but for what a clock said."""

    def results(out: Path) -> dict[str, Any]:
        return {name: (scene.record, scene.error) for name, scene in read(out).items()}

    assert results(first) == results(second)
    assert results(first)


def test_a_cluster_gives_what_this_machine_gives(cluster, tmp_path):
    """The same records, and the same words of a scene that raised."""
    run(troubled, names(6), tmp_path / "here", jobs=2)
    watched: list[Any] = []
    run(troubled, names(6), tmp_path / "there", dask=cluster, watch=watched.append)
    same(tmp_path / "here", tmp_path / "there")
    assert len(watched) == 6
    assert read(tmp_path / "there")["noisy-2-001"].error.startswith("FloatingPointError: singular")


def test_both_workers_work_one_scene_at_a_time(cluster, tmp_path):
    """Each worker has two threads and runs one scene at once, or runtimes would mean nothing."""
    run(where, names(12), tmp_path, dask=cluster)
    found = read(tmp_path).values()
    assert not [scene.error for scene in found if scene.error]
    assert len({scene.record["reason"] for scene in found if scene.record}) == 2


def test_a_scene_that_kills_its_workers_fails_alone(cluster, tmp_path):
    """Dask gives it to worker after worker, restarts them, and in the end it has crashed."""
    run(deadly, names(5), tmp_path, dask=cluster)
    found = read(tmp_path)
    assert sorted(found) == names(5)
    assert {name: scene.error for name, scene in found.items() if scene.error} == {
        "noisy-2-002": DIED
    }


def test_a_worker_that_dies_does_not_lose_the_run(tmp_path):
    """Of two workers one is killed in the middle of a scene: the other runs it again."""
    import threading

    folder, told = tmp_path / "cluster", tmp_path / "told"
    folder.mkdir()
    told.mkdir()
    with ExitStack() as stack:
        address = stack.enter_context(scheduler(folder))
        for _ in range(2):
            stack.enter_context(worker(address, folder, "--no-nanny", TOLD=str(told)))
        wait_for_workers(address, 2)
        out = tmp_path / "run"
        thread = threading.Thread(
            target=run, args=(endless, names(6), out), kwargs={"dask": address}
        )
        thread.start()

        def busy() -> set[str]:
            return {path.suffix[1:] for path in told.iterdir()}

        wait_for(lambda: len(busy()) == 2)
        os.kill(int(min(busy())), 9)
        time.sleep(0.5)
        (told / "go").touch()
        thread.join(timeout=START_SECONDS)
        assert not thread.is_alive()
    found = read(out)
    assert sorted(found) == names(6)
    assert not [scene.error for scene in found.values() if scene.error]


def test_a_scheduler_that_goes_away_is_said_and_what_ended_is_kept(tmp_path):
    """Killed in the middle of the run: one sentence within seconds, and scene 0 is there."""
    folder, told = tmp_path / "cluster", tmp_path / "told"
    folder.mkdir()
    told.mkdir()
    with ExitStack() as outer, ExitStack() as stack:
        address = stack.enter_context(scheduler(folder))
        outer.enter_context(worker(address, folder, "--no-nanny", TOLD=str(told)))
        wait_for_workers(address, 1)
        with pytest.raises(RuntimeError, match="the scheduler went away"):
            run(endless, names(3), tmp_path, dask=address, watch=lambda _: stack.close())
    assert sorted(read(tmp_path)) == names(1)


def test_a_worker_with_other_code_is_refused(tmp_path, refuses):
    """Here one that would run on another backend: its results would not be comparable."""
    backend = BACKENDS[os.environ.get("LIGHTLOC_BACKEND", "llvm")]
    with scheduler(tmp_path) as address, worker(address, tmp_path, LIGHTLOC_BACKEND=backend):
        wait_for_workers(address, 1)
        with refuses(f"--dask {address}: the worker ") as error:
            run(fine, names(2), tmp_path / "run", dask=address)
    assert "another version" in str(error.value)
    assert not (tmp_path / "run").exists()


@pytest.fixture
def hasty(monkeypatch) -> None:
    """Half a second and not five, for an answer that can't come."""
    monkeypatch.setattr(validation.jobs.cluster, "CONNECT_SECONDS", HASTE)


NOBODY = "tcp://127.0.0.1:1"  # a port that nothing listens on


@pytest.mark.parametrize(
    "address", [NOBODY, "127.0.0.1:1", "tcp://no.such.host.invalid:1", "", "a"]
)
def test_an_address_without_a_scheduler_is_refused(address, tmp_path, refuses, hasty):
    """Nobody listens, no such host, no address at all: a sentence in seconds, and no folder."""
    start = time.monotonic()
    with refuses(f"--dask {address}: no scheduler answers there"):
        run(fine, names(2), tmp_path / "run", dask=address)
    assert time.monotonic() - start < 2 * HASTE + 2
    assert not (tmp_path / "run").exists()


def test_a_worker_is_no_scheduler(cluster, tmp_path, refuses):
    """The address of a worker, which is easily taken for the scheduler's."""
    from distributed import Client

    with Client(cluster, set_as_default=False) as client:
        address = min(client.run(lambda: None))
    with refuses(f"--dask {address}: no scheduler answers there"):
        run(fine, names(2), tmp_path, dask=address)


def test_a_deaf_server_is_refused(tmp_path, refuses, hasty):
    """Something accepts the connection and never speaks."""
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        with refuses(f"--dask {address}: no scheduler answers there"):
            run(fine, names(2), tmp_path, dask=address)


def test_a_scheduler_without_workers_is_refused(tmp_path, refuses, monkeypatch):
    """A run would wait for ever; here it doesn't wait long for a first worker."""
    monkeypatch.setattr(validation.jobs.cluster, "WORKER_SECONDS", 0.5)
    with scheduler(tmp_path) as address, refuses(f"--dask {address}: the scheduler has no worker"):
        run(fine, names(2), tmp_path, dask=address)


def test_the_command_says_it_in_one_sentence(tmp_path):
    """Exit code 2 and nothing else on the terminal, whatever Dask's own threads have to say."""
    done = subprocess.run(
        [LIGHTLOC, "study", "table1", "--dask", NOBODY, "-o", "run"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert line == f"lightloc: --dask {NOBODY}: no scheduler answers there"
    assert not list(tmp_path.iterdir())


def table1(cwd: Path, *more: str) -> str:
    """Run two scenes of the real table with the command; what it printed."""
    rows = ("--row", "noiseless-2", "--row", "noisy-2")
    done = subprocess.run(
        [LIGHTLOC, "study", "table1", "--scenes", "1", *rows, *more],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_the_real_table_is_the_same_on_a_cluster(cluster, tmp_path):
    """The paper's method on two rooms: equal in all but the clock, here and on the workers.

    Asked again, the command runs nothing: not a byte is appended.
    """
    said = table1(tmp_path, "-o", "here", "--jobs", "2")
    assert "noisy, 2" in said and "(0.80)" in said and "noisy, 5" not in said
    table1(tmp_path, "-o", "there", "--dask", cluster)
    both = [
        json.loads((tmp_path / out / "table1" / "study.json").read_text())
        for out in ("here", "there")
    ]
    here, there = ([untimed(scene["record"]) for scene in one["scenes"]] for one in both)
    assert [scene["name"] for scene in here] == ["noiseless-2-000", "noisy-2-000"]
    assert here == there
    kept = tmp_path / "there" / "table1" / "scenes.jsonl"
    lines = kept.read_bytes()
    table1(tmp_path, "-o", "there", "--dask", NOBODY)
    assert kept.read_bytes() == lines


def untimed(found: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in found.items() if not key.endswith("seconds")}


def test_without_dask_the_option_says_what_to_install(tmp_path):
    """Dask is an extra: nothing but --dask needs it."""
    code = (
        "import sys; sys.modules['distributed'] = None\n"
        "from pathlib import Path\n"
        "from test_table1 import fine, names, read, run\n"
        "run(fine, names(1), Path('run'), jobs=1); print(len(read(Path('run'))))\n"
        "try: run(fine, names(2), Path('run'), dask='tcp://127.0.0.1:1')\n"
        "except ImportError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": HERE},
        capture_output=True,
        text=True,
    )
    assert done.stdout.splitlines() == [
        "1",
        "--dask needs Dask: pip install 'lightloc[cluster]'",
    ], done.stderr
