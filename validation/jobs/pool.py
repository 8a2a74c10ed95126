"""Run scenes on all cores, or on a cluster, and keep each as it ends."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, wait
from contextlib import AbstractContextManager, closing, contextmanager
from pathlib import Path
from typing import Any

from validation.jobs.code import fingerprint
from validation.jobs.one import DIED, Each, one
from validation.jobs.store import Ended, Scene, appending, waiting

# Scenes are run side by side, so that each may have one thread and its runtime means something.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"
)
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


def _pool(scene: Scene, jobs: int, dask: str | None) -> AbstractContextManager[Each]:
    if dask is None:
        return _local(scene, jobs)
    from validation.jobs.cluster import cluster

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
