"""Files that appear whole or not at all, and archives of arrays that say what they are."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """``with whole(path) as part:`` write ``part``; it becomes ``path`` when the block ends.

    Where the block fails or is killed, what was at ``path`` is still there. ``part`` lies beside
    it, hidden, with the same extension.

    Raises
    ------
    OSError
        If the folder is missing or can't be written to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole(f"{folder}/a.txt") as part:
    ...         _ = part.write_text("all of it")
    ...     Path(folder, "a.txt").read_text(), len(list(Path(folder).iterdir()))
    ('all of it', 1)
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path.parent}: no such folder")
    part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def archive(path: str | Path, what: str, formats: Sequence[str]) -> dict[str, NDArray[Any]]:
    """The arrays of an ``.npz`` whose ``format`` is one of some, the newest first.

    Raises ValueError naming the file where it is missing, broken or of another format.
    """
    try:
        # our own handle: np.load leaves one open where the archive is broken
        with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as file:
            keys = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file") from None
    except UNREADABLE:
        raise ValueError(f"{path}: not a file of {what} (.npz)") from None
    if str(keys.get("format")) not in formats:
        found = keys.get("format")
        said = "it names no format" if found is None else f"its format is '{found}'"
        raise ValueError(f"{path}: no {what} file: {said}; expected {formats[0]}")
    return keys


UNREADABLE = (  # what np.load, zipfile and zlib say of a file that is cut short or changed
    OSError,
    ValueError,
    TypeError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)
