"""Light that is not that of isotropic points: narrow lamps, panels, windows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc import Lambert, Observations, PointLights, shading
from validation.rooms import BlockRoom, Blocks

NARROW = (1.0, 15.0)  # m of cos^m
ASIDE = np.radians(60.0)  # the most that an axis is off straight down among walls
LITTLE = np.radians(20.0)  # the same over a floor alone
SPOTS = 8  # points along each side of a patch
WIDE = (0.4, 0.8)  # the sides of a patch, metres
WINDOW, SILL = (1.0, 1.5), 0.9  # metres: its sides, and how high it begins
SHARE = (0.5, 1.0)  # of the brightest light's intensity: a window's, straight ahead
BEHIND = 0.01  # metres from a wall to the light of a window, or from a ceiling to a panel
PANEL, PANEL_HEIGHT, PANEL_POWER = 0.6, 2.49, 20.0  # metres; W/sr straight down
FLOOR, POINTS = 4.0, 1000  # its side in metres, and observations of it
TARGET = np.array([0.3, 0.3, 0.0])  # a small plane below an LED, metres
LED = np.array([0.21, 0.11, 0.45])
DOWN = np.array([0.0, 0.0, -1.0])

Array = NDArray[np.float64]
Rng = np.random.Generator


def shone(
    q: Observations,
    lights: PointLights,
    axes: Array | None = None,
    power: float = 1.0,
    geometry: Blocks | None = None,
) -> Observations:
    """The observations with B of lamps of I cos^power about (k, 3) axes; of points without them."""
    S = shading(q, lights.positions, geometry)[:, :, 0]
    if axes is not None:
        away = q.positions[:, None] - lights.positions
        cosine = (away * axes).sum(axis=2) / np.linalg.norm(away, axis=2)
        S = S * np.maximum(cosine, 0.0) ** power
    return q.with_radiance(S @ lights.intensities, 0.0)


def about(axis: Array, most: float, rng: Rng) -> Array:
    """A direction at most so far off an axis, evenly over that cone."""
    t = rng.uniform(np.cos(most), 1.0)
    side = np.cross(axis, rng.normal(size=3))
    return np.asarray(t * axis + np.sqrt(1 - t * t) * side / np.linalg.norm(side))


def narrow(rng: Rng) -> float:
    """An m, as often below 4 as above."""
    return float(np.exp(rng.uniform(*np.log(NARROW))))


def lamps(room: BlockRoom, q: Observations, rng: Rng) -> tuple[Observations, PointLights, int]:
    """The lights are lamps of cos^m, all of one make, each with an axis of its own."""
    axes = np.array([about(DOWN, ASIDE, rng) for _ in range(len(room.lights))])
    return shone(q, room.lights, axes, narrow(rng), room.geometry), room.lights, 0


def patches(room: BlockRoom, q: Observations, rng: Rng) -> tuple[Observations, PointLights, int]:
    """Each light is spread over a square patch of any direction, every point of it isotropic."""
    places = []
    for p in room.lights.positions:
        u, v, _ = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        places.append(_patch(p, rng.uniform(*WIDE) * u, rng.uniform(*WIDE) * v))
    spread = np.concatenate(places)
    points = PointLights(spread, np.repeat(room.lights.intensities[:, 0] / SPOTS**2, SPOTS**2))
    return shone(q, points, geometry=room.geometry), room.lights, 0


def window(room: BlockRoom, q: Observations, rng: Rng) -> tuple[Observations, PointLights, int]:
    """Daylight comes through a window in one wall; an answer may have a light there."""
    size = room.geometry.size
    axis, far = rng.integers(2), rng.integers(2)
    along = 1 - axis
    sides = np.array([rng.uniform(*WINDOW), size[2] - SILL - 0.2])
    centre = np.zeros(3)
    centre[axis] = size[axis] - BEHIND if far else BEHIND
    centre[along] = rng.uniform(sides[0] / 2, size[along] - sides[0] / 2)
    centre[2] = SILL + sides[1] / 2
    spots = _patch(centre, sides[0] * np.eye(3)[along], sides[1] * np.eye(3)[2])
    inward = np.eye(3)[axis] * (-1.0 if far else 1.0)
    straight = rng.uniform(*SHARE) * room.lights.intensities.max() / SPOTS**2
    daylight = shone(
        q,
        PointLights(spots, np.full(len(spots), straight)),
        np.tile(inward, (len(spots), 1)),
        geometry=room.geometry,
    )
    off = np.abs(q.positions - centre)
    pane = (off[:, axis] < 2 * BEHIND) & (off[:, along] < sides[0] / 2) & (off[:, 2] < sides[1] / 2)
    both = q.with_radiance(q.radiance + daylight.radiance, 0.0)
    return both.at(~pane), room.lights, 1


def ceiling_panel(
    room: BlockRoom, q: Observations, rng: Rng
) -> tuple[Observations, PointLights, int]:
    """A flat panel under the ceiling, of which nothing is observed, in place of the lights."""
    low, high = np.full(2, PANEL / 2), room.geometry.size[:2] - PANEL / 2
    centre = np.append(rng.uniform(low, high), room.geometry.size[2] - BEHIND)
    spots = _patch(centre, PANEL * np.eye(3)[0], PANEL * np.eye(3)[1])
    points = PointLights(spots, np.full(len(spots), PANEL_POWER / len(spots)))
    below = q.at(q.regions != 1)
    seen = shone(below, points, np.tile(DOWN, (len(spots), 1)), geometry=room.geometry)
    return seen, PointLights(centre[None], [PANEL_POWER]), 0


def over_floor(rng: Rng) -> tuple[Observations, PointLights, Array]:
    """One lamp or two of cos^m over a floor."""
    k = int(rng.integers(1, 3))
    p = np.column_stack([rng.uniform(0.5, FLOOR - 0.5, (k, 2)), rng.uniform(1.0, 2.5, k)])
    lights = PointLights(p, rng.uniform(8.0, 24.0, k))
    axes = np.array([about(DOWN, LITTLE, rng) for _ in range(k)])
    seen = shone(_plane(FLOOR, rng), lights, axes, narrow(rng))
    return seen, lights, np.array([[0.0, 0.0, 0.05], [FLOOR, FLOOR, 3.0]])


def led_over_plane(rng: Rng) -> tuple[Observations, PointLights, Array]:
    """An LED of cos^1 45 cm above a target 30 cm wide."""
    lights = PointLights(LED[None], [0.2])
    seen = shone(_plane(TARGET[0], rng), lights, DOWN[None])
    middle, wide = TARGET / 2, np.array([0.3, 0.3, 0.0])
    region = [middle - wide + [0, 0, 0.01], middle + wide + [0, 0, 0.9]]
    return seen, lights, np.array(region)


def _plane(side: float, rng: Rng) -> Observations:
    """Random points on a floor, seen from above; dark."""
    x = np.column_stack([rng.uniform(0.0, side, (POINTS, 2)), np.zeros(POINTS)])
    up = np.tile(-DOWN, (POINTS, 1))
    return Observations(
        positions=x,
        normals=up,
        directions=up,
        radiance=np.zeros(POINTS),
        sigma=0.0,
        material=Lambert(albedo=0.6),
    )


def _patch(centre: Array, u: Array, v: Array) -> Array:
    """(SPOTS^2, 3) places over a rectangle of sides u and v."""
    at = (np.arange(SPOTS) + 0.5) / SPOTS - 0.5
    a, b = np.meshgrid(at, at)
    return np.asarray(centre + a.reshape(-1, 1) * u + b.reshape(-1, 1) * v)
