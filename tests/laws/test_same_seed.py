"""Same seed, same bytes: whatever is drawn, and on however many threads it runs."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

import render

CHILD = """
import hashlib, pathlib, sys
import lightloc, render
import drjit as dr
dr.set_thread_count(int(sys.argv[1]))
room = render.load("box_mixed")
seen = render.observe(room, points=512, spp=32, seed=7, transport="full", noise=0.01)
path = pathlib.Path(sys.argv[2])
seen.save(path)
print(hashlib.sha256(path.read_bytes()).hexdigest())
"""


def digest(seen, path) -> str:
    """sha256 of the file that `Observations.save` writes."""
    seen.save(path)
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def room(load):
    return load("box_mixed")


def observe(room, seed=7):
    return render.observe(room, points=512, spp=32, seed=seed, transport="full", noise=0.01)


def test_same_seed_same_bytes(room, tmp_path):
    """Observed twice with one seed, the files are equal byte by byte."""
    first, second = (digest(observe(room), tmp_path / f"{i}.npz") for i in range(2))
    assert first == second


def test_threads_do_not_matter(room, tmp_path):
    """One thread and two, in processes of their own, write the file that this process writes."""
    children = [
        subprocess.Popen(
            [sys.executable, "-c", CHILD, str(threads), str(tmp_path / f"{threads}.npz")],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ,
        )
        for threads in (1, 2)
    ]
    digests = [child.communicate(timeout=120)[0].strip() for child in children]
    assert [child.returncode for child in children] == [0, 0]
    here = digest(observe(room), tmp_path / "here.npz")
    for threads in (1, 2):
        with np.load(tmp_path / f"{threads}.npz") as there, np.load(tmp_path / "here.npz") as mine:
            for name in mine.files:  # what differs, before the bytes tell only that something does
                np.testing.assert_array_equal(there[name], mine[name], f"{name}, {threads} threads")
    assert digests == [here] * 2


def test_another_seed_is_another_sample(room, tmp_path):
    """Negative control: another seed writes another file."""
    one, other = observe(room), observe(room, seed=8)
    assert digest(one, tmp_path / "1.npz") != digest(other, tmp_path / "2.npz")
    assert (one.positions != other.positions).any()
