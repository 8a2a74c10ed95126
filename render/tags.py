"""The tags of an XML scene, looked at before Mitsuba reads it: parameters, files, and depth.

As lenient as Mitsuba's own parser, which takes comments and names that are not XML, and in time
that grows with the file's length alone.
"""

from __future__ import annotations

import html
import os
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from lightloc.checks import printable
from lightloc.files import regular

USED = re.compile(r"\$(\w+)")
NAME = re.compile(r"[A-Za-z_:][\w:.-]*")
ATTRIBUTE = re.compile(r"""\s*([^\s=<>/"']+)\s*=\s*(?:"([^"]*)"|'([^']*)')""")
EMPTY = re.compile(r"\s*/>")
DEEPEST = 200  # tags within each other; Mitsuba goes down by recursion
MOST = 1000  # files that a scene includes, each as often as it is included
RECURSION = 16  # files within each other, after which Mitsuba itself gives up


class Tags:
    """Of one file: ``defaults`` of parameters and those ``used``, the ``files`` that tags name,
    those ``included`` among them, the ``folders`` to look in, and how deep the tags are nested.
    """

    def __init__(self, file: Path) -> None:
        self.defaults: dict[str, str] = {}
        self.used: set[str] = set()
        self.files: list[str] = []
        self.included: list[str] = []
        self.folders: list[str] = []
        self.depth = 0
        for depth, tag, own in _tags(file.read_text(errors="replace")):
            self.depth = max(self.depth, depth)
            if tag == "default" and "name" in own:
                self.defaults.setdefault(own["name"], own.get("value", ""))
            if "filename" in own:
                (self.included if tag == "include" else self.files).append(own["filename"])
            if own.get("name") == "filename":
                self.files.append(own.get("value", ""))
            if tag == "path":
                self.folders.append(own.get("value", ""))
            for value in own.values():
                self.used |= set(USED.findall(value))

    def fill(self, values: Mapping[str, str]) -> None:
        """Put the parameters' values into the names of files."""
        for names in (self.files, self.included, self.folders):
            names[:] = [USED.sub(lambda m: values.get(m[1], m[0]), name) for name in names]


def check_files(path: Path, values: Mapping[str, str]) -> None:
    """Refuse a scene that Mitsuba would not come back from.

    Parameters
    ----------
    path
        The scene's file.
    values
        Of its parameters.

    Raises
    ------
    ValueError
        If it or what it includes names a device or a pipe, nests tags too deep for Mitsuba's
        recursion, or includes files again and again.
    """
    folders, waiting, inside = [path.parent], [path], dict[Path, list[Path]]()
    while waiting:
        file = waiting.pop()
        if file in inside:
            continue
        tags = Tags(file)
        if tags.depth > DEEPEST:
            raise ValueError(f"{path}: its tags are nested more than {DEEPEST} deep")
        values = {**tags.defaults, **values}
        tags.fill(values)
        folders += [file.parent, *(file.parent / name for name in tags.folders)]
        inside[file] = []
        for name in (*tags.files, *tags.included):
            for there in dict.fromkeys((Path(name), *(folder / name for folder in folders))):
                if os.path.isdir(there) or not os.path.exists(there):
                    continue
                try:
                    regular(there)
                except ValueError as error:
                    raise ValueError(f"{path}: {printable(str(error))}") from None
                if name in tags.included:
                    inside[file].append(there)
        waiting += inside[file]

    @cache
    def count(file: Path, left: int) -> int:
        return 1 + sum(count(one, left - 1) for one in inside[file]) if left else 1

    if count(path, RECURSION) > MOST:
        raise ValueError(f"{path}: includes more than {MOST} files")


def _tags(text: str) -> Iterator[tuple[int, str, dict[str, str]]]:
    """(depth, name, attributes) of each tag that opens."""
    at, depth = 0, 0
    while (at := text.find("<", at)) >= 0:
        if text.startswith("<!--", at):
            end = text.find("-->", at + 4)
            if end < 0:
                return
            at = end + 3
            continue
        depth -= text.startswith("</", at)
        name, at = NAME.match(text, at + 1), at + 1
        if not name:
            continue
        own, at = dict[str, str](), name.end()
        while attribute := ATTRIBUTE.match(text, at):
            own[attribute[1]] = html.unescape(attribute[2] or attribute[3] or "")
            at = attribute.end()
        yield depth + 1, name[0], own
        depth += not EMPTY.match(text, at)
