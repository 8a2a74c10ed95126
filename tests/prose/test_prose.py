"""Prose that runs: docstring examples, the pages' blocks, and the table of symbols.

On a page (the README, CONTRIBUTING.md, the book's chapters and its guides) fenced ``python`` blocks
run one after another, as one reader would type them; in ``console`` blocks the lines that begin
with ``$ lightloc`` run, in a folder of the page's own. What begins otherwise is left to readers. A
``text``, ``toml`` or ``xml`` block whose first line is a comment with a file's name is written into
that folder first. The symbol table is the Markdown table that begins ``| letter | name | file |``.
"""

from __future__ import annotations

import ast
import doctest
import functools
import importlib
import os
import pkgutil
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

import lightloc
import render
import validation

ROOT = Path(__file__).parents[2]
GUIDES = [ROOT / "docs" / "start.md", *sorted((ROOT / "docs" / "guides").glob("*.md"))]
OTHERS = [path for path in sorted((ROOT / "docs").glob("*.md")) if path not in GUIDES]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *OTHERS, *GUIDES]
METHOD = (ROOT / "docs" / "method.md").read_text()
WORDS = 900  # most of the README: one page
PACKAGES = (lightloc, render, validation)
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
RUNS_FOR = 300  # seconds at most for one shell line
NAMED = r"^```(?:text|toml|xml)\n((?:# |<!-- )([\w-]+\.\w+)(?: -->)?\n.*?)^```"
SYMBOLS = re.compile(r"\| *letter *\| *name *\| *file *\|.*\n\|[-| :]+\|\n((?:\|.*\n?)+)")


def modules() -> list[str]:
    """Names of all modules of the three packages."""
    names = [package.__name__ for package in PACKAGES]
    for package in PACKAGES:
        names += [
            module.name
            for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
            if not module.name.endswith("__main__")
        ]
    return names


def blocks(page: Path, language: str) -> list[str]:
    """A page's fenced blocks in a language."""
    fenced = rf"^```{language}\n(.*?)^```"
    return re.findall(fenced, page.read_text(), flags=re.MULTILINE | re.DOTALL)


def files(text: str) -> dict[str, str]:
    """What stands in a page's blocks that name a file in their first line, by that name."""
    return {name: body for body, name in re.findall(NAMED, text, re.M | re.S)}


def commands(text: str) -> list[str]:
    """The ``$ lightloc`` lines of console text, continued lines joined."""
    joined = text.replace("\\\n", " ")
    return [line[2:] for line in joined.splitlines() if line.startswith("$ lightloc")]


def symbols(text: str) -> list[tuple[str, str, str]]:
    """The rows (letter, name, file) of the symbol table."""
    found = SYMBOLS.search(text)
    if not found:
        return []
    rows = [re.split(r"(?<!\\)\|", row.strip().strip("|")) for row in found[1].splitlines()]
    return [(r[0].strip(), r[1].strip(" `"), r[2].strip(" `")) for r in rows]


