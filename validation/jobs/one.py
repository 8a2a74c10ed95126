"""One scene, run in this process."""

from __future__ import annotations

import json
import math
import threading
import time
import traceback
from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.jobs.code import fingerprint
from validation.jobs.store import Ended, Scene

Each = Callable[[Sequence[str]], Generator[Ended, None, Any]]
"""Runs the named scenes and yields each as it ends."""

ONE_AT_A_TIME = threading.Lock()  # in a Dask worker with several threads
DIED = "its process died"


def one(scene: Scene, name: str, threads: int = 1) -> Ended:
    """Run one scene in this process, with so many threads for its kernels.

    Never raises for what the scene does.
    """
    with ONE_AT_A_TIME:
        start, record, said = time.perf_counter(), None, ""
        try:
            _use(threads)
            record = {key: _plain(value) for key, value in asdict(scene(name)).items()}
            json.dumps(record, allow_nan=False)  # else it could not be kept
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            text = " ".join(str(error).split())
            place = f"{Path(last.filename).name}, line {last.lineno}"
            record, said = None, f"{type(error).__name__}: {text} ({place})"
        elapsed = round(time.perf_counter() - start, 3)
        return Ended(name, fingerprint(scene, name), elapsed, record, said)


def _use(threads: int) -> None:
    import lightloc  # noqa: F401  (before drjit: it chooses the LLVM library)

    import drjit  # isort: skip

    drjit.set_thread_count(threads)


def _plain(value: Any) -> Any:
    """A NumPy scalar as Python's own, and None for a number that JSON does not have."""
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value
