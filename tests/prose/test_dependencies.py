"""What may be installed: the oldest libraries that are tested are the oldest that are allowed."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def versions(file: str) -> dict[str, str]:
    """name: version of a file of pins."""
    lines = (ROOT / file).read_text().split()
    return dict(line.lower().split("==") for line in lines)


def bounds() -> dict[str, str]:
    """name: the least version that a user may have, of all that is asked for at run time."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *project["optional-dependencies"]["cluster"]]
    found = (re.match(r"([\w-]+)>=([\d.]+)", line) for line in asked)
    return {match[1].lower(): match[2] for match in found if match}


def test_the_oldest_that_are_tested_are_the_oldest_allowed():
    oldest = versions("requirements.oldest")
    assert set(oldest) == set(bounds())
    for name, least in bounds().items():
        assert oldest[name].startswith(least), name


def test_the_lock_keeps_to_the_bounds():
    """Each library that is asked for is pinned, not below its bound."""
    locked = versions("requirements.lock")
    for name, least in bounds().items():
        pinned, bound = ([int(n) for n in v.split(".")] for v in (locked[name], least))
        assert pinned >= bound, name
