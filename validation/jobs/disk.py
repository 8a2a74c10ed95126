"""Reading and writing of the report's files: whole or not at all, and without NaN."""

import json
import math
import os
from errno import EACCES, ELOOP
from pathlib import Path
from secrets import token_hex
from stat import S_IMODE, S_ISCHR, S_ISDIR, S_ISREG
from typing import Any


def write_bytes(path: Path, content: bytes) -> Path:
    """Write a file and the folders above it; no reader sees half of it.

    As `lightloc.files.whole` does, without lightloc: a report is drawn where Dr.Jit is not. A file
    that is replaced keeps its permissions, a symbolic link stays one, and a pipe or a device is
    written to and not replaced.

    Raises OSError naming the path where it can't be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if is_stream(path):
            own = is_output(path)
            with open(1 if own else path, "wb", closefd=not own) as stream:
                stream.write(content)
        else:
            _replace(Path(os.path.realpath(path)), content)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    return path


def _replace(path: Path, content: bytes) -> None:
    part = path.with_name(f".{token_hex(8)}.part")  # as short as any name, and nobody else's
    try:
        if path.is_symlink():  # still, once followed: it leads to itself
            raise OSError(ELOOP, os.strerror(ELOOP))
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError(EACCES, os.strerror(EACCES))
        part.write_bytes(content)
        if path.exists():
            part.chmod(S_IMODE(path.stat().st_mode))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def is_stream(path: Path) -> bool:
    """Whether a path is there and no file or folder: a pipe, a device, the standard output."""
    try:
        mode = path.stat().st_mode
    except OSError:
        return False
    return not (S_ISREG(mode) or S_ISDIR(mode)) or is_output(path)


def is_output(path: Path) -> bool:
    """Whether a path is what the standard output goes to, as /dev/stdout is."""
    try:
        there = path.stat()
        return os.path.samestat(there, os.fstat(1)) and not S_ISCHR(there.st_mode)
    except OSError:
        return False


def write_text(path: Path, content: str) -> Path:
    """Write text as UTF-8; bytes that came from a broken console become question marks."""
    return write_bytes(path, content.encode("utf-8", errors="replace"))


def write_json(path: Path, content: Any) -> Path:
    """Write plain data as JSON, which has neither NaN nor infinity.

    Raises
    ------
    ValueError
        If there is one.
    """
    return write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def finite(value: Any) -> Any:
    """Return plain JSON data with every NaN and infinity, however deep, replaced by None."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return value


def read_json(path: Path) -> dict[str, Any]:
    """Read one JSON object.

    Raises
    ------
    ValueError
        If the file is missing, unreadable, no JSON, or not an object.
    """
    try:
        if os.path.exists(path) and not path.is_file():  # a pipe may never end
            raise ValueError("it is no file")
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(f"{path} is missing.") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}.") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} is not valid JSON: {error}.") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path} holds no JSON object.")
    return dict(finite(content))


def ready(path: Path) -> Path:
    """The path, with its folder made: only now that there is something to write."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"{path}: can't be written there ({error.strerror})") from None
    return path
