"""What a search costs, and how that grows: writes search.md and search.json.

    python tests/benchmarks/search_curve.py [-o DIR] [--largest 1000000]

The cost is counted, whatever else the machine is doing: passes of the local solver, pairs of an
observation and a light that were shaded, and rays. Beside it stands the floor: the time of so many
rays alone, at the rate that is measured in the same run. Then observations, lights and triangles
grow, each alone, in a bumpy room of the run's own; the exponent is that of a power law through the
last three points.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import lightloc
from lightloc.fit import batched
from lightloc.optics.kernel import surfels
from lightloc.optics.transport import shadows

sys.path.insert(0, str(Path(__file__).parents[1]))

import drjit as dr
import rooms.loader as loader
from rooms.shapes import joined, points, sheet, steps

ROOMS = {"arches": 6, "stairs": 5, "plants": 4, "library": 5, "clutter": 6}  # lights of each
OBSERVATIONS = (1_000, 4_000, 16_000, 64_000, 250_000, 1_000_000)
LIGHTS = (1, 2, 4, 8, 16, 32)
TRIANGLES = (100, 1_000, 10_000, 100_000, 1_000_000)
SEEN, LIT = 4_000, 3  # observations and lights while something else grows
WIDE, HIGH, BUMP = 4.0, 3.0, 0.1  # metres
CLEAR = 0.4  # of a light to walls, floor bumps and other lights
ERROR = 0.005  # of B, and of its mean
FOUND = 0.005  # metres
SEED = 2018


class Counted:
    """A geometry that counts the rays it is asked for."""

    def __init__(self, inner: lightloc.Geometry) -> None:
        self.inner, self.rays = inner, 0

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        self.rays += max(dr.width(x), dr.width(p))
        return self.inner.visible(x, p, active)

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        return self.inner.intersect(x, d, active)


class Passes:
    """Counts the passes of the local solver, and the pairs in them, while it is entered."""

    def __enter__(self) -> Passes:
        self.passes = self.pairs = 0
        self.plain = batched.slopes

        def counted(s: Any, positions: Any, axes: Any) -> Any:
            self.passes += 1
            self.pairs += s.n * len(positions)
            return self.plain(s, positions, axes)

        batched.slopes = counted
        return self

    def __exit__(self, *_: object) -> None:
        batched.slopes = self.plain


def rate(geometry: lightloc.Geometry, q: lightloc.Observations) -> float:
    """Shadow rays per second, in one kernel of a million."""
    s = surfels(q)
    low, high = q.bounds
    places = np.random.default_rng(SEED).uniform(low, high, (max(1, 1_000_000 // s.n), 3))
    shadows(s, places, geometry)  # compile
    start = time.perf_counter()
    shadows(s, places, geometry)
    return s.n * len(places) / (time.perf_counter() - start)


def searched(q: lightloc.Observations, geometry: lightloc.Geometry, true: np.ndarray, box: Any):
    """One search: its counts, its time, and whether it found the lights."""
    counted = Counted(geometry)
    with Passes() as solver:
        start = time.perf_counter()
        found = lightloc.localize(q, counted, bounds=box)
        seconds = time.perf_counter() - start
    apart = np.linalg.norm(true[:, None] - found.lights.positions, axis=2)
    right = len(found.lights) == len(true) and bool((apart.min(axis=1) < FOUND).all())
    rays = rate(geometry, q)
    return {
        "passes": solver.passes,
        "million pairs": round(solver.pairs / 1e6, 2),
        "million rays": round(counted.rays / 1e6, 2),
        "million rays per second": round(rays / 1e6, 2),
        "floor (s)": round(counted.rays / rays, 2),
        "seconds": round(seconds, 2),
        "right": right,
        "reason": found.reason.name,
    }


def bumpy(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed room whose floor is so many triangles."""
    n = max(1, round(np.sqrt(triangles / 2)))
    t = steps(n)
    x, y = np.meshgrid(WIDE * t, WIDE * t, indexing="ij")
    wave = np.round(8 * t) / 8
    z = BUMP * np.outer(np.abs(t - wave), np.abs(t - wave)) * 256
    u = np.array([0.0, WIDE])
    a, b = np.meshgrid(u, u, indexing="ij")
    c = np.meshgrid(u, np.array([-0.01, HIGH]), indexing="ij")
    walls = [sheet(points(c[0], v, c[1])) for v in u] + [sheet(points(v, c[0], c[1])) for v in u]
    return joined(sheet(points(x, y, z)), sheet(points(a, b, HIGH)), *walls)


