"""Triangles for rooms, the same bits on every machine.

Only sums, products, quotients, square roots and roundings are used, one array at a time: these
are exact to the last bit everywhere, which numpy's own sines and matrix products are not. For the
same reason random numbers are drawn as `uniform` does it. A part is a pair (vertices (v, 3),
faces (f, 3)); z is up, angles are in turns, lengths in metres.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field

import numpy as np

GRID = 2.0**-14
"""Vertices are rounded to multiples of this: 0.06 mm, exact in float32 up to 1 km."""

TERMS = 15
"""Of the power series of a sine: up to half a turn the next one is below 1e-17."""

Part = tuple[np.ndarray, np.ndarray]


def steps(n: int) -> np.ndarray:
    """n + 1 numbers from 0 to 1, evenly spaced."""
    return np.arange(n + 1) / n


def uniform(rng: np.random.Generator, low: float, high: float, shape=None):
    """Random numbers between low and high."""
    return low + (high - low) * rng.random(shape)


def circle(turns) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine of an angle in turns."""
    x = 2 * np.pi * (turns - np.round(turns))
    cos, sin = np.ones_like(x), np.ones_like(x)
    for i in range(TERMS, 0, -1):
        cos = 1 - cos * x * x / ((2 * i - 1) * (2 * i))
        sin = 1 - sin * x * x / ((2 * i) * (2 * i + 1))
    return cos, x * sin


def points(x, y, z) -> np.ndarray:
    """Coordinates that broadcast, as (..., 3) points."""
    return np.stack(np.broadcast_arrays(x, y, z), -1).astype(float)


def sheet(grid: np.ndarray, closed: tuple[bool, bool] = (False, False)) -> Part:
    """Two triangles between every four neighbours of (m, n, 3) points.

    ``closed``: whether the last row joins the first, and the last column the first.
    """
    m, n = grid.shape[:2]
    i, j = np.meshgrid(
        np.arange(m - (not closed[0])), np.arange(n - (not closed[1])), indexing="ij"
    )
    a, b = i * n + j, i * n + (j + 1) % n
    c, d = (i + 1) % m * n + j, (i + 1) % m * n + (j + 1) % n
    faces = np.stack([np.stack([a, b, d], -1), np.stack([a, d, c], -1)], 2)
    return grid.reshape(-1, 3), faces.reshape(-1, 3)


def joined(*parts: Part) -> Part:
    """Several parts as one."""
    first = np.cumsum([0] + [len(v) for v, _ in parts])
    return (
        np.concatenate([v for v, _ in parts]),
        np.concatenate([f + at for (_, f), at in zip(parts, first[:-1], strict=True)]),
    )


def moved(part: Part, by=(0.0, 0.0, 0.0), turn=0.0, tilt=0.0, size=1.0) -> Part:
    """A part resized (by one number or three), tilted about y, turned about z, then moved."""
    vertices, faces = part
    x, y, z = (vertices * np.asarray(size, float)).T
    c, s = circle(np.float64(tilt))
    x, z = c * x + s * z, c * z - s * x
    c, s = circle(np.float64(turn))
    x, y = c * x - s * y, s * x + c * y
    return points(x + by[0], y + by[1], z + by[2]), faces


