"""A scene's files as Mitsuba parses them: what they name, where it stands, and its objects."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi

from lightloc.checks import printable
from render.old_words import modern
from render.tags import Tags, check_files
from render.variant import two_threads

FAILURES = (RuntimeError, ValueError, TypeError, IndexError, KeyError)  # that Mitsuba raises
SOURCE = re.compile(r"\[\w+\.(?:cpp|h):\d+\]\s*|\[[A-Z][A-Za-z]*\]\s*")  # a place in its C++
PLACE = re.compile(r"(?:Error while loading|While loading|At) (.+?) \(line (\d+), col \d+\): ")
SYNTAX = re.compile(r'Parsing of XML file "(.+?)" failed: (.*) \(line (\d+), col \d+\)$')
WHOLE = re.compile(r'Error while loading XML file "(.+?)": ')
RAISED = re.compile(r"^(?:\w+\.)*\w*Error: ")
LONG = re.compile(r'"([^"/]{80})[^"/]{20,}"')  # a value that is repeated, but no path
DIRECT = ("direct", "direct_projective")
DEPTHS = {  # of integrators that end paths where no ``max_depth`` is said
    **dict.fromkeys(DIRECT, 2),
    **dict.fromkeys(("prb", "prb_basic", "prb_projective", "prbvolpath"), 6),
}
PLUGIN = re.compile(r'^failed to instantiate (\w+) plugin of type "(\w+)": ')


@dataclass(frozen=True)
class SceneFile:
    """A parsed scene, its references resolved and its names those of this Mitsuba.

    Parameters
    ----------
    path
        As the user names it.
    state
        Mitsuba's parsed state; its nodes may be changed until `build`.
    resolver
        Where Mitsuba looks for files: the scene's folder and those of its ``<path>``s first.
    values
        The parameters as text.
    notes
        What was not taken from it, as sentences.
    """

    path: Path
    state: Any
    resolver: Any
    values: Mapping[str, str]
    notes: tuple[str, ...] = ()

    @staticmethod
    def read(path: Path, parameters: Mapping[str, Any]) -> SceneFile:
        """Parse a file and all that it includes, each ``$name`` replaced by its value.

        Raises ValueError, with the file and the line, where Mitsuba can't read it, or where a
        parameter is one that no file has.
        """
        values = {name: text_of(value) for name, value in parameters.items()}
        resolver = mi.FileResolver(mi.file_resolver())
        resolver.prepend(str(path.parent))
        check_files(path, values)
        with _looking(resolver), _told(path):
            state = _parse(path, values)
            mi.parser.transform_all(_config(), state)
        file = SceneFile(path, state, resolver, values)
        known = {n for tags in file._tags() for n in (*tags.defaults, *tags.used)} if values else ()
        for name in values:
            if name not in known:
                raise ValueError(
                    f"{path}: has no parameter '{name}' "
                    f"(it has: {', '.join(sorted(known)) or 'none'})"
                )
        return file

    @staticmethod
    def made(path: Path, scene: dict[str, Any], notes: tuple[str, ...]) -> SceneFile:
        """A scene that a reader of another format made, as Mitsuba's dictionary."""
        with _told(path):
            state = mi.parser.parse_dict(_config(), scene)
            mi.parser.transform_all(_config(), state)
        return SceneFile(path, state, mi.file_resolver(), {}, notes)

    @property
    def root(self) -> Any:
        """The node of the scene itself."""
        return self.state.nodes[0]

    def parts(self, node: Any) -> list[tuple[str, Any]]:
        """The nodes that a node refers to, and the property by which it does."""
        return [(key, self.state.nodes[number]) for key, number in references(node)]

    def nodes(self) -> list[Any]:
        """The nodes that the scene is built of, each once, in the order of the files."""
        found, waiting = {0}, [0]
        while waiting:
            named = {number for _, number in references(self.state.nodes[waiting.pop()])}
            waiting += named - found
            found |= named
        return [self.state.nodes[number] for number in sorted(found)]

    @property
    def max_depth(self) -> int | None:
        """Length of the longest paths that its integrators trace, 2 being direct light.

        None where they go on until they carry nothing, or there is none.
        """
        own = [mi.Properties(node.props) for node in self.nodes() if node.type.name == "Integrator"]
        whole = mi.Properties.Type.Integer
        ends = [
            props["max_depth"]
            if "max_depth" in props
            and props.type("max_depth") == whole
            and props.plugin_name() not in DIRECT
            else DEPTHS.get(props.plugin_name(), -1)
            for props in own
        ]
        return min((end for end in ends if end >= 2), default=None)

    def refused(self, node: Any, why: str) -> ValueError:
        """The error that says why a node can't be taken, with its file and line."""
        place = mi.parser.file_location(self.state, node)
        file, _, line = place.removesuffix(")").rpartition(" (line ")
        if not file:  # of no XML
            return ValueError(f"{self.path}: {one_line(why)}")
        return ValueError(_place(self.path, file, line.partition(",")[0]) + one_line(why))

    def find(self, name: str) -> Path:
        """A file that the scene names, where Mitsuba finds it; as it is named where it doesn't."""
        return Path(str(self.resolver.resolve(name)))

    def files(self) -> list[Path]:
        """The scene's own file, then the others that it names and that exist, sorted."""
        named = {name for tags in self._tags() for name in (*tags.files, *tags.included)}
        for node in self.state.nodes:
            props = node.props
            kept = [key for key in props.keys() if props.type(key) == mi.Properties.Type.String]  # noqa: SIM118
            named |= {str(props[key]) for key in kept}
        found = {file for name in named if name and os.path.isfile(file := self.find(name))}
        found |= {Path(str(file)) for file in self.state.files}  # included
        return [self.path, *sorted(found - {self.path})]

    def build(self) -> Any:
        """What the root stands for, as Mitsuba's object, whatever properties it does not know."""
        with _looking(self.resolver), _told(self.path), two_threads():
            return mi.parser.instantiate(_config(), self.state)

    def _tags(self) -> list[Tags]:
        """What Mitsuba's parser does not keep, of each file."""
        found = [Tags(Path(str(file))) for file in self.state.files]
        values = {name: text for tags in reversed(found) for name, text in tags.defaults.items()}
        for tags in found:
            tags.fill({**values, **self.values})
        return found