def posed(triangles: int, observations: int, lights: int):
    """Such a room, its lights, and what is seen of it by Eq. 4 with noise."""
    vertices, faces = bumpy(triangles)
    geometry = loader.geometry(vertices, faces)
    rng = np.random.default_rng([SEED, triangles, observations, lights])
    corner = vertices[faces].astype(np.float32).astype(float)
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(across, axis=1)
    which = rng.choice(len(faces), observations, p=area / area.sum())
    u, v = rng.random((2, observations, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = corner[which].swapaxes(0, 1)
    x = a + u * (b - a) + v * (c - a)
    normal = across[which] / area[which, None]
    inwards = ((np.array([WIDE, WIDE, HIGH]) / 2 - x) * normal).sum(axis=1, keepdims=True)
    normal = np.where(inwards < 0, -normal, normal)
    places = np.zeros((0, 3))
    while len(places) < lights:
        p = rng.uniform([CLEAR, CLEAR, BUMP + CLEAR], [WIDE - CLEAR, WIDE - CLEAR, HIGH - CLEAR])
        if np.linalg.norm(places - p, axis=1).min(initial=np.inf) > CLEAR:
            places = np.append(places, p[None], axis=0)
    dark = lightloc.Observations(
        positions=x,
        normals=normal,
        directions=normal,
        radiance=np.zeros(observations),
        material=lightloc.Lambert(albedo=0.5),
    )
    true = lightloc.PointLights(places, rng.uniform(5, 15, lights))
    B = lightloc.radiance(dark, true, geometry)
    sigma = ERROR * (B + B.mean())
    seen = dark.with_radiance(B + sigma * rng.normal(size=B.shape), sigma)
    return seen, geometry, places, [[0, 0, 0], [WIDE, WIDE, HIGH]]


def row(**of: Any) -> dict[str, Any]:
    key = {"triangles": 100_000, "observations": SEEN, "lights": LIT} | of
    result = key | searched(*posed(**key))
    result["peak memory (GB)"] = round(
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2
    )
    print(result, flush=True)
    return result


def exponent(rows: list[dict[str, Any]], axis: str) -> float:
    x, y = np.log([[r[axis] for r in rows[-3:]], [r["seconds"] for r in rows[-3:]]])
    return float(np.polyfit(x, y, 1)[0])


def table(title: str, rows: list[dict[str, Any]]) -> str:
    names = list(rows[0])
    lines = [f"## {title}", "", "| " + " | ".join(names) + " |", "|" + " --- |" * len(names)]
    lines += ["| " + " | ".join(str(r[name]) for name in names) + " |" for r in rows]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--out", type=Path, default=Path())
    parser.add_argument("--largest", type=int, default=1_000_000, help="most observations")
    given = parser.parse_args()
    made = []
    for name, lights in ROOMS.items():
        vertices, faces, _, seen = loader.room(name)
        q = loader.observations(seen, list(range(lights)))
        box = [vertices.min(axis=0), vertices.max(axis=0)]
        of = {"room": name, "triangles": len(faces), "lights": lights}
        made.append(
            of | searched(q, loader.geometry(vertices, faces), seen["light_positions"], box)
        )
        print(made[-1], flush=True)
    curves = {
        "triangles": [row(triangles=n) for n in TRIANGLES],
        "lights": [row(lights=n) for n in LIGHTS],
        "observations": [row(observations=n) for n in OBSERVATIONS if n <= given.largest],
    }
    parts = ["# What a search costs", "", (__doc__ or "").split("\n\n", 2)[2].strip(), ""]
    parts += [table("Rooms that another renderer made", made), ""]
    for axis, rows in curves.items():
        title = f"More {axis}: seconds grow like {axis} to the {exponent(rows, axis):.2f}"
        parts += [table(title, rows), ""]
    stamp = datetime.now(UTC).isoformat(timespec="seconds")
    parts.append(f"Made {stamp} by `python tests/benchmarks/search_curve.py`.\n")
    (given.out / "search.md").write_text("\n".join(parts))
    (given.out / "search.json").write_text(json.dumps({"rooms": made, **curves}, indent=1) + "\n")


if __name__ == "__main__":
    main()
