"""Files that appear whole or not at all, and archives of arrays that say what they are."""

from __future__ import annotations

import os
import stat
import zipfile
from collections.abc import Iterator, Mapping, Sequence
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


def regular(path: str | Path) -> Path:
    """The path of a file that can be read from its beginning to its end.

    Raises
    ------
    ValueError
        Naming the file, if there is none, or it is a folder, a device or a pipe, which may never
        end.

    Examples
    --------
    >>> regular("nowhere.npz")
    Traceback (most recent call last):
        ...
    ValueError: nowhere.npz: no such file
    """
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise ValueError(f"{path}: no such file") from None
    except OSError as error:
        raise ValueError(f"{path}: can't be read ({error.strerror})") from None
    except ValueError:  # a NUL in its name
        raise ValueError(f"{path}: is no name of a file") from None
    if not stat.S_ISREG(mode):
        kind = "a folder" if stat.S_ISDIR(mode) else "a device or a pipe"
        raise ValueError(f"{path}: can't be read (it is {kind})")
    return Path(path)


def archive(path: str | Path, what: str, formats: Sequence[str]) -> dict[str, NDArray[Any]]:
    """The arrays of an ``.npz`` whose ``format`` is one of some, the newest first.

    Raises ValueError naming the file where it is missing, broken or of another format.
    """
    broken = f"{path}: not a file of {what} (.npz)"
    try:
        # our own handle: np.load leaves one open where the archive is broken
        with open(regular(path), "rb") as stream:
            if not zipfile.is_zipfile(stream):  # np.load would look for other formats
                raise ValueError(broken)
            size = sum(member.file_size for member in zipfile.ZipFile(stream).infolist())
            if size > LARGEST:
                raise ValueError(f"{path}: unpacks to {size >> 20} MiB; expected at most 4096")
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as file:
                keys = {name: file[name] for name in file.files}
            for value in keys.values():
                if not isinstance(value, np.ndarray):  # a member that is no .npy
                    raise ValueError(broken)
                if value.dtype.kind == "U":
                    value.tolist()  # or what is no text would be found later
    except ValueError as error:
        raise ValueError(error if str(error).startswith(f"{path}: ") else broken) from None
    except Exception:  # of zipfile, zlib, tokenize or NumPy, each of which has its own
        raise ValueError(broken) from None
    if "format" not in keys:
        raise ValueError(f"{path}: no {what} file: it names no format; expected {formats[0]}")
    try:
        found = word(keys, "format")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if found not in formats:
        said = f"its format is '{found}'"
        raise ValueError(f"{path}: no {what} file: {said}; expected {formats[0]}")
    return keys


def word(keys: Mapping[str, NDArray[Any]], name: str) -> str:
    """The text that an archive holds under a name.

    Raises KeyError where there is none, and ValueError where it is no short text of one line.

    Examples
    --------
    >>> word({"unit": np.array("cm")}, "unit")
    'cm'
    """
    value = keys[name]
    text = str(value) if value.shape == () and value.dtype.kind == "U" else "\n"
    if len(text) > LONGEST or not text.isprintable():
        raise ValueError(f"field {name} is no word")
    return text


LARGEST = 1 << 32  # bytes of an archive's arrays: a small file may unpack to any size
LONGEST = 100  # characters of a word
