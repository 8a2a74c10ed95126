"""Rooms whose data are fully explained: diffuse, and nothing but noise is in the way."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Observations, Options, Outline, PointLights
from validation.rooms import Blocks, shot_noise
from validation.studies.crossed_rooms import Clean, flat, solid
from validation.studies.scenes import ONE_PERCENT, noise_of

ALPHA = 0.05  # the probability of a light that is not there, asked for
GRIDS = {2: (40, 40, 1), 3: (13, 13, 11)}  # places of a further light along each axis
OFF = 0.05  # of the longest side: how near to a surface they are,
NEAR = (0.01, 0.02, 0.04)  # but for some before surfaces: noise gains most where few points see it
BEFORE = 400  # of them, at each of these distances

Array = NDArray[np.float64]
Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Explained:
    """A room with noise whose standard errors are known, though not always told.

    Parameters
    ----------
    q
        What is seen, with its standard errors.
    lights
        The true ones.
    geometry
        What occludes.
    size
        The side in two dimensions, the diagonal in three.
    dimensions
        2 or 3.
    """

    q: Observations
    lights: PointLights
    geometry: Geometry | None
    size: float
    dimensions: int

    @property
    def sigma(self) -> Array:
        return self.q.known_sigma

    def told(self, stated: bool) -> Observations:
        """What a search is given: with standard errors or without."""
        return self.q if stated else self.q.with_radiance(self.q.radiance, None)

    def places(self) -> Array:
        """(g, 3) places in free space for a further light."""
        low, high = self.q.bounds
        axes = [
            np.linspace(a, b, n + 2)[1:-1] if n > 1 else np.array([a])
            for a, b, n in zip(low, high, GRIDS[self.dimensions], strict=True)
        ]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        side = float((high - low).max())
        some = slice(None, None, -(-len(self.q) // BEFORE))
        x, normals = self.q.positions[some], self.q.normals[some]
        before = np.concatenate([x + off * side * normals for off in NEAR])
        return np.concatenate(
            [
                grid[free(self.geometry, grid, OFF * side)],
                before[free(self.geometry, before, NEAR[0] / 2 * side)],
            ]
        )


def empty(dimensions: int, lights: int, rng: Rng) -> Clean:
    """A diffuse room with no occluder or one, without noise."""
    make = flat if dimensions == 2 else solid
    return make("diffuse", int(rng.integers(2)), lights, rng)


def explained(room: Clean, dimensions: int, rng: Rng, noise: float = ONE_PERCENT) -> Explained:
    """The room with noise, 1 % where nothing else is asked for."""
    B = room.q.radiance
    sigma = shot_noise(B, noise_of(room.q, noise))
    seen = room.q.with_radiance(B + sigma * rng.normal(size=B.shape), sigma)
    return Explained(seen, room.lights, room.geometry, room.size, dimensions)


def free(geometry: Geometry | None, points: Array, off: float) -> NDArray[np.bool_]:
    """Which of (g, 3) points keep so far from all surfaces of a room."""
    if isinstance(geometry, Outline):
        return np.asarray(geometry.inside(points) & (geometry.clearance(points) >= off))
    if isinstance(geometry, Blocks):
        return np.asarray(~geometry.inside(points) & (geometry.clearance(points) >= off))
    return np.ones(len(points), bool)  # an empty square, whose grid keeps off its walls


def options(alpha: float = ALPHA) -> Options:
    """The search's options at that false alarm; its own where the code has none to set."""
    given: dict[str, Any] = {"false_alarm": alpha}
    known = {field.name for field in fields(Options)}
    return Options(**{name: value for name, value in given.items() if name in known})
