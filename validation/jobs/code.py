"""What made a record: a hash of the code that a scene needs, and of what it is given."""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib.metadata
import importlib.resources
import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

OURS = ("validation", "render")
BELOW = ("drjit", "mitsuba", "numpy", "scipy")  # whose versions may change a result
SCENE_FILES = ("xml", "ply", "png", "bsdf")


def fingerprint(scene: Callable[[str], Any] | None = None, name: str = "") -> str:
    """SHA-256 of the code that makes a scene's record, and of all that it is given.

    ``scene`` runs a scene: it is a function; or a value with a function ``one`` whose code it is,
    and with ``given``, which says by name what else decides a record: values, and files such as the
    user's own scene.
    """
    given: Callable[[str], Iterable[str | Path]] | None = getattr(scene, "given", None)
    code = _code(getattr(scene, "one", scene).__module__ if scene else None, given is None)
    if given is None:
        return code
    digest = hashlib.sha256(code.encode())
    for part in given(name):
        digest.update(_content(part) if isinstance(part, Path) else part.encode())
    return digest.hexdigest()


@functools.cache
def _code(module: str | None, scenes: bool) -> str:
    """A hash of lightloc, of what is below it, and of the files that a module needs.

    Of `validation` and `render` only these count, with all packaged ``scenes`` where it renders:
    what only runs scenes or shows what came out changes no result.
    """
    versions = [importlib.metadata.version(name) for name in BELOW]
    backend = os.environ.get("LIGHTLOC_BACKEND", "llvm")
    digest = hashlib.sha256(json.dumps([versions, backend]).encode())
    lightloc = _folder("lightloc")
    files = {str(file.relative_to(lightloc)): file for file in lightloc.rglob("*.py")}
    own = needed(module) if module else {}
    if scenes and any(name.startswith("render.") for name in own):
        folder = _folder("scenes")
        found = (file for kind in SCENE_FILES for file in folder.rglob(f"*.{kind}"))
        own |= {f"scenes/{file.relative_to(folder)}": file for file in found}
    files |= own
    for name, file in sorted(files.items()):
        digest.update(name.encode() + file.read_bytes())
    return digest.hexdigest()


def _content(file: Path) -> bytes:
    """A hash of a file; of nothing where it is not there."""
    return hashlib.sha256(file.read_bytes()).digest() if file.is_file() else b""


def needed(module: str) -> dict[str, Path]:
    """The files that a module is made of: its own, and all of `OURS` that these import.

    Examples
    --------
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
            for alias in node.names:
                yield from (alias.name, f"{alias.name}.__init__")
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
