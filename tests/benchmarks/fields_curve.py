"""How long exact D and L take as grids and samples grow: writes fields.md and fields.json.

    python tests/benchmarks/fields_curve.py [-o DIR] [--largest 512]

Each field is computed with culling, whole. In the same run all pairs are evaluated on blocks of
its cells, drawn at random: there the two must agree, and their time is scaled by the number of
pairs to that of the whole grid. Then come the plane of section 4.1, beside Numba and NumPy, and
what occluders add to it. ``LIGHTLOC_BACKEND=cuda`` runs it on a GPU.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import test_speed

import render
from lightloc import Grid, backend
from lightloc.fields.field import Field
from lightloc.optics.kernel import Surfels, surfels

ROOM = "box_three"
GRIDS, SAMPLES = (64, 128, 256), (4_000, 15_000, 60_000)
BLOCK, BLOCKS = 32, 6  # cells along an axis, and how many: 200 000 points
SEED = 4
WARM = 1e7  # points: larger fields run long enough to hide their compilation
SAME_D = 1e-6  # relative
COLUMNS = {
    "grid": "Grid",
    "observations": "Observations",
    "seconds": "Seconds",
    "all_pairs": "All pairs, seconds (scaled)",
    "ratio": "Ratio",
    "different": "Limiters that differ (ties)",
}


def seconds(run: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


def block(grid: Grid, first: np.ndarray) -> Grid:
    """``BLOCK`` cells of it along each axis."""
    lower = grid.lower + first * grid.step
    return Grid(lower, lower + BLOCK * grid.step, (BLOCK,) * 3)


def case(s: Surfels, B: np.ndarray, grid: Grid) -> dict[str, Any]:
    """One row of the table; raises AssertionError where culling changes the field."""
    small = Grid(grid.lower, grid.upper, (BLOCK,) * 3)
    for cull in (True, False):  # compile, or load what was compiled
        Field.over(s, small, cull=cull).limits(B)
    prepared, field = seconds(lambda: Field.over(s, grid))
    if len(field) < WARM:
        field.limits(B)
    taken, (D, L) = seconds(lambda: field.limits(B))
    D, L = D.reshape(grid.shape), L.reshape(grid.shape)

    rng = np.random.default_rng(SEED)
    spent, different = 0.0, 0
    for first in rng.integers(0, np.array(grid.shape) - BLOCK + 1, (BLOCKS, 3)):
        every = Field.over(s, block(grid, first), cull=False)
        t, (d, l) = seconds(lambda every=every: every.limits(B))
        spent += t
        here = tuple(slice(i, i + BLOCK) for i in first)
        np.testing.assert_allclose(D[here].ravel(), d[:, 0], rtol=SAME_D)
        other = L[here].ravel() != l[:, 0]
        different += int(other.sum())
        np.testing.assert_array_equal(D[here].ravel()[other], d[other, 0])  # ties, bit for bit
    scaled = spent * len(field) / (BLOCKS * BLOCK**3)
    return {
        "grid": f"{grid.shape[0]}³",
        "observations": s.n,
        "seconds": prepared + taken,
        "all_pairs": scaled,
        "ratio": scaled / (prepared + taken),
        "different": f"{different} of {BLOCKS * BLOCK**3}",
        "pairs_a_second": len(field) * s.n / (prepared + taken),
    }


def curve(largest: int) -> list[dict[str, Any]]:
    """All grids and samples, and the largest grid with the largest sample."""
    room = render.load(ROOM)
    low, high = room.bounds
    rows = []
    for n in SAMPLES:
        q = render.observe(room, points=n, seed=1, transport="direct")
        s = surfels(q)
        sizes = GRIDS if n < max(SAMPLES) or largest in GRIDS else (*GRIDS, largest)
        for size in (size for size in sizes if size <= largest):
            rows.append(case(s, q.radiance, Grid(low, high, (size,) * 3)))
            row = rows[-1]
            print(
                f"{row['grid']:>5} x {n:6}: {row['seconds']:8.2f} s, all pairs "
                f"{row['all_pairs']:9.1f} s, {row['ratio']:5.1f} x; {row['different']} differ",
                flush=True,
            )
    return rows


def table(columns: dict[str, str], rows: list[dict[str, Any]]) -> str:
    def text(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    lines = [list(columns.values()), ["---"] * len(columns)]
    lines += [[text(row[name]) for name in columns] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    parser = argparse.ArgumentParser(description="Time exact fields; write fields.md, fields.json.")
    parser.add_argument("-o", "--out", type=Path, default=Path("."), help="folder to write to")
    parser.add_argument("--largest", type=int, default=512, help="cells along the largest grid")
    options = parser.parse_args()

    rows = curve(options.largest)
    plane = [
        {"who": who, "ms": 1e3 * t, "ratio": t / times["Numba"]}
        for times in [test_speed.plane_times()]
        for who, t in times.items()
    ]
    times = test_speed.occluder_times()
    discs = [
        {"discs": m, "ms": 1e3 * t, "each": 1e3 * (t - times[0]) / m if m else "-"}
        for m, t in times.items()
    ]
    about = {
        "date": datetime.now(UTC).date().isoformat(),
        "backend": backend.current().name,
        "threads": backend.dr.thread_count(),
        "drjit": backend.dr.__version__,
    }
    options.out.mkdir(parents=True, exist_ok=True)
    result = {"about": about, "curve": rows, "plane": plane, "discs": discs}
    (options.out / "fields.json").write_text(json.dumps(result, indent=1) + "\n")
    page = [
        "# Time of exact fields",
        ", ".join(f"{name} {value}" for name, value in about.items()),
        f"## Room `{ROOM}`, diffuse, nothing occludes",
        table(COLUMNS, rows),
        "## Plane: 256 × 256 grid points, 400 observations",
        table({"who": "Who", "ms": "Median, ms", "ratio": "Ratio to Numba"}, plane),
        "## The same with round occluders",
        table({"discs": "Discs", "ms": "Median, ms", "each": "Each adds, ms"}, discs),
    ]
    (options.out / "fields.md").write_text("\n\n".join(page) + "\n")
    print("\n\n".join(page))


if __name__ == "__main__":
    main()
