"""The process that a solver runs in: ``python -m validation.methods.child FOLDER``.

It reads FOLDER/job.json and observations.npz, and leaves answer.npz, or failed.json with a
sentence.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
import traceback
from pathlib import Path

MEGABYTE = 1 << 20


def main(folder: Path) -> None:
    """Run the solver of a folder's job."""
    job = json.loads((folder / "job.json").read_text())
    limited(job["memory_mb"])
    import numpy as np

    import lightloc

    import drjit  # isort: skip

    drjit.set_thread_count(job["threads"])
    import render
    from lightloc import Observations
    from validation.methods.answer import asked, taken
    from validation.methods.named import Method, function

    q, room = Observations.load(folder / "observations.npz"), None
    if job["scene"]:
        room = render.load(job["scene"], find=job["find"], unit=job["unit"], **job["parameters"])
        room = render.relight(room, lightloc.PointLights([[0, 0, 0]], [0.0], room.unit))
        q = render.attach(q, room)
    try:
        file = Path(job["file"]) if job["file"] else None
        solve = function(Method(f"{job['module']}:{job['function']}", file))
        ending(folder, job["seconds"])
        more = asked(solve, room=room, bounds=job["bounds"], seed=job["seed"])
        clock = time.perf_counter()
        given = solve(q, room.geometry if room else None, **more)
        took = time.perf_counter() - clock
        fields = taken(given, q.channels)
    except BaseException as error:  # whatever a solver does, SystemExit too, is its answer
        failed(folder, error, job["file"] or job["module"])
        return
    kept = {name: value for name, value in fields.items() if value is not None}
    np.savez(folder / "answer.npz", took=took, **kept)


def ending(folder: Path, seconds: float) -> None:
    """End this process when the solver has had its time."""

    def end() -> None:
        leave(folder, f"it ran longer than {seconds:g} s")
        os._exit(1)

    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()


def limited(megabytes: int) -> None:
    """Let this process have no more memory, where the system can do that."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (megabytes * MEGABYTE, megabytes * MEGABYTE))
    except (ImportError, ValueError, OSError):
        pass


def failed(folder: Path, error: BaseException, own: str) -> None:
    """Print what went wrong, and leave a sentence on it and on where in the solver's own file."""
    from validation.methods.answer import sentence

    traceback.print_exception(error)
    leave(folder, sentence(error, own))


def leave(folder: Path, said: str) -> None:
    """Leave a sentence, whole or not at all."""
    part = folder / "failed.part"
    part.write_text(json.dumps({"said": said}))
    part.replace(folder / "failed.json")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
