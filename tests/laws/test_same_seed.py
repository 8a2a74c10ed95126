"""Same seed, same bytes: whatever is drawn, and on however many threads it runs."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import drjit as dr
import numpy as np
import pytest

import lightloc
import render
from lightloc.search.ground import Ground
from render.variant import use_mitsuba
from validation.rooms.plane import rooms

CHILD = """
import hashlib, pathlib, sys
import lightloc, render
import drjit as dr
dr.set_thread_count(int(sys.argv[1]))
others = [render.load(name) for name in sys.argv[3:]]
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
    """One thread and two, in processes of their own, write the file that this process writes;
    the second process has loaded other scenes before."""
    children = [
        subprocess.Popen(
            [sys.executable, "-c", CHILD, str(threads), str(tmp_path / f"{threads}.npz"), *others],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ,
        )
        for threads, others in ((1, ()), (2, ("furnished", "box_mixed", "box_plastic")))
    ]
    digests = [child.communicate(timeout=120)[0].strip() for child in children]
    assert [child.returncode for child in children] == [0, 0]
    here = digest(observe(room), tmp_path / "here.npz")
    for threads in (1, 2):
        with np.load(tmp_path / f"{threads}.npz") as there, np.load(tmp_path / "here.npz") as mine:
            for name in mine.files:  # what differs, before the bytes tell only that something does
                np.testing.assert_array_equal(there[name], mine[name], f"{name}, {threads} threads")
    assert digests == [here] * 2


KINDS = (
    {"type": "diffuse"},
    {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3},
    {"type": "roughplastic", "distribution": "ggx", "alpha": 0.2},
    {"type": "principled", "roughness": 0.3},
)


def tiles(order) -> tuple[render.Room, list[int]]:
    """Four squares on the ground, each of another BSDF, and Mitsuba's numbers of these, which
    follow the order that the BSDFs are made in."""
    use_mitsuba()
    import mitsuba as mi

    made = {i: mi.load_dict(KINDS[i]) for i in order}
    parts = {"type": "scene"}
    for i in range(len(KINDS)):
        there = mi.ScalarTransform4f().translate([3 * i, 0, 0])
        parts[f"tile_{i}"] = {"type": "rectangle", "to_world": there, "bsdf": made[i]}
    scene = mi.load_dict(parts, optimize=False)
    lights = lightloc.PointLights([[1.0, 0.5, 2.0], [8.0, -0.5, 1.0]], [3.0, 2.0])
    dark = render.Room("tiles", Path("tiles"), {}, scene, lights, render.SceneGeometry(scene))
    ids = [int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(made[i]))[0]) for i in range(len(KINDS))]
    return render.relight(dark, lights), np.argsort(ids).tolist()


def test_the_order_of_loading_does_not_matter(tmp_path):
    """Mitsuba loads a scene's parts side by side, so that its numbers of the BSDFs differ from
    run to run. The same room, its BSDFs made in four orders, gives the same file."""
    orders = [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2], [2, 0, 3, 1]]
    made = [tiles(order) for order in orders]
    assert len({tuple(numbers) for _, numbers in made}) > 1  # else the test sees nothing
    seen = [observe(room) for room, _ in made]
    assert isinstance(seen[0].material, lightloc.Mixed)
    first, *others = (digest(q, tmp_path / f"{i}.npz") for i, q in enumerate(seen))
    assert others == [first] * 3


def test_another_seed_is_another_sample(room, tmp_path):
    """Negative control: another seed writes another file."""
    one, other = observe(room), observe(room, seed=8)
    assert digest(one, tmp_path / "1.npz") != digest(other, tmp_path / "2.npz")
    assert (one.positions != other.positions).any()


def test_another_seed_is_another_sample_of_the_observations():
    """What a search looks at first is drawn by its seed, and by nothing else."""
    q, o = rooms(2, count=1)[0].observe(300), lightloc.Options(sample=200)
    one, again, other = (Ground.of(q, None, q.bounds, o, seed).some for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert set(one.tolist()) != set(other.tolist())
    assert len(set(other.tolist())) == 200
