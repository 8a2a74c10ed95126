"""Odd inputs are loaded or refused in one sentence; and a fault would be seen.

A slice of what ``make fuzz`` does with thousands of inputs, in one child.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fuzz.inputs import Input
from fuzz.kinds import KINDS, shares, some
from fuzz.run import judged
from fuzz.watch import LOADED, Child

INPUTS = 60
SEED = 15
PLANTED = {
    "traceback": "traceback (IndexError)",
    "wrong": "wrong",
    "lines": "message",
    "nameless": "nameless",
    "crash": "crash (SIGABRT)",
    "hang": "hang (over 1 s)",
    "memory": "memory (over 600 MiB)",
}


@pytest.fixture(scope="module")
def child() -> Iterator[Child]:
    """One for all kinds, but where one of its inputs ends it."""
    one = Child()
    yield one
    one.end()


@pytest.mark.parametrize("kind", KINDS)
def test_odd_inputs_are_loaded_or_refused(kind, child):
    inputs = some(kind, shares(INPUTS)[kind], SEED)
    for one, outcome in zip(inputs, judged(inputs, child), strict=True):
        assert not outcome.is_fault, (one.kind, list(one.files), one.arguments, outcome)


def test_the_same_seed_makes_the_same_inputs():
    assert some("suites (TOML)", 20, SEED) == some("suites (TOML)", 20, SEED)


@pytest.mark.parametrize("how", PLANTED)
def test_a_planted_fault_is_seen(how, child, tmp_path):
    """It is kept, with the command that repeats it, and the next input finds a child again."""
    limits = {"hang": {"seconds": 1.0}, "memory": {"memory": 600 << 20}}
    if how in limits:
        child = Child(**limits[how])
    faulty = Input("planted", {"a": b"content"}, (how,))
    good = Input("planted", {"a": b""}, ("nothing",))
    first, second = judged([faulty, good], child, tmp_path)
    child.end() if how in limits else None
    assert first.what == PLANTED[how] and second.what == LOADED
    assert Input.read(tmp_path / "00000") == faulty and not (tmp_path / "00001").exists()
    assert f"--again {tmp_path / '00000'}" in (tmp_path / "00000" / "fault.txt").read_text()