def box(low, high) -> Part:
    """Twelve triangles between two corners."""
    x, y, z = ((low[i], high[i]) for i in range(3))
    corners = np.array([(a, b, c) for a in x for b in y for c in z], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return corners, np.array(faces)


def lathe(profile, sides: int, flutes: int = 0, depth: float = 0.0) -> Part:
    """What (m, 2) radii and heights sweep about z; with flutes, radii shrink by up to depth."""
    r, z = np.asarray(profile, float).T[:, :, None]
    at = np.arange(sides) / sides
    c, s = circle(at)
    groove = 1 - depth * (1 - circle(at * flutes)[0]) / 2
    return sheet(points(r * groove * c, r * groove * s, z), (False, True))


def smooth(profile, rows: int) -> np.ndarray:
    """A profile of few points made rounder: a quadratic B-spline of ``rows`` pieces a point."""
    p = np.asarray(profile, float)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = (np.arange(rows) / rows)[:, None]
    a, b, c = p[:-2, None], p[1:-1, None], p[2:, None]
    curve = ((1 - t) * (1 - t) * a + (1 + 2 * t - 2 * t * t) * b + t * t * c) / 2
    inner = curve.reshape(-1, p.shape[1])[rows // 2 : -(rows // 2)]
    return np.concatenate([p[1:2], inner, p[-2:-1]])


def ball(radius: float, rows: int, sides: int) -> Part:
    """A sphere about the origin."""
    c, s = circle(steps(rows) / 2)
    return lathe(np.stack([radius * np.maximum(s, 0), -radius * c], 1), sides)


def ring(radius: float, thick: float, sides: int, around: int, part: float = 1.0) -> Part:
    """A torus about z, of ``thick`` radius; or only that part of its turn."""
    along = np.arange(sides) / sides if part == 1 else steps(sides) * part
    (c, s), (u, v) = circle(along[:, None]), circle(np.arange(around) / around)
    r = radius + thick * u
    return sheet(points(r * c, r * s, thick * v), (part == 1, True))


def tube(start, end, radius: float, sides: int) -> Part:
    """A round bar between two points, open at its ends."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    x, y, z = end - start
    flat = np.sqrt(x * x + y * y)
    length = np.sqrt(flat * flat + z * z)
    c, s = (x / flat, y / flat) if flat > 0 else (1.0, 0.0)
    aside = np.array([-s, c, 0.0])
    over = np.array([-c * z, -s * z, flat]) / length
    c, s = circle(np.arange(sides) / sides)
    rim = radius * (c[:, None] * aside + s[:, None] * over)
    return sheet(np.stack([start + rim, end + rim]), (False, True))


@dataclass
class Pile:
    """Parts of one grey each, put together into a room's arrays."""

    parts: list[Part] = field(default_factory=list)
    greys: list[float] = field(default_factory=list)

    def add(self, part: Part, grey: float) -> None:
        """One more part, of one albedo."""
        self.parts.append(part)
        self.greys.append(grey)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices (v, 3) float32, faces (f, 3) int32 and the albedo of each face, float32.

        Vertices lie on the grid; triangles that have no area there are left out.
        """
        vertices, faces = joined(*self.parts)
        albedo = np.repeat(self.greys, [len(f) for _, f in self.parts])
        whole = np.round(vertices / GRID).astype(np.int64)
        a, b, c = (whole[faces[:, i]] for i in range(3))
        kept = np.cross(b - a, c - a).any(axis=1)
        return (
            (whole * GRID).astype("<f4"),
            faces[kept].astype("<i4"),
            albedo[kept].astype("<f4"),
        )


@dataclass(frozen=True)
class Design:
    """A room with its camera and its lights.

    Parameters
    ----------
    vertices, faces, albedo
        As `Pile.arrays` gives them.
    camera : (2, 3) array
        Where it stands and the point that it looks at, metres.
    field_of_view
        From left to right, degrees.
    positions : (k, 3) array
        Of the lights, metres.
    intensities : (k,) array
        Of the lights, W/sr.
    """

    vertices: np.ndarray
    faces: np.ndarray
    albedo: np.ndarray
    camera: np.ndarray
    field_of_view: float
    positions: np.ndarray
    intensities: np.ndarray

    def sha256(self) -> str:
        """Tells these triangles from any others."""
        parts = (self.vertices, self.faces, self.albedo)
        return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()

    @staticmethod
    def of(pile: Pile, rng: np.random.Generator, camera, field_of_view, positions) -> Design:
        """The room of a pile, its lights' intensities drawn within a factor of 4."""
        intensities = np.round(uniform(rng, 4.0, 16.0, len(positions)), 2)
        return Design(
            *pile.arrays(), np.array(camera, float), field_of_view, np.array(positions), intensities
        )
