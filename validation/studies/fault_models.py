"""Rooms in three dimensions of which something is believed that is not so.

Each maker draws a room and returns a `Fault`: what is believed of it, and the B of the true one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc import BRDF, Conductor, Lambert, Mixed, Observations, Plastic, PointLights
from validation.rooms import REGIONS, BlockRoom, Blocks, block_room, under
from validation.studies.lamps import (
    ceiling_panel,
    lamps,
    led_over_plane,
    over_floor,
    patches,
    window,
)

POINTS = 1500  # observations of a room
BLOCKS, MOST_LIGHTS = 2, 3
TILT = np.radians(5.0)  # of the normals of a region
GAMMA = 2.2
GLOSSY = Plastic(alpha=0.2, diffuse=0.4)
WALLS = (0.7, 0.5, 0.4)  # albedos of ceiling, walls and furniture

FURNITURE = REGIONS.index("furniture")

Rng = np.random.Generator


@dataclass(frozen=True, eq=False)
class Fault:
    """A room that is not as believed.

    Parameters
    ----------
    q
        What is believed of the observations, with the B of the true room, and no noise.
    geometry
        What is believed to occlude.
    lights
        The true ones.
    more
        How many lights besides them an answer may have.
    region
        What may hold lights; None where the observations say it.
    wild
        Observations that are no measurements at all, far too bright: their indices.
    """

    q: Observations
    lights: PointLights
    geometry: Blocks | None
    more: int = 0
    region: NDArray[np.float64] | None = None
    wild: tuple[int, ...] = ()

    def right(self) -> Observations:
        """The observations as they would be if the room were as believed."""
        return under(self.q, self.lights, self.geometry)


def materials(
    floor: BRDF = GLOSSY, walls: float = WALLS[1], furniture: BRDF | None = None
) -> tuple[BRDF, ...]:
    """Of the four regions of a room."""
    return floor, Lambert(WALLS[0]), Lambert(walls), furniture or Lambert(WALLS[2])


def room_of(number: int, rng: Rng, blocks: int = BLOCKS) -> BlockRoom:
    """One light, two and three in turn."""
    return block_room(blocks, number % MOST_LIGHTS + 1, rng)


def nothing(number: int, rng: Rng) -> Fault:
    """The control: all is as believed."""
    room = room_of(number, rng)
    return Fault(room.seen(POINTS, materials(), rng), room.lights, room.geometry)


def one_firefly(number: int, rng: Rng) -> Fault:
    """All is as believed, but for one value that is far too bright."""
    fault = nothing(number, rng)
    return replace(fault, wild=(int(rng.integers(len(fault.q))),))


def believing(number: int, rng: Rng, true: tuple[BRDF, ...], believed: tuple[BRDF, ...]) -> Fault:
    """Materials that are others than believed."""
    room = room_of(number, rng)
    q = room.seen(POINTS, true, rng)
    return Fault(replace(q, material=Mixed(believed, q.regions)), room.lights, room.geometry)


def off(number: int, size: float) -> float:
    """A factor that is larger and smaller than 1 in turn."""
    return 1 + size if number // MOST_LIGHTS % 2 else 1 - size


def albedo(size: float) -> Callable[[int, Rng], Fault]:
    """The albedo of the walls or of the furniture is believed to be off by that share."""

    def make(number: int, rng: Rng) -> Fault:
        factor = off(number, size)
        wrong = (
            materials(walls=WALLS[1] * factor)
            if number % 2
            else materials(furniture=Lambert(WALLS[2] * factor))
        )
        return believing(number, rng, materials(), wrong)

    return make


def roughness(size: float) -> Callable[[int, Rng], Fault]:
    """The roughness of a floor of plastic or of metal furniture is believed to be off."""

    def make(number: int, rng: Rng) -> Fault:
        def of(alpha: float) -> tuple[BRDF, ...]:
            if number % 2:
                return materials(floor=Plastic(alpha=alpha, diffuse=0.4))
            return materials(floor=Conductor(alpha=alpha, specular=0.8))

        return believing(number, rng, of(0.25), of(0.25 * off(number, size)))

    return make


def lambert(number: int, rng: Rng) -> Fault:
    """A glossy floor is believed to be diffuse."""
    return believing(number, rng, materials(), materials(floor=Lambert(GLOSSY.diffuse)))


def normals(number: int, rng: Rng) -> Fault:
    """The normals of each wall and of each side of a block are believed to be 5 degrees off."""
    fault = nothing(number, rng)
    faces = np.unique(
        np.column_stack([fault.q.regions, fault.q.normals]).round(6), axis=0, return_inverse=True
    )[1].ravel()
    aside = np.cross(fault.q.normals, rng.normal(size=(faces.max() + 1, 3))[faces])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    turned = np.cos(TILT) * fault.q.normals + np.sin(TILT) * aside
    return replace(fault, q=replace(fault.q, normals=turned, facets=turned))


def missing(number: int, rng: Rng) -> Fault:
    """Of two blocks, the one that is not believed to be there is not observed either."""
    room = room_of(number, rng)
    fewer = room.without_block()
    q = room.seen(2 * POINTS, materials(), rng)
    on_it = (q.regions == FURNITURE) & (fewer.geometry.clearance(q.positions) > 1e-9)
    return Fault(q.at(np.flatnonzero(~on_it)[:POINTS]), room.lights, fewer.geometry)


def extra(number: int, rng: Rng) -> Fault:
    """A block is believed to be there that is not; what it would stand on is not observed."""
    room = room_of(number, rng)
    fewer = room.without_block()
    q = fewer.seen(2 * POINTS, materials(), rng)
    free = ~room.geometry.inside(q.positions + 1e-6 * q.normals)
    return Fault(q.at(np.flatnonzero(free)[:POINTS]), room.lights, room.geometry)


def gamma(number: int, rng: Rng) -> Fault:
    """B is as of a screen."""
    fault = nothing(number, rng)
    most = fault.q.radiance.max()
    return replace(
        fault, q=fault.q.with_radiance(most * (fault.q.radiance / most) ** (1 / GAMMA), 0.0)
    )


def lit_by(make: Callable[[BlockRoom, Observations, Rng], tuple]) -> Callable[[int, Rng], Fault]:
    """Light that is not that of isotropic points."""

    def maker(number: int, rng: Rng) -> Fault:
        room = room_of(number, rng)
        q, lights, more = make(room, room.seen(POINTS, materials(), rng), rng)
        return Fault(q, lights, room.geometry, more)

    return maker


def floor_alone(lamp: Callable[[Rng], tuple]) -> Callable[[int, Rng], Fault]:
    """Lamps over a floor, of which alone anything is seen."""

    def maker(number: int, rng: Rng) -> Fault:
        q, lights, region = lamp(rng)
        return Fault(q, lights, None, region=region)

    return maker


MODELS: Mapping[str, Callable[[int, Rng], Fault]] = {
    "right": nothing,
    "firefly": one_firefly,
    "albedo-10": albedo(0.1),
    "albedo-30": albedo(0.3),
    "roughness-20": roughness(0.2),
    "roughness-50": roughness(0.5),
    "lambert": lambert,
    "normals": normals,
    "missing": missing,
    "extra": extra,
    "lamp-walls": lit_by(lamps),
    "lamp-floor": floor_alone(over_floor),
    "area": lit_by(patches),
    "window": lit_by(window),
    "gamma": gamma,
    "panel": lit_by(ceiling_panel),
    "led": floor_alone(led_over_plane),
}
