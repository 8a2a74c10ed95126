"""The list of mutants holds: each snippet stands once in its file, each test where it is said."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MUTANTS = tomllib.loads((ROOT / "tests/mutants/mutants.toml").read_text())["mutant"]
KEYS = {"name", "file", "before", "after", "test", "why"}
FOLDERS = ("lightloc", "render", "validation")
LEAST = 40  # mutants
RIGHT = {
    "name": "no-such-thing",
    "file": "lightloc/checks.py",
    "before": "TINY_VECTOR = 1e-12",
    "after": "TINY_VECTOR = 1.0",
    "test": "tests/laws/test_horizon.py::test_a_flipped_normal_is_seen",
    "why": "Short vectors would be refused.",
}


def wrong(mutant: dict[str, str]) -> str | None:
    """What is wrong with a mutant, in a few words; None where nothing is."""
    if set(mutant) != KEYS:
        return f"has {sorted(mutant)}"
    file = ROOT / mutant["file"]
    if Path(mutant["file"]).parts[0] not in FOLDERS or not file.is_file():
        return "no such file"
    whole = file.read_text()
    if whole.count(mutant["before"]) != 1:
        return "its snippet does not stand once in its file"
    broken = whole.replace(mutant["before"], mutant["after"])
    if ast.dump(parsed(broken)) == ast.dump(parsed(whole)):
        return "changes nothing"
    place, _, name = mutant["test"].partition("::")
    if not (ROOT / place).is_file() or not place.startswith("tests/"):
        return "no such test file"
    defined = [node.name for node in parsed((ROOT / place).read_text()).body if is_test(node)]
    if name.partition("[")[0] not in defined:
        return "no such test"
    if not re.fullmatch(r"[A-Z][^\n]*\.", mutant["why"]):
        return "why is no sentence"
    return None


def parsed(text: str) -> ast.Module:
    return ast.parse(text)


def is_test(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and node.name.startswith("test_")


def test_the_list_is_long_and_has_no_name_twice():
    names = [mutant["name"] for mutant in MUTANTS]
    assert len(names) >= LEAST
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in names)
    changes = {(mutant["file"], mutant["before"], mutant["after"]) for mutant in MUTANTS}
    assert len(changes) == len(MUTANTS)
    assert f"break our own code in {len(MUTANTS)} ways" in (ROOT / "Makefile").read_text()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant["name"])
def test_a_mutant_can_be_made_and_tried(mutant):
    """Its snippet stands once in its file, what becomes of it is Python and other Python, and the
    test that kills it is there."""
    assert wrong(mutant) is None


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("file", "lightloc/no.py", "no such file"),
        ("file", "tests/conftest.py", "no such file"),
        ("before", "TINY_VECTOR", "its snippet does not stand once in its file"),
        ("before", "no such line", "its snippet does not stand once in its file"),
        ("after", "TINY_VECTOR = 1e-12  # metres", "changes nothing"),
        ("test", "tests/laws/test_no.py::test_a", "no such test file"),
        ("test", "tests/laws/test_horizon.py::test_no", "no such test"),
        ("why", "because", "why is no sentence"),
        ("kind", "sign", "has"),
    ],
)
def test_a_wrong_one_is_seen(key, value, said):
    """Negative control: a list that has come to differ from the code is noticed."""
    assert wrong(RIGHT) is None
    assert (wrong(RIGHT | {key: value}) or "").startswith(said)
