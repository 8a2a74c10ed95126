"""A child that takes inputs in, one after the other, and is held to limits of time and memory."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[2]
SECONDS, BYTES = 10.0, 6 << 30  # that an input may take
START = 120.0  # seconds until a child must be ready
GLANCE = 0.02  # seconds between two looks at its memory
TURNS = 400  # inputs until a child is replaced: the renderer keeps what it compiled
LOADED, REFUSED = "loaded", "refused"


@dataclass(frozen=True)
class Outcome:
    """``what``: loaded, refused, or the kind of fault; ``said`` is its sentence or trace."""

    what: str
    said: str
    seconds: float = 0.0

    @property
    def is_fault(self) -> bool:
        return self.what not in (LOADED, REFUSED)


class Child:
    """Starts when it is first asked, and again after a crash, a hang or a glut of memory."""

    def __init__(self, seconds: float = SECONDS, memory: int = BYTES) -> None:
        self.seconds, self.memory = seconds, memory
        self.process: subprocess.Popen[bytes] | None = None
        self.turns = 0

    def ask(self, folder: Path) -> Outcome:
        """What becomes of the input in that folder."""
        if self.process is None:
            self._start()
        self.log.seek(0)
        self.log.truncate()
        started = time.perf_counter()
        os.write(self.questions, f"{folder.resolve()}\n".encode())
        answer, why = self._answer(self.seconds)
        seconds = time.perf_counter() - started
        self.turns += 1
        if answer is None:
            said, code = self._logged(), self.end()
            return Outcome(why or f"crash ({_name(code)})", said, seconds)
        if self.turns >= TURNS:
            self.end()
        return Outcome(answer["what"], answer["said"], seconds)

    def end(self) -> int:
        """Its exit code, it and all that it started being gone; negative of a signal."""
        if self.process is None:
            return 0
        died = self.process.poll()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        code, self.process = self.process.wait(), None
        os.close(self.answers)
        os.close(self.questions)
        self.log.close()
        return code if died is None else died

    def _start(self) -> None:
        self.log = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115 - of its life
        self.answers, answers = os.pipe()
        questions, self.questions = os.pipe()
        paths = [str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")]
        own = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        how = ("-X", "faulthandler", "-W", "error", "-m", "fuzz.judge")
        self.process = subprocess.Popen(
            [sys.executable, *how, str(questions), str(answers), str(self.seconds)],
            stdin=subprocess.DEVNULL,
            stdout=self.log,
            stderr=self.log,
            cwd=ROOT,
            env=os.environ | own,
            pass_fds=[questions, answers],
            start_new_session=True,
        )
        os.close(questions)
        os.close(answers)
        self.turns, self.rest = 0, b""
        if self._answer(START)[0] is None:
            raise RuntimeError(f"the child did not start: {self._logged()}")

    def _answer(self, limit: float) -> tuple[dict[str, str] | None, str]:
        """A line of its answers; None, and why, where it passed a limit or ended."""
        assert self.process
        watched, last = psutil.Process(self.process.pid), time.perf_counter() + limit
        while b"\n" not in self.rest:
            if time.perf_counter() > last:
                return None, f"hang (over {limit:g} s)"
            with contextlib.suppress(psutil.Error):
                if watched.memory_info().rss > self.memory:
                    return None, f"memory (over {self.memory >> 20} MiB)"
            if not select.select([self.answers], [], [], GLANCE)[0]:
                continue
            more = os.read(self.answers, 1 << 20)
            if not more:
                self.process.wait()
                return None, ""
            self.rest += more
        line, _, self.rest = self.rest.partition(b"\n")
        return json.loads(line), ""

    def _logged(self) -> str:
        self.log.seek(0)
        return self.log.read()[-20_000:]


def _name(code: int) -> str:
    return signal.Signals(-code).name if code < 0 else f"exit code {code}"
