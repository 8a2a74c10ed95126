"""The scenes that have ended, a line of JSON each, and whether their results still hold.

A line is appended as a scene ends, so that a run can be killed at any instant and goes on.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from validation.jobs.code import fingerprint
from validation.jobs.disk import ready

Scene = Callable[[str], Any]  # a name in, a dataclass of plain values out
FILE = "scenes.jsonl"


@dataclass(frozen=True)
class Ended:
    """A scene that has ended: with its record, or with the error that it crashed with.

    ``record`` holds the fields of the scene's dataclass, None where a number was not finite;
    ``elapsed`` is in seconds, of everything that was done with it; ``fingerprint`` is that of the
    code that ran it, which need not be this process's.
    """

    name: str
    fingerprint: str
    elapsed: float
    record: dict[str, Any] | None
    error: str = ""

    @property
    def row(self) -> str:
        """The row of the table: what stands before the scene's number."""
        return row_of(self.name)


def row_of(name: str) -> str:
    """The row that a scene's name belongs to.

    Examples
    --------
    >>> row_of("noisy-3-017")
    'noisy-3'
    """
    return name.rpartition("-")[0]


def read(out: Path, scene: Scene | None = None) -> dict[str, Ended]:
    """What is in OUT/scenes.jsonl of this code's ``scene``, by name; the last line of one wins.

    Lines of other code, and lines that were torn or are no scene, are passed over.
    """
    own: dict[str, str] = {}
    found: dict[str, Ended] = {}
    for ended in every(out):
        name = ended.name
        own[name] = own.get(name) or fingerprint(scene, name)
        if ended.fingerprint == own[name]:
            found[name] = ended
    return found


def every(out: Path) -> Iterator[Ended]:
    """What is in OUT/scenes.jsonl, a line after the other, whatever code wrote it."""
    try:
        text = (out / FILE).read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return
    for line in text.splitlines():
        try:
            ended = Ended(**json.loads(line))
            whole = isinstance(ended.record, dict) or bool(ended.error)
        except (ValueError, TypeError):
            continue
        if whole:
            yield ended


def waiting(names: Sequence[str], out: Path, scene: Scene | None = None) -> list[str]:
    """Of these scenes, those that have no result yet; what crashed is tried again."""
    ended = read(out, scene)
    return [name for name in names if name not in ended or ended[name].error]


@contextmanager
def appending(out: Path) -> Iterator[Callable[[Ended], None]]:
    """``with appending(out) as keep:`` then ``keep(ended)`` adds a line that a kill can't undo.

    Raises ValueError where nothing can be written, or another run is writing there.
    """
    path = ready(out / FILE)
    with path.open("ab+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"{path}: another run is writing there") from None
        if file.tell():  # a killed run may have left half a line: it must not swallow the next
            file.seek(-1, os.SEEK_END)
            if file.read(1) != b"\n":
                file.write(b"\n")

        def keep(ended: Ended) -> None:
            file.write(json.dumps(asdict(ended), allow_nan=False).encode() + b"\n")
            file.flush()

        yield keep
