"""Run scenes on all cores, or on a cluster, and keep each as it ends."""

from __future__ import annotations

import math
import os
import signal
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, wait
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from validation.jobs.code import fingerprint
from validation.jobs.one import DIED, Each, one
from validation.jobs.store import Ended, Scene, appending, waiting

# Scenes are run side by side, so that each may have one thread and its runtime means something.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")
# A worker starts in the user's folder, and must not import what lies there.
WORKER = {**dict.fromkeys(ONE_THREAD, "1"), "PYTHONSAFEPATH": "1"}
PARENT_SECONDS = 1.0  # how often a worker looks whether its parent is still there


def run(
    scene: Scene,
    names: Sequence[str],
    out: Path,
    *,
    jobs: int = 0,
    threads: int = 1,
    limit: float = math.inf,
    again: bool = False,
    dask: str | None = None,
    watch: Callable[[Ended], None] = lambda ended: None,
) -> None:
    """Run the scenes that OUT/scenes.jsonl has no result of, and append each as it ends.

    A scene that raises, whose process dies, or that runs for too long has crashed and stops no
    other.

    Parameters
    ----------
    scene
        Runs a scene.
    names
        Those to run.
    out
        The folder OUT.
    jobs
        Scenes at a time, 0 for one per core; not on a cluster.
    threads
        Of each scene's kernels; one on a cluster.
    limit
        Seconds that a scene may run; not on a cluster.
    again
        Whether scenes that have a result are run, too.
    dask
        The address of a Dask cluster to run on.
    watch
        Is told each scene that has ended.

    Raises
    ------
    ValueError
        If the address doesn't answer, a worker runs other code, or another run is writing to OUT.
    RuntimeError
        If the cluster went away; what had ended is kept.
    """
    left = list(names) if again else waiting(names, out, scene)
    if not left:
        return
    pool = _local(scene, jobs, threads, limit) if dask is None else _remote(scene, dask)
    with pool as each, appending(out) as keep, closing(each(left)) as ends:
        for ended in ends:
            if ended.fingerprint != fingerprint(scene, ended.name):
                where = f"--dask {dask}: a worker runs" if dask else "there is now"
                raise ValueError(f"{where} other code than this run began with; start it again")
            keep(ended)
            watch(ended)


def _remote(scene: Scene, dask: str) -> AbstractContextManager[Each]:
    from validation.jobs.cluster import cluster

    return cluster(dask, scene)


@contextmanager
def _local(scene: Scene, jobs: int, threads: int, limit: float) -> Iterator[Each]:
    # where /dev/shm can't be written to, we say so in a sentence
    warnings.filterwarnings("ignore", ".*joblib will operate in serial mode", UserWarning)
    from joblib import cpu_count

    run_one = partial(one, scene, threads=threads)

    def crashed(name: str, seconds: float, said: str) -> Ended:
        return Ended(name, fingerprint(scene, name), seconds, None, said)

    def each(names: Sequence[str]) -> Generator[Ended, None, None]:
        queue = deque(names)
        while queue:
            ran = yield from _until_one_fails(run_one, queue, jobs or cpu_count(), limit)
            long = list(ran.long)
            for name in ran.suspects:
                # One of these killed its process; alone in a pool, it shows which.
                alone = yield from _until_one_fails(run_one, deque([name]), 1, limit)
                long += alone.long
                if alone.suspects:
                    yield crashed(name, 0.0, DIED)
            for name in long:
                yield crashed(name, limit, f"it ran longer than {limit:g} s")

    yield each


@dataclass(frozen=True)
class _Failed:
    """The scenes that ran too long, and those that ran when a process died."""

    long: Sequence[str] = ()
    suspects: Sequence[str] = ()


def _until_one_fails(
    run_one: Callable[[str], Ended], queue: deque[str], jobs: int, limit: float
) -> Generator[Ended, None, _Failed]:
    """Run from the queue until it is empty, or a scene must be ended together with the pool."""
    from joblib.externals.loky import ProcessPoolExecutor

    # loky replaces workers that have grown, between two scenes: nothing is lost
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
    try:
        pool = ProcessPoolExecutor(jobs, initializer=_belong_to_the_run, env=WORKER)
    except OSError as error:
        raise RuntimeError(f"/dev/shm: no processes can share it ({error.strerror})") from None
    running: dict[Any, tuple[str, float]] = {}  # a future: its scene, and when it must have ended
    try:
        while queue or running:
            while queue and len(running) < jobs:
                name = queue[0]  # it stays there if a process dies now
                running[pool.submit(run_one, name)] = (name, time.monotonic() + limit)
                queue.popleft()
            first = min(end for _, end in running.values()) - time.monotonic()
            done, _ = wait(running, None if math.isinf(limit) else first, FIRST_COMPLETED)
            if not done:
                now = time.monotonic()
                queue.extendleft(name for name, end in running.values() if end > now)
                return _Failed(long=[name for name, end in running.values() if end <= now])
            for future in done:
                ended = future.result()
                del running[future]
                yield ended
    except BrokenExecutor:
        return _Failed(suspects=[name for name, _ in running.values()])
    finally:
        pool.shutdown(wait=True, kill_workers=True)
    return _Failed()


def _belong_to_the_run() -> None:
    """Leave Ctrl-C to the parent, and end when it does: a kill gives it no time to end us."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_SECONDS)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
