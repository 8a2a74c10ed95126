"""How fast, as ratios within one run: nothing here is asserted about time.

Skipped unless benchmarks are asked for (``make bench``). The fields are timed beside plain NumPy
and a Numba loop over the same pairs, in turns, so that all suffer the same load; NumPy has a
smaller grid in 3D, so compare pairs a second. `fields_curve.py` beside this file takes the larger
grids.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from discs import Discs

import lightloc
import render
from lightloc import Grid, Lambert, Observations, PointLights
from lightloc.fields.field import Field, limits
from lightloc.optics.kernel import surfels

rivals = pytest.importorskip("rivals")

OBSERVATIONS, CELLS, FEW_CELLS = 4096, 64, 16  # along each axis
PLANE_OBSERVATIONS, PLANE_CELLS = 400, 256  # section 4.1
ROUNDS = 3
TURNS = 21  # of milliseconds each
LIGHTS = PointLights([[0.45, 0.45, 0], [0.9, 0.2, 0], [0.1, 0.9, 0]], [2.0, 3.0, 1.0])
CENTRES = np.array(
    [[0.3, 0.3], [0.7, 0.35], [0.5, 0.7], [0.2, 0.75], [0.8, 0.8], [0.5, 0.15], [0.15, 0.5]]
)
RADIUS = 0.06  # of a disc, in a room of side 1


def square(discs: Discs | None = None) -> Observations:
    """The paper's 2D room: side 1, f = 1, 400 observations, three lights."""
    t = (np.arange(PLANE_OBSERVATIONS // 4) + 0.5) / (PLANE_OBSERVATIONS // 4)
    zero, one = np.zeros_like(t), np.ones_like(t)
    walls = ((t, zero, zero), (one, t, zero), (1 - t, one, zero), (zero, 1 - t, zero))
    normals = np.repeat([[0.0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]], len(t), axis=0)
    q = Observations(
        positions=np.concatenate([np.stack(wall, axis=1) for wall in walls]),
        normals=normals,
        directions=normals,
        radiance=np.zeros(PLANE_OBSERVATIONS),
        material=Lambert(albedo=np.pi),
    )
    return q.with_radiance(lightloc.radiance(q, LIGHTS, discs), 0.0)


def plane_grid() -> Grid:
    return Grid([0, 0, 0], [1, 1, 0], (PLANE_CELLS, PLANE_CELLS, 1))


def arrays(q: Observations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the rivals take: positions, normals, pi B / albedo."""
    albedo = np.broadcast_to(q.material.parameters()["albedo"], (len(q), 1))
    I0 = (np.pi * q.radiance / albedo)[:, 0]
    return q.positions.astype(np.float32), q.normals.astype(np.float32), I0.astype(np.float32)


def in_turns(runs: dict[str, Callable[[], Any]], turns: int) -> dict[str, float]:
    """Median seconds of each, after two warm-ups, one after the other in every turn."""
    seconds: dict[str, list[float]] = {who: [] for who in runs}
    for turn in range(turns + 2):
        for who, run in runs.items():
            start = time.perf_counter()
            run()
            if turn >= 2:
                seconds[who].append(time.perf_counter() - start)
    return {who: float(np.median(s)) for who, s in seconds.items()}


def plane_times(turns: int = TURNS) -> dict[str, float]:
    """Seconds of D and L on 256 x 256 positions x 400 observations, in one run."""
    q, grid = square(), plane_grid()
    s, points = surfels(q), plane_grid().points.astype(np.float32)
    kept, every = Field.over(s, grid), Field.over(s, grid, cull=False)
    rival = arrays(q)
    runs = {
        "ours, a Field kept": lambda: kept.limits(q.radiance),
        "ours, a new one": lambda: limits(s, q.radiance, grid),
        "ours, all pairs": lambda: every.limits(q.radiance),
        "Numba": lambda: rivals.numba_field(*rival, points),
        "NumPy": lambda: rivals.numpy_field(*rival, points),
    }
    D = runs["ours, a Field kept"]()[0][:, 0]
    for who in ("Numba", "NumPy"):
        np.testing.assert_allclose(runs[who]()[0], D, rtol=1e-3)
    numpy_alone = in_turns({"NumPy": runs.pop("NumPy")}, ROUNDS)
    return {**in_turns(runs, turns), **numpy_alone}


def occluder_times(turns: int = TURNS) -> dict[int, float]:
    """Seconds of the same field with 0 to 7 discs in the room."""
    runs = {}
    for m in range(len(CENTRES) + 1):
        discs = Discs(np.column_stack([CENTRES[:m], np.full(m, RADIUS)])) if m else None
        q = square(discs)
        kept = Field.over(surfels(q), plane_grid(), discs)
        runs[str(m)] = lambda kept=kept, B=q.radiance: kept.limits(B)
    return {int(m): seconds for m, seconds in in_turns(runs, turns).items()}


@pytest.mark.benchmark(group="plane")
def test_plane(benchmark):
    """256 x 256 positions, 400 observations: the paper's 45 ms (section 4.1)."""
    seconds = plane_times()
    print()
    for who, s in seconds.items():
        print(f"{who:20} {1e3 * s:8.2f} ms, {s / seconds['Numba']:6.2f} x Numba")
        benchmark.extra_info[who] = s
    kept = Field.over(surfels(square()), plane_grid())
    B = square().radiance
    benchmark.pedantic(lambda: kept.limits(B), rounds=TURNS, warmup_rounds=2)


@pytest.mark.benchmark(group="plane")
def test_occluders(benchmark):
    """What each occluding primitive adds to it: the paper's 8 ms."""
    seconds = occluder_times()
    print()
    for m, s in seconds.items():
        each = f", {1e3 * (s - seconds[0]) / m:6.2f} ms each" if m else ""
        print(f"{m} discs {1e3 * s:8.2f} ms{each}")
    benchmark.extra_info["seconds"] = list(seconds.values())
    benchmark.pedantic(lambda: None, rounds=1)


class Room:
    """One unoccluded, diffuse field and the three ways to compute it."""

    def __init__(self, room: render.Room) -> None:
        self.q = render.observe(room, points=OBSERVATIONS, seed=1, transport="direct")
        low, high = room.bounds
        self.grid, self.few = (Grid(low, high, (cells,) * 3) for cells in (CELLS, FEW_CELLS))
        s = surfels(self.q)
        self.kept = {g.shape: Field.over(s, g) for g in (self.grid, self.few)}
        self.every = {g.shape: Field.over(s, g, cull=False) for g in (self.grid, self.few)}

    def ours(self, grid: Grid) -> np.ndarray:
        return self.kept[grid.shape].limits(self.q.radiance)[0][:, 0]

    def all_pairs(self, grid: Grid) -> np.ndarray:
        return self.every[grid.shape].limits(self.q.radiance)[0][:, 0]

    def numpy(self, grid: Grid) -> np.ndarray:
        return rivals.numpy_field(*arrays(self.q), grid.points.astype(np.float32))[0]

    def numba(self, grid: Grid) -> np.ndarray:
        return rivals.numba_field(*arrays(self.q), grid.points.astype(np.float32))[0]


@pytest.fixture(scope="module")
def field(load) -> Room:
    return Room(load("box_three"))


def timed(benchmark: Any, pairs: int, run: Callable[[], Any]) -> Any:
    """Run after one warm-up; pairs a second go into the report."""
    result = benchmark.pedantic(run, rounds=ROUNDS, warmup_rounds=1)
    if benchmark.stats:
        benchmark.extra_info["pairs_a_second"] = pairs / benchmark.stats.stats.min
    return result


@pytest.mark.benchmark(group="intensity_distance")
@pytest.mark.parametrize("who", ["ours", "all_pairs", "numba", "numpy"])
def test_field(who, field, benchmark):
    """D and L on 64^3 positions x 4 096 observations (NumPy: 16^3)."""
    grid = field.few if who == "numpy" else field.grid
    pairs = int(np.prod(grid.shape)) * OBSERVATIONS
    D = timed(benchmark, pairs, lambda: getattr(field, who)(grid))
    assert np.isfinite(D).all()


@pytest.mark.benchmark(group="ratios")
def test_ratios(field, benchmark):
    """Pairs a second of the four, and their ratios, in one run; the fields agree."""
    grids = {who: field.grid for who in ("ours", "all_pairs", "numba")} | {"numpy": field.few}
    runs = {
        who: lambda who=who, grid=grid: getattr(field, who)(grid) for who, grid in grids.items()
    }
    seconds = in_turns(runs, ROUNDS)
    for who in grids:
        np.testing.assert_allclose(getattr(field, who)(field.few), field.ours(field.few), rtol=1e-3)
    print()
    for who, grid in grids.items():
        rate = int(np.prod(grid.shape)) * OBSERVATIONS / seconds[who]
        benchmark.extra_info[who] = rate
        print(f"{who:10} {rate / 1e9:8.3f} Gpairs/s")
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
    """Footnote 1 with 1 024 rays per point."""
    room = load("box_three")
    q = render.observe(room, points=OBSERVATIONS, spp=64, seed=1, transport="full")
    timed(benchmark, OBSERVATIONS, lambda: lightloc.remove_indirect(q, room.geometry))
