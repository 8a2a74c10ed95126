"""What code made a record: a hash of lightloc and of the files that the scene's function needs."""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.metadata
import importlib.resources
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

OURS = ("validation", "render")
BELOW = ("drjit", "numpy", "scipy")  # whose versions may change a result


@functools.cache
def fingerprint(scene: Callable[[str], Any] | None = None) -> str:
    """SHA-256 of the code that makes a scene's record.

    It is of lightloc, of what is below it, and of the files of `validation` and `render` that the
    function's own file needs, with the scenes where it renders: those that only run scenes or
    show what came out change no result.
    """
    versions = [importlib.metadata.version(name) for name in BELOW]
    backend = os.environ.get("LIGHTLOC_BACKEND", "llvm")
    digest = hashlib.sha256(json.dumps([versions, backend]).encode())
    lightloc = _folder("lightloc")
    files = {str(file.relative_to(lightloc)): file for file in lightloc.rglob("*.py")}
    own = needed(scene.__module__) if scene else {}
    if any(name.startswith("render.") for name in own):
        own |= {f"scenes.{file.stem}": file for file in _folder("scenes").glob("*.xml")}
    files |= own
    for name, file in sorted(files.items()):
        digest.update(name.encode() + file.read_bytes())
    return digest.hexdigest()


def needed(module: str) -> dict[str, Path]:
    """The files that a module is made of: its own, and all of `OURS` that these import.

    >>> list(needed("validation.judge.match"))
    ['validation.judge.match']
    """
    found: dict[str, Path] = {}
    left = [module]
    while left:
        name = left.pop()
        file = _file(name)
        if file and name not in found:
            found[name] = file
            left += _imported(file)
    return found


def _imported(file: Path) -> Iterator[str]:
    """Every name that an import in a file may mean a module by."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
            for alias in node.names:
                yield f"{node.module}.{alias.name}"
                yield from _behind(node.module, alias.name)


def _behind(room: str, name: str) -> Iterator[str]:
    """The module that a room's door has a name from."""
    door = _file(f"{room}.__init__")
    for node in ast.walk(ast.parse(door.read_bytes())) if door else ():
        if isinstance(node, ast.ImportFrom) and name in (alias.name for alias in node.names):
            yield str(node.module)


def _file(module: str) -> Path | None:
    """The file of a module in `OURS`; None of any other, and of a room's door."""
    first, *rest = module.split(".")
    if first not in OURS:
        return None
    file = _folder(first).joinpath(*rest).with_suffix(".py") if rest else None
    return file if file and file.is_file() else None


@functools.cache
def _folder(package: str) -> Path:
    return Path(str(importlib.resources.files(package)))
