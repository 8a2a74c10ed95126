"""What every test may ask for: one seed, rooms, the float32 that tolerances derive from."""

from __future__ import annotations

import contextlib
import functools
import os
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lightloc  # before mitsuba: it chooses the LLVM library
import render

import drjit  # isort: skip
from render.variant import use_mitsuba

SEED = 2018


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Beside other workers each has one thread: more would wait for each other."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        drjit.set_thread_count(1)


@pytest.fixture(scope="session", autouse=True)
def ctrl_c() -> None:
    """Processes that tests start heed SIGINT, even where the suite runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def rng() -> np.random.Generator:
    """The same random numbers for every test, whatever ran before."""
    return np.random.default_rng(SEED)


@pytest.fixture(scope="session")
def eps() -> float:
    """Spacing of float32 at 1: what one rounding costs, relative."""
    return float(np.finfo(np.float32).eps)


@pytest.fixture(scope="session")
def refuses() -> Callable[[str], contextlib.AbstractContextManager[Any]]:
    """``with refuses(name):`` expects a ValueError of one plain sentence that begins with name."""

    @contextlib.contextmanager
    def check(name: str) -> Iterator[Any]:
        with pytest.raises(ValueError) as error:
            yield error
        text = str(error.value)
        assert text.startswith(name), text
        assert "\n" not in text
        said = re.sub(r"\S*/\S*", "", text.removeprefix(name))  # paths may be long
        assert len(said) < 160, text

    return check


@pytest.fixture(scope="session")
def load() -> Callable[..., render.Room]:
    """`render.load`, which reads each standard scene once a session."""
    return functools.cache(render.load)


@pytest.fixture(scope="session")
def workshop() -> Callable[..., render.Room]:
    """Make a small room whose floor (a 2 m square at z = 0) has any Mitsuba BSDF.

    A grey ceiling at z = 2 and a block that casts a shadow are in it. With ``from_behind`` the
    floor is turned over, so that its back faces the room.
    """
    use_mitsuba()
    import mitsuba as mi

    lights = lightloc.PointLights([[0.3, -0.4, 1.2], [-0.8, 0.7, 0.3]], [3.0, 1.0])

    def make(
        bsdf: Mapping[str, Any],
        lights: lightloc.PointLights = lights,
        from_behind: bool = False,
    ) -> render.Room:
        turn = mi.ScalarTransform4f()
        over = turn.rotate([1, 0, 0], 180)
        parts = {
            "type": "scene",
            "floor": {
                "type": "rectangle",
                "id": "floor",
                "to_world": over if from_behind else turn,
                "bsdf": dict(bsdf),
            },
            "ceiling": {
                "type": "rectangle",
                "id": "ceiling",
                "to_world": turn.translate([0, 0, 2]) @ over @ turn.scale(2),
                "bsdf": {"type": "diffuse"},
            },
            "block": {
                "type": "cube",
                "id": "block",
                "to_world": turn.translate([0.5, 0.3, 0.4]) @ turn.scale(0.15),
                "bsdf": {"type": "diffuse"},
            },
        }
        scene = mi.load_dict(parts, optimize=False)
        dark = render.Room(
            "workshop", Path("workshop"), {}, scene, lights, render.SceneGeometry(scene)
        )
        return render.relight(dark, lights)

    return make
