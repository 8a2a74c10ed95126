"""How fast, as ratios within one run: nothing here is asserted about time.

Skipped unless benchmarks are asked for (``make bench``). The fields are timed beside plain NumPy
and a Numba loop over the same pairs; NumPy has a smaller grid, so compare pairs a second.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lightloc
import render
from lightloc import Grid, intensity_distance

rivals = pytest.importorskip("rivals")

OBSERVATIONS, CELLS, FEW_CELLS = 4096, 64, 16  # along each axis
ROUNDS = 3


class Field:
    """One unoccluded, diffuse field and the three ways to compute it."""

    def __init__(self, room: render.Room) -> None:
        self.q = render.observe(room, points=OBSERVATIONS, seed=1, transport="direct")
        low, high = room.bounds
        self.grid = Grid(low, high, (CELLS,) * 3).points
        self.few = Grid(low, high, (FEW_CELLS,) * 3).points
        albedo = np.broadcast_to(self.q.material.parameters()["albedo"], (OBSERVATIONS, 1))
        self.arrays = (
            self.q.positions.astype(np.float32),
            self.q.normals.astype(np.float32),
            (np.pi * self.q.radiance / albedo)[:, 0].astype(np.float32),
        )

    def ours(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        D, L = intensity_distance(self.q, points)
        return D[:, 0], L[:, 0]

    def numpy(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return rivals.numpy_field(*self.arrays, points.astype(np.float32))

    def numba(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, n, I0 = self.arrays
        columns = (np.ascontiguousarray(c) for c in (*x.T, *n.T))
        return rivals.numba_field(*columns, I0, points.astype(np.float32))


@pytest.fixture(scope="module")
def field(load) -> Field:
    return Field(load("box_three"))


def timed(benchmark: Any, pairs: int, run: Callable[[], Any]) -> Any:
    """Run after one warm-up; pairs a second go into the report."""
    result = benchmark.pedantic(run, rounds=ROUNDS, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["pairs_a_second"] = pairs / benchmark.stats.stats.min
    return result


@pytest.mark.benchmark(group="intensity_distance")
@pytest.mark.parametrize("who", ["ours", "numba", "numpy"])
def test_field(who, field, benchmark):
    """D and L on 64^3 positions x 4 096 observations (NumPy: 16^3)."""
    points = field.few if who == "numpy" else field.grid
    D, _ = timed(benchmark, len(points) * OBSERVATIONS, lambda: getattr(field, who)(points))
    assert np.isfinite(D).all()


@pytest.mark.benchmark(group="ratios")
def test_ratios(field, benchmark):
    """Pairs a second of the three, and their ratios, in one run; the fields agree."""
    rates, results = {}, {}
    for who, points in (("ours", field.grid), ("numba", field.grid), ("numpy", field.few)):
        run = getattr(field, who)
        run(points)
        least = np.inf
        for _ in range(ROUNDS):
            start = time.perf_counter()
            run(points)
            least = min(least, time.perf_counter() - start)
        rates[who] = len(points) * OBSERVATIONS / least
        results[who] = run(field.few)[0]
    for who in ("numba", "numpy"):
        np.testing.assert_allclose(results[who], results["ours"], rtol=1e-3)
    print()
    for who, rate in rates.items():
        print(f"{who:6} {rate / 1e9:6.3f} Gpairs/s, {rate / rates['numpy']:5.1f} x NumPy")
        benchmark.extra_info[who] = rate
    benchmark.pedantic(lambda: field.ours(field.few), rounds=1)


@pytest.mark.benchmark(group="shading_gradient")
@pytest.mark.parametrize("name", ["box_three", "box_plastic", "furnished"])
def test_gradient(name, load, benchmark):
    """S and dS/dp at all lights of a room, shadow rays included."""
    room = load(name)
    q = render.observe(room, points=OBSERVATIONS, seed=1, transport="direct")
    at = room.lights.positions
    pairs = OBSERVATIONS * len(at)
    timed(benchmark, pairs, lambda: lightloc.shading_gradient(q, at, room.geometry))


@pytest.mark.benchmark(group="localize")
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_localize(noise, load, benchmark):
    """Three lights in an empty room."""
    room = load("box_three")
    q = render.observe(room, points=OBSERVATIONS, seed=1, transport="direct", noise=noise)
    found = benchmark.pedantic(
        lambda: lightloc.localize(q, room.geometry), rounds=ROUNDS, warmup_rounds=1
    )
    assert len(found.lights) == 3


@pytest.mark.benchmark(group="remove_indirect")
def test_remove_indirect(load, benchmark):
    """Footnote 1 with 1 024 rays a point."""
    room = load("box_three")
    q = render.observe(room, points=OBSERVATIONS, spp=64, seed=1, transport="full")
    timed(benchmark, OBSERVATIONS, lambda: lightloc.remove_indirect(q, room.geometry))