def names_in(path: Path) -> set[str]:
    """Every function and class that a file defines."""
    nodes = ast.walk(ast.parse(path.read_text()))
    return {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def missing_symbols(rows: list[tuple[str, str, str]]) -> list[str]:
    """The rows whose name is not in their file, or whose file is not there."""
    wrong = []
    for letter, name, file in rows:
        path = ROOT / file
        parts = name.removesuffix("()").split(".")
        if not path.is_file() or not set(parts) <= names_in(path):
            wrong.append(f"{letter}: {name} is not in {file}")
    return wrong


@pytest.mark.parametrize("name", modules())
def test_docstring_examples(name):
    """Every example in a docstring gives what it says."""
    module = importlib.import_module(name)
    failed, _ = doctest.testmod(module, optionflags=FLAGS)
    assert not failed


def test_examples_exist():
    """Negative control: the examples are found at all, and a wrong one fails."""
    finder = doctest.DocTestFinder()
    tests = [t for name in modules() for t in finder.find(importlib.import_module(name))]
    assert sum(bool(t.examples) for t in tests) >= 10
    wrong = ModuleType("wrong", ">>> 1 + 1\n3\n")
    failed, tried = doctest.testmod(wrong, optionflags=FLAGS, report=False, verbose=False)
    assert (failed, tried) == (1, 1)


@pytest.mark.parametrize("name", lightloc.__all__)
def test_public_names_are_documented(name):
    """Every public name says what it is."""
    thing = getattr(lightloc, name)
    doc = thing.__doc__ or ""
    assert doc.strip(), f"lightloc.{name} has no docstring"
    assert not doc.startswith(f"{name}("), (
        f"lightloc.{name} has a dataclass's own signature for one"
    )


def test_the_readme_is_one_page():
    assert len((ROOT / "README.md").read_text().split()) <= WORDS


WITH_PYTHON = [page for page in PAGES if blocks(page, "python")]
SHELL = [(page, c) for page in PAGES for b in blocks(page, "console") for c in commands(b)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Callable[[Path], Path]:
    """A folder a page: a later line may read what an earlier one wrote."""

    @functools.cache
    def make(page: Path) -> Path:
        made = tmp_path_factory.mktemp(page.stem)
        (made / "scenes").symlink_to(ROOT / "scenes")
        for name, text in files(page.read_text()).items():
            (made / name).write_text(text)
        return made

    return make


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_PYTHON, ids=lambda page: page.name)
def test_python_blocks(page, folder, tmp_path):
    """A page's Python blocks run, in order, in a process of their own.

    A guide's run in its folder, those of other pages at the project's root.
    """
    script = tmp_path / "page.py"
    script.write_text("\n".join(blocks(page, "python")))
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=folder(page) if page in GUIDES else ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=RUNS_FOR,
    )
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize(("page", "line"), SHELL, ids=lambda value: getattr(value, "name", value))
def test_shell_lines(page, line, folder):
    """Each ``$ lightloc`` line of a page runs and ends well."""
    program = [str(Path(sys.executable).parent / "lightloc"), *shlex.split(line, comments=True)[1:]]
    done = subprocess.run(
        program, cwd=folder(page), capture_output=True, text=True, timeout=RUNS_FOR
    )
    told = (0, 3) if line.split()[1] == "localize" else (0,)  # an answer need not be sure
    assert done.returncode in told, f"$ {line}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def test_shell_lines_are_found():
    """Only ``lightloc`` runs; a continued line is one command."""
    text = "$ make report\n$ lightloc validate --case a \\\n  --out b\nlightloc: output\n"
    text += "$ lightloc -h\n"
    assert [shlex.split(c) for c in commands(text)] == [
        ["lightloc", "validate", "--case", "a", "--out", "b"],
        ["lightloc", "-h"],
    ]


def test_every_guide_runs():
    """Each page of the guides but the list of them has something that runs."""
    with_console = {page for page, _ in SHELL}
    silent = [page.name for page in GUIDES if page not in with_console | set(WITH_PYTHON)]
    assert silent == ["index.md"]


def test_files_are_found():
    """Only a block that names a file in its first line is one."""
    text = "```toml\n# a.toml\nb = 1\n```\n\n```toml\n[c]\n```\n\n"
    text += "```xml\n<!-- my_room.xml -->\n<scene/>\n```\n"
    assert files(text) == {
        "a.toml": "# a.toml\nb = 1\n",
        "my_room.xml": "<!-- my_room.xml -->\n<scene/>\n",
    }


def test_symbol_table():
    """Every letter of the paper has its name in the file that the book says."""
    assert symbols(METHOD)
    assert not missing_symbols(symbols(METHOD))


def test_a_wrong_symbol_is_seen():
    """Negative control: a name that its file does not hold, or no such file, is noticed."""
    head = "| letter | name | file |\n| --- | --- | --- |\n"
    file = "lightloc/fields/field.py"
    right = head + f"| D(p) | `intensity_distance` | `{file}` |\n"
    assert symbols(right) == [("D(p)", "intensity_distance", file)]
    assert not missing_symbols(symbols(right))
    used, gone = f"| S | `shading` | `{file}` |\n", "| V | `vote` | `lightloc/v.py` |\n"
    assert len(missing_symbols(symbols(head + used + gone))) == 2
