"""The arrows between the folders, and what an import may change."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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
    done = subprocess.run([linter], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout


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
