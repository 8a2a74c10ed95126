"""The arrows between the folders, and what an import may change."""

from __future__ import annotations

import ast
import importlib
import os
import re
import subprocess
import sys
from itertools import chain
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("lightloc", "render", "validation")
RENDERERS = ("mitsuba", "OpenImageIO", "render", "validation")


def python(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run code in a fresh interpreter, in which no LLVM path has been chosen yet."""
    inherited = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=inherited | environment,
        timeout=120,
    )


def test_contracts():
    """validation -> render -> lightloc, as import-linter reads it in pyproject.toml."""
    linter = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run(
        [linter, "--no-cache"], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


DOORS = sorted((ROOT / "lightloc").glob("*/__init__.py")) + [
    ROOT / "validation" / room / "__init__.py"
    for room in ("jobs", "judge", "rooms", "records", "draw", "suite")
]


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.parent.name)
def test_a_door_says_what_others_may_use(door):
    """A room's `__init__` has a sentence for each name, in order, and each is used elsewhere."""
    name = ".".join(door.parent.relative_to(ROOT).parts)
    room = importlib.import_module(name)
    assert re.findall(r"^- `(\w+)`: .*\.$", room.__doc__, re.MULTILINE) == room.__all__
    assert len(set(room.__all__)) == len(room.__all__)
    used: set[str] = set()
    for file in chain(*((ROOT / top).rglob("*.py") for top in FOLDERS)):
        if door.parent in file.parents:
            continue
        tree = ast.parse(file.read_text())
        short = any(
            isinstance(node, ast.ImportFrom)
            and node.module == name.rpartition(".")[0]
            and any(alias.name == door.parent.name for alias in node.names)
            for node in ast.walk(tree)
        )
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module == name:
                used |= {alias.name for alias in node.names}
            elif short and isinstance(node, ast.Attribute):
                used.add(node.attr)
    assert not set(room.__all__) - used


def test_lightloc_without_a_renderer():
    """With mitsuba and everything above it blocked, lightloc imports and works."""
    done = python(
        f"""
import sys
for name in {RENDERERS!r}:
    sys.modules[name] = None
import lightloc
q = lightloc.Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
                          radiance=[1.0], material=lightloc.Lambert(albedo=0.5))
print(lightloc.intensity_distance(q, [[0, 0, 1]])[0].shape)
"""
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "(1, 1)"


def test_a_blocked_module_is_seen():
    """Negative control: render can't do without mitsuba."""
    done = python("import sys; sys.modules['mitsuba'] = None; import render")
    assert done.returncode != 0
    assert "mitsuba" in done.stderr


@pytest.mark.parametrize("package", ["lightloc", "render", "validation"])
def test_import_changes_nothing(package):
    """An import sets the LLVM path and nothing else.

    No Mitsuba variant, no environment variable, no random state, no folder, no warning filter, no
    logging handler, no NumPy error state.
    """
    done = python(
        f"""
import json, logging, os, sys, warnings
import numpy as np
import random
def state():
    return dict(
        environment=dict(os.environ), folder=os.getcwd(), errors=np.geterr(),
        random=hash(random.getstate()), numpy=hash(np.random.get_state()[1].tobytes()),
        handlers=len(logging.getLogger().handlers), filters=len(warnings.filters))
import scipy.optimize, scipy.spatial  # their own imports are not ours
before = state()
import {package}
after = state()
path = after["environment"].pop("DRJIT_LIBLLVM_PATH", None)
assert path is None or os.path.exists(path), path
changed = [key for key in before if before[key] != after[key]]
assert not changed, changed
if "mitsuba" in sys.modules:
    assert sys.modules["mitsuba"].variant() is None
print("as it was")
"""
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "as it was"


def test_a_path_of_ones_own_wins():
    """A DRJIT_LIBLLVM_PATH that the user has set is left alone."""
    code = "import lightloc, os; print(os.environ['DRJIT_LIBLLVM_PATH'])"
    done = python(code, DRJIT_LIBLLVM_PATH="/nowhere/libLLVM.so")
    assert done.stdout.strip() == "/nowhere/libLLVM.so", done.stderr
