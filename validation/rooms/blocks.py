"""Rooms in three dimensions in closed form: a box with blocks on its floor, seen from one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import lightloc  # noqa: F401  (before drjit: it chooses the LLVM library)
from lightloc import BRDF, Geometry, Mixed, Observations, PointLights, radiance
from lightloc.backend import types
from lightloc.optics import columns, surfels

import drjit as dr  # isort: skip

REGIONS = ("floor", "ceiling", "walls", "furniture")  # the materials' places, in their order
SMALLEST, LARGEST = (3.0, 3.0, 2.4), (5.0, 4.0, 3.0)  # metres
FOOTPRINT, HEIGHT = (0.4, 1.0), (0.5, 1.5)  # of a block, metres
CLEARANCE = 0.1  # of the longest side: lights from surfaces and from each other
BRIGHT = (8.0, 24.0)  # W/sr
ATTEMPTS = 10_000  # at a place for something before the room counts as full
FAR_END = 1e-3  # of a segment, left out: its end may lie on a surface
BARELY = 1e-9  # metres: what stands for a ray's 0, by which it can't be divided
OUTWARD = 1e-4  # metres that a point on a wall may seem to lie outside

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blocks:
    """A `Geometry`: the inside of a box of (3,) ``size`` from the origin, with blocks in it.

    ``low`` and ``high`` are (b, 3), their corners, metres.
    """

    size: Vector
    low: Vector
    high: Vector

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """As of `Geometry`; nothing is seen from outside the box."""
        free = active & types().Bool(True)
        size = _data(self.size)
        for a in range(3):
            free &= (p[a] > -OUTWARD) & (p[a] < size[a] + OUTWARD)
        d = p - x
        for near, far in self._crossed(x, d):
            free &= ~((far > dr.maximum(near, 0)) & (near < 1 - FAR_END))
        return free

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """As of `Geometry`."""
        _, first = _slab(x, d, _data(np.zeros(3)), _data(self.size))
        hit = first > 0
        for near, far in self._crossed(x, d):
            first = dr.select((near > 0) & (near < far) & (near < first), near, first)
        return hit & active, x + d * dr.select(hit, first, 0)

    def inside(self, points: Vector) -> NDArray[np.bool_]:
        """(n,) whether points lie within a block."""
        within = (points[:, None] > self.low) & (points[:, None] < self.high)
        return np.asarray(np.any(np.all(within, axis=2), axis=1))

    def clearance(self, points: Vector) -> Vector:
        """(n,) how far points in free space are from the nearest surface, metres."""
        off = np.maximum(np.maximum(self.low - points[:, None], points[:, None] - self.high), 0.0)
        walls = np.minimum(points, self.size - points).min(axis=1)
        blocks = np.linalg.norm(off, axis=2).min(axis=1, initial=np.inf)
        return np.asarray(np.minimum(walls, blocks))

    def _crossed(self, x: Any, d: Any) -> list[tuple[Any, Any]]:
        pairs = zip(self.low, self.high, strict=True)
        return [_slab(x, d, _data(low), _data(high)) for low, high in pairs]


def _data(corner: Vector) -> list[Any]:
    """Numbers that a kernel reads, rather than holds: rooms with as many blocks share one."""
    f = types()
    return [dr.opaque(f.Float, float(value)) for value in corner]


def _slab(x: Any, d: Any, low: Any, high: Any) -> tuple[Any, Any]:
    """Where the lines x + t d enter a box and leave it: t, the first below the second where they
    meet it."""
    near, far = types().Float(-np.inf), types().Float(np.inf)
    for a in range(3):
        along = dr.select(dr.abs(d[a]) < BARELY, BARELY, d[a])
        one, other = (low[a] - x[a]) / along, (high[a] - x[a]) / along
        near = dr.maximum(near, dr.minimum(one, other))
        far = dr.minimum(far, dr.maximum(one, other))
    return near, far


@dataclass(frozen=True, eq=False)
class BlockRoom:
    """A room, the truth about its lights, and where it is seen from.

    Parameters
    ----------
    geometry
        Its walls and blocks.
    lights
        One channel, W/sr.
    viewer : (3,) array
        Where it is seen from, all around.
    """

    geometry: Blocks
    lights: PointLights
    viewer: Vector

    @property
    def diagonal(self) -> float:
        return float(np.linalg.norm(self.geometry.size))

    def seen(self, n: int, materials: Sequence[BRDF], rng: np.random.Generator) -> Observations:
        """n points evenly over what the viewer sees, with the B of the lights, and no noise.

        ``materials`` are those of the `REGIONS`.
        """
        x, normals, region = self._points(n, rng)
        dark = Observations(
            positions=x,
            normals=normals,
            directions=self.viewer - x,
            radiance=np.zeros(n),
            sigma=0.0,
            material=Mixed(tuple(materials), region),
            regions=region,
            region_names=REGIONS,
        )
        return under(dark, self.lights, self.geometry)

    def without_block(self) -> BlockRoom:
        """The same room without its first block."""
        g = self.geometry
        return replace(self, geometry=Blocks(g.size, g.low[1:], g.high[1:]))

    def _points(self, n: int, rng: np.random.Generator) -> tuple[Vector, Vector, NDArray[np.intp]]:
        """Points, normals and regions of what is seen."""
        low, high, inward, region = self._faces()
        size = high - low
        area = np.where(size > 0, size, 1.0).prod(axis=1)
        found: list[tuple[Vector, NDArray[np.intp]]] = []
        while sum(len(x) for x, _ in found) < n:
            face = rng.choice(len(area), 2 * n, p=area / area.sum())
            x = low[face] + rng.random((2 * n, 3)) * size[face]
            ahead = ((self.viewer - x) * inward[face]).sum(axis=1) > 0
            free = self.geometry.visible(
                columns(x + OUTWARD * inward[face]), columns(self.viewer[None])
            )
            seen = ahead & np.array(free)
            found.append((x[seen], face[seen]))
        x, face = (np.concatenate(parts)[:n] for parts in zip(*found, strict=True))
        return x, inward[face], region[face]

    def _faces(self) -> tuple[Vector, Vector, Vector, NDArray[np.intp]]:
        """All faces: their corners, their normals into free space, and the region of each."""
        boxes = [(np.zeros(3), self.geometry.size, 1.0)]
        boxes += [(a, b, -1.0) for a, b in zip(self.geometry.low, self.geometry.high, strict=True)]
        low, high, inward, region = [], [], [], []
        for i, (a, b, sign) in enumerate(boxes):
            for axis in range(3):
                for end, side in ((a, 1.0), (b, -1.0)):
                    here = np.arange(3) == axis
                    low.append(np.where(here, end, a))
                    high.append(np.where(here, end, b))
                    inward.append(sign * side * np.eye(3)[axis])
                    region.append(3 if i else 2 if axis < 2 else 0 if side > 0 else 1)
        return np.array(low), np.array(high), np.array(inward), np.array(region)


def under(
    q: Observations, lights: PointLights, geometry: Geometry | None, sigma: float | None = 0.0
) -> Observations:
    """The observations with the B of lights, computed in 64 bits."""
    return q.with_radiance(radiance(surfels(q, geometry, double=True), lights, geometry), sigma)


def block_room(blocks: int, lights: int, rng: np.random.Generator) -> BlockRoom:
    """A room of random size with so many random blocks, and lights in free space.

    Examples
    --------
    >>> from lightloc import Lambert
    >>> room = block_room(2, 3, np.random.default_rng(0))
    >>> len(room.geometry.low), len(room.lights)
    (2, 3)
    >>> q = room.seen(100, [Lambert(albedo=0.5)] * 4, np.random.default_rng(1))
    >>> len(q), bool((room.geometry.clearance(room.lights.positions) > 0.3).all())
    (100, True)
    """
    size = rng.uniform(SMALLEST, LARGEST)
    geometry = Blocks(size, np.zeros((0, 3)), np.zeros((0, 3)))
    for _ in range(ATTEMPTS):
        if len(geometry.low) == blocks:
            break
        extent = np.append(rng.uniform(*FOOTPRINT, 2), rng.uniform(*HEIGHT))
        low = np.append(rng.uniform(0.0, size[:2] - extent[:2]), 0.0)
        if not _overlaps(geometry, low, low + extent):
            geometry = Blocks(
                size,
                np.append(geometry.low, low[None], axis=0),
                np.append(geometry.high, (low + extent)[None], axis=0),
            )
    apart = CLEARANCE * size.max()
    places = np.zeros((0, 3))
    for _ in range(ATTEMPTS):
        if len(places) == lights + 1:
            viewer, *_ = places
            shining = rng.uniform(*BRIGHT, lights)
            return BlockRoom(geometry, PointLights(places[1:], shining), viewer)
        p = rng.uniform(0.0, size)
        near = np.linalg.norm(places - p, axis=1).min(initial=np.inf)
        if near >= apart and not geometry.inside(p[None]) and geometry.clearance(p[None]) >= apart:
            places = np.append(places, p[None], axis=0)
    raise ValueError(f"no free place for {lights} lights {apart:g} m apart")


def _overlaps(geometry: Blocks, low: Vector, high: Vector) -> bool:
    across = (low < geometry.high) & (high > geometry.low)
    return bool(np.any(np.all(across, axis=1)))
