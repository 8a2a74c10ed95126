"""Run scenes on a Dask cluster. The only file that imports Dask, and only when it is asked for."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from validation.jobs.code import fingerprint
from validation.jobs.one import DIED, Each, one
from validation.jobs.store import Ended, Scene

CONNECT_SECONDS = 5  # a scheduler on the same network answers in far less
WORKER_SECONDS = 10  # for a first worker to join, where all were started together


@contextmanager
def cluster(address: str, scene: Scene) -> Iterator[Each]:
    """Connect to the scheduler at ``address``, as tcp://10.0.0.1:8786; close on leaving.

    Raises ImportError without Dask, ValueError where nobody answers, where no worker joins, or
    where a worker lacks this code or has another version of it.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ImportError("--dask needs Dask: pip install 'lightloc[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # we say it in a sentence
    if asyncio.run(_kind(address)) != "Scheduler":
        raise ValueError(f"--dask {address}: no scheduler answers there")
    client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)

    def each(names: Sequence[str]) -> Generator[Ended, None, None]:
        suspects = []
        for ended in _gather(client, scene, names, address):
            if ended.error == DIED:
                suspects.append(ended.name)
            else:
                yield ended
        for name in suspects:  # Dask blames all that a dead worker held; alone, it is the one
            yield from _gather(client, scene, [name], address)

    with client:
        _check(client, scene, address)
        yield each


async def _kind(address: str) -> str | None:
    """What answers at the address, "Scheduler" or else; a Client alone would wait for ever."""
    from distributed import rpc

    async def ask() -> str | None:
        async with rpc(address, timeout=CONNECT_SECONDS) as there:
            return (await there.identity()).get("type")

    try:
        return await asyncio.wait_for(ask(), CONNECT_SECONDS)
    except Exception:  # whatever an address, or what answers there, can be wrong with
        return None


def _gather(client: Any, scene: Scene, names: Sequence[str], address: str) -> Iterator[Ended]:
    """Scenes as they end; where no worker is left, it waits for one to join."""
    from distributed import as_completed

    futures = client.map(one, [scene] * len(names), names, pure=False)
    name_of = {future.key: name for future, name in zip(futures, names, strict=True)}
    done = as_completed(futures, loop=client.loop)
    del futures  # held by nobody, a result is forgotten by its worker once it is here
    for future in done:
        yield _ended(future, name_of[future.key], fingerprint(scene), address)


def _ended(future: Any, name: str, code: str, address: str) -> Ended:
    from distributed.scheduler import KilledWorker

    try:
        return future.result()
    except KilledWorker:  # several workers died of it, one after another
        return Ended(name, code, 0.0, None, DIED)
    except Exception as error:
        if future.cancelled() or isinstance(error, OSError):
            raise RuntimeError(
                f"--dask {address}: the scheduler went away; what had ended is kept"
            ) from None
        return Ended(name, code, 0.0, None, f"{type(error).__name__}: {error}")


def _check(client: Any, scene: Scene, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKER_SECONDS)
    except TimeoutError:
        raise ValueError(f"--dask {address}: the scheduler has no worker") from None
    try:
        prints = client.run(fingerprint, scene)
    except Exception as error:
        said = " ".join(str(error).split())
        raise ValueError(f"--dask {address}: a worker can't run lightloc ({said})") from None
    for worker, other in prints.items():
        if other != fingerprint(scene):
            raise ValueError(
                f"--dask {address}: the worker {worker} has another version of lightloc or of what "
                "is below it"
            )
