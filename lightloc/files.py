"""Files that appear whole or not at all, and archives of arrays that say what they are."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from errno import EACCES, ELOOP
from pathlib import Path
from secrets import token_hex
from shutil import copyfileobj
from stat import S_IMODE, S_ISCHR, S_ISDIR, S_ISREG
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """``with whole(path) as part:`` write ``part``; it becomes ``path`` when the block ends.

    Where the block fails or is killed, what was at ``path`` is still there. ``part`` lies beside
    it, hidden; a file that is replaced keeps its permissions, and a symbolic link keeps pointing
    where it did, to the file that is replaced. A pipe or a device replaces nothing: it is given
    what was written elsewhere.

    Raises
    ------
    OSError
        If the folder is missing or can't be written to; it names ``path``.

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
    try:
        if _is_stream(path):
            with TemporaryDirectory() as folder:
                part = Path(folder, "part")
                yield part
                _pour(part, path)
        else:
            with _beside(Path(os.path.realpath(path))) as part:
                yield part
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from None


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    part = path.with_name(f".{token_hex(8)}.part")  # as short as any name, and nobody else's
    try:
        if path.is_symlink():  # still, once followed: it leads to itself
            raise OSError(ELOOP, os.strerror(ELOOP))
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError(EACCES, os.strerror(EACCES))
        yield part
        if path.exists():
            part.chmod(S_IMODE(path.stat().st_mode))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _is_stream(path: Path) -> bool:
    """Whether a path is there and no file or folder: a pipe, a device, the standard output."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (S_ISREG(mode) or S_ISDIR(mode)) or _is_output(path)


def _is_output(path: Path) -> bool:
    try:
        there = path.stat()
        return os.path.samestat(there, os.fstat(1)) and not S_ISCHR(there.st_mode)
    except OSError:
        return False


def _pour(part: Path, path: Path) -> None:
    """Copy a file into a stream; the standard output goes on where it is."""
    own = _is_output(path)
    with open(part, "rb") as source, open(1 if own else path, "wb", closefd=not own) as stream:
        copyfileobj(source, stream)


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
