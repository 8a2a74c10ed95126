"""A solver in a process of its own: what it does to that, it does to no other."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lightloc import Localization, Observations
from render import Room
from validation.methods.answer import answered
from validation.methods.named import Method

SECONDS, MEMORY_MB = 240.0, 8192
"""That a solver may take."""

GRACE = 30.0
"""Seconds more, to start and to load the room; and to end itself."""

LAST, KEPT = 300, 1 << 20
"""Letters of what a solver that died had printed that are told, and of any that are kept."""


@dataclass(frozen=True)
class Scene:
    """A room, so that another process can load it.

    Parameters
    ----------
    file
        As `render.load` takes it.
    find, unit, parameters
        The same.
    """

    file: str | Path
    find: str | Sequence[str] = "point"
    unit: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict)


class SolverFailed(Exception):
    """What a solver did wrong, a sentence."""


def solved(
    method: Method,
    q: Observations,
    room: Room | None,
    scene: Scene | None,
    *,
    bounds: Any = None,
    seed: int = 0,
    seconds: float = SECONDS,
    memory_mb: int = MEMORY_MB,
    log: Callable[[bytes], object] | None = None,
) -> tuple[Localization, float]:
    """Run a solver on observations; returns its answer, and its own seconds, without the start.

    It is called with the observations and the geometry of ``scene``, of which ``room`` is the one
    loaded here, and with ``room``, ``bounds`` and ``seed`` where it has parameters of that name.
    ``log`` is given what it printed, and where it raised, if anything.

    Raises
    ------
    SolverFailed
        If it raises, dies, takes longer than ``seconds`` or more memory than ``memory_mb``, or
        what it returns is no answer.
    """
    with tempfile.TemporaryDirectory(prefix="lightloc-") as name:
        folder = Path(name)
        q.save(folder / "observations.npz")
        job = {
            **{"module": method.module, "function": method.function},
            "file": str(method.file) if method.file else None,
            "scene": str(scene.file) if scene else None,
            "find": list(scene.find) if scene and not isinstance(scene.find, str) else "point",
            "unit": scene.unit if scene else None,
            "parameters": scene.parameters if scene else {},
            "bounds": bounds if bounds is None else np.asarray(bounds, float).tolist(),
            **{"seed": seed, "seconds": seconds, "memory_mb": memory_mb, "threads": threads()},
        }
        (folder / "job.json").write_text(json.dumps(job))
        try:
            code = ran(folder, seconds)
        finally:
            printed = end_of(folder / "printed")
            if log and printed:
                log(printed)
        failed, answer = folder / "failed.json", folder / "answer.npz"
        if failed.exists():
            raise SolverFailed(f"The solver failed: {json.loads(failed.read_text())['said']}.")
        if not answer.exists():
            last = " ".join(printed[-LAST:].decode(errors="replace").split())
            last = f"; the last it printed: {last}" if last else ""
            raise SolverFailed(f"The solver's process died ({death(code)}){last}.")
        with np.load(answer) as file:
            fields: dict[str, Any] = dict(file)
    reason = fields.pop("reason", None)
    fields["reason"] = None if reason is None else str(reason)
    took = float(fields.pop("took"))
    return answered(q, fields, room.geometry if room else None), took


def death(code: int) -> str:
    """How a process ended that left nothing.

    Examples
    --------
    >>> death(3), death(-11)
    ('exit code 3', 'SIGSEGV')
    """
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def ran(folder: Path, seconds: float) -> int:
    """Run the child to its end, or end it; returns its exit code. FOLDER/printed has its words."""
    words = [sys.executable, "-u", "-m", "validation.methods.child", str(folder)]
    where = Path(__file__).parents[2]
    path = os.pathsep.join([str(where), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path, "PYTHONSAFEPATH": "1"}
    with open(folder / "printed", "wb") as printed:
        process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        try:
            process.wait(seconds + GRACE)
        except subprocess.TimeoutExpired:
            raise SolverFailed(f"The solver failed: it ran longer than {seconds:g} s.") from None
        finally:
            ended(process)
    return process.returncode


def end_of(file: Path) -> bytes:
    """The last that a file holds, `KEPT` bytes at most."""
    with open(file, "rb") as printed:
        printed.seek(max(0, file.stat().st_size - KEPT))
        return printed.read()


def ended(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it has started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def threads() -> int:
    """Of this process's kernels: the solver has as many."""
    import drjit

    return int(drjit.thread_count())
