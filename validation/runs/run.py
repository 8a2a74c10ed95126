"""Run scenes on all cores, or on a cluster, and keep each as it ends."""

from __future__ import annotations

import json
import math
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, wait
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.runs.fingerprint import fingerprint
from validation.runs.kept import Ended, Scene, appending, waiting

Each = Callable[[Sequence[str]], Generator[Ended, None, Any]]

# Scenes are run side by side, so that each may have one thread and its runtime means something.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)
ONE_AT_A_TIME = threading.Lock()  # in a Dask worker with several threads
DIED = "its process died"
PARENT_SECONDS = 1.0  # how often a worker looks whether its parent is still there


def run(
    scene: Scene,
    names: Sequence[str],
    out: Path,
    *,
    jobs: int = 0,
    dask: str | None = None,
    watch: Callable[[Ended], None] = lambda ended: None,
) -> None:
    """Run the scenes that OUT/scenes.jsonl has no result of, and append each as it ends.

    ``jobs`` at a time, 0 for one a core, or on the Dask cluster at the address ``dask``. A scene
    that raises, or whose process dies, has crashed and stops no other.

    Raises:
        ValueError: the address doesn't answer, a worker runs other code, or another run is
            writing to OUT.
        RuntimeError: the cluster went away; what had ended is kept.
    """
    left = waiting(names, out, scene)
    if not left:
        return
    with _pool(scene, jobs, dask) as each, appending(out) as keep, closing(each(left)) as ends:
        for ended in ends:
            if ended.fingerprint != fingerprint(scene):
                where = f"--dask {dask}: a worker runs" if dask else "there is now"
                raise ValueError(f"{where} other code than this run began with; start it again")
            keep(ended)
            watch(ended)


def one(scene: Scene, name: str) -> Ended:
    """Run one scene in this process, with one thread. Never raises for what the scene does."""
    with ONE_AT_A_TIME:
        start, record, said = time.perf_counter(), None, ""
        try:
            _use_one_thread()
            record = {key: _plain(value) for key, value in asdict(scene(name)).items()}
            json.dumps(record, allow_nan=False)  # else it could not be kept
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            text = " ".join(str(error).split())
            place = f"{Path(last.filename).name}, line {last.lineno}"
            record, said = None, f"{type(error).__name__}: {text} ({place})"
        return Ended(name, fingerprint(scene), round(time.perf_counter() - start, 3), record, said)


def _use_one_thread() -> None:
    import lightloc  # noqa: F401  (before drjit: it chooses the LLVM library)

    import drjit  # isort: skip

    drjit.set_thread_count(1)


def _plain(value: Any) -> Any:
    """A NumPy scalar as Python's own, and None for a number that JSON does not have."""
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _pool(scene: Scene, jobs: int, dask: str | None) -> AbstractContextManager[Each]:
    if dask is None:
        return _local(scene, jobs)
    from validation.runs.cluster import cluster

    return cluster(dask, scene)


@contextmanager
def _local(scene: Scene, jobs: int) -> Iterator[Each]:
    from joblib import cpu_count

    many = jobs or cpu_count()

    def each(names: Sequence[str]) -> Generator[Ended, None, None]:
        queue = deque(names)
        while queue:
            for name in (yield from _until_one_dies(scene, queue, many)):
                # One of these killed its process; alone in a pool, it shows which.
                if (yield from _until_one_dies(scene, deque([name]), 1)):
                    yield Ended(name, fingerprint(scene), 0.0, None, DIED)

    yield each


def _until_one_dies(
    scene: Scene, queue: deque[str], jobs: int
) -> Generator[Ended, None, list[str]]:
    """Run from the queue until it is empty; return the scenes that ran when a process died."""
    from joblib.externals.loky import ProcessPoolExecutor

    pool = ProcessPoolExecutor(jobs, initializer=_belong_to_the_run, env=ONE_THREAD)
    running: list[str] = []
    futures: set[Any] = set()
    try:
        while queue or futures:
            while queue and len(futures) < jobs:
                running.append(queue.popleft())
                futures.add(pool.submit(one, scene, running[-1]))
            done, futures = wait(futures, return_when=FIRST_COMPLETED)
            for future in done:
                ended = future.result()
                running.remove(ended.name)
                yield ended
    except BrokenExecutor:
        return running
    finally:
        pool.shutdown(wait=True, kill_workers=True)
    return []


def _belong_to_the_run() -> None:
    """Leave Ctrl-C to the parent, and end when it does: a kill gives it no time to end us."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_SECONDS)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