def references(node: Any) -> list[tuple[str, int]]:
    """The properties by which a node refers to others, and the number of each."""
    props, kind = node.props, mi.Properties.Type.ResolvedReference
    keys = props.keys()  # no mapping: it has keys alone
    return [(key, props[key].index()) for key in keys if props.type(key) == kind]


def text_of(value: Any) -> str:
    """A parameter as Mitsuba reads it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _config() -> Any:
    config = mi.parser.ParserConfig(mi.variant())
    config.merge_equivalent = config.merge_meshes = False  # objects as the file has them
    config.unused_parameters = config.unused_properties = mi.LogLevel.Debug  # we look ourselves
    return config


def _parse(path: Path, values: Mapping[str, str]) -> Any:
    """Mitsuba's parsed state; old words are read as what they are today."""
    text = path.read_bytes()
    words = modern(text)
    if words == text:
        return mi.parser.parse_file(_config(), str(path), **values)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_bytes(words)
        try:
            state = mi.parser.parse_file(_config(), str(copy), **values)
        except FAILURES as error:
            raise ValueError(str(error).replace(str(copy), str(path))) from None
    state.files = [mi.filesystem.path(str(path)), *state.files[1:]]
    return state


@contextmanager
def _looking(resolver: Any) -> Iterator[None]:
    """Have Mitsuba look for files there; a ``<path>`` must not outlive its scene."""
    before = mi.file_resolver()
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Errors of Mitsuba as one sentence, with the file and the line but no place in its C++."""
    try:
        yield
    except FAILURES as error:
        raise ValueError(_sentence(path, str(error))) from None


def one_line(message: str) -> str:
    """A message of Mitsuba as one short line, without places in its C++ or odd characters.

    Examples
    --------
    >>> one_line("[Plugin.cpp:3] no such\\n  thing \\x01")
    'no such thing \\\\x01'
    """
    _, raised, last = message.rpartition("Traceback (most recent call last)")
    if raised:  # in a BSDF of ours
        message = message[: -len(raised + last)] + RAISED.sub("", last.strip().splitlines()[-1])
    text = printable(" ".join(SOURCE.sub("", message).split()))
    return LONG.sub(r'"\1..."', text)


def _sentence(path: Path, message: str) -> str:
    text = one_line(message)
    if found := SYNTAX.search(text):
        return f"{_place(path, found[1], found[3])}the XML can't be parsed: {found[2]}"
    if found := WHOLE.search(text):
        return _place(path, found[1], None) + text[found.end() :]
    places = list(PLACE.finditer(text))
    if not places:
        return f"{path}: {text or 'can not be loaded'}"
    where = _place(path, places[-1][1], places[-1][2])
    return where + PLUGIN.sub(r"\1 '\2': ", text[places[-1].end() :])


def _place(path: Path, file: str, line: str | None) -> str:
    """The beginning of a sentence: the scene as the user names it, and where in which file."""
    part = Path(file)
    if part.is_relative_to(path.parent):
        part = part.relative_to(path.parent)
    where = [] if Path(file) == path else [str(part)]
    where += [f"line {line}"] if line else []
    return f"{path}: " + (f"{', '.join(where)}: " if where else "")
