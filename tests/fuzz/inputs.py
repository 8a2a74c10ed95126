"""An input: files in a folder, and how they are taken in."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

RECIPE = "input.json"


@dataclass(frozen=True)
class Input:
    """``kind`` names who judges it; ``files`` are by name, the one that is read the first.

    A file without content (None) is a pipe that nobody writes to. ``arguments`` are those of a
    command; {} stands in them for the folder. Where there are no files, the one argument names what
    is read.
    """

    kind: str
    files: Mapping[str, bytes | None] = field(default_factory=dict)
    arguments: tuple[str, ...] = ()

    def write(self, folder: Path) -> Path:
        """Into a new folder, which is returned."""
        folder.mkdir(parents=True)
        for name, content in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            if content is None:
                os.mkfifo(folder / name)
            else:
                (folder / name).write_bytes(content)
        recipe = {"kind": self.kind, "files": list(self.files), "arguments": list(self.arguments)}
        (folder / RECIPE).write_text(json.dumps(recipe))
        return folder

    @staticmethod
    def read(folder: Path) -> Input:
        """What `write` wrote."""
        recipe = json.loads((folder / RECIPE).read_text())
        paths = {name: folder / name for name in recipe["files"]}
        files = {name: p.read_bytes() if p.is_file() else None for name, p in paths.items()}
        return Input(recipe["kind"], files, tuple(recipe["arguments"]))
