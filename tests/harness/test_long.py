"""What takes minutes: `make test-long`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from validation.jobs import every

ROOT = Path(__file__).parents[2]
LIGHTLOC = Path(sys.executable).with_name("lightloc")
SOLVED, LUCK = 47, 3  # of the hard set's 60 rooms; what another machine's rounding may turn

pytestmark = pytest.mark.long


def test_every_mutant_is_killed():
    """Our own code broken in each of the ways of tests/mutants fails the test that is named."""
    done = subprocess.run(
        [sys.executable, ROOT / "tests" / "mutants" / "run.py"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-2000:]


def test_the_hard_set_keeps_its_rate(tmp_path):
    """Rooms at the limit of what the search can do: as many are solved as when it was measured."""
    done = subprocess.run(
        [LIGHTLOC, "study", "hard", "-o", tmp_path], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    solved = [bool(scene.record and scene.record["solved"]) for scene in every(tmp_path / "hard")]
    assert len(solved) == 60 and sum(solved) >= SOLVED - LUCK


def test_a_diff_of_rendered_runs_names_what_was_injected():
    """Four of the fifty repetitions that were measured."""
    script = ROOT / "tests" / "two_runs.py"
    done = subprocess.run([sys.executable, script, "4"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
