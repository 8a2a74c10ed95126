"""2D rooms with known lights: the data set of section 6.1, and rooms that are not square.

Side 1, and f = 1 (`Lambert` of albedo pi): the paper says neither. Same seed, same rooms; a longer
list begins with the shorter one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Lambert, Observations, Outline, PointLights, radiance
from lightloc.optics import surfels
from lightloc.plane import Loop

COUNTS = (2, 3, 4, 5)  # lights in a room (section 6.1)
PER_COUNT = 100  # rooms for each of them (section 6.1)
INTENSITIES = (1.0, 5.0)  # the range of a light's (section 6.1)
CLEARANCE = 0.05  # of the side, between lights, and from them to a wall (section 6.1)
SAMPLES = 400  # observations of a room (section 4.1)
DARK = 0.01  # of the mean B: a darker point is not trusted more than one of this B is
DISC_RADII = (0.04, 0.10)  # of the side: eight of the largest fill a quarter of the room
SEED = 2018  # the paper's year
ROOM, NOISE = 0, 1  # streams of random numbers
ATTEMPTS = 10_000  # at placing the lights before a room counts as full
ATTEMPTS_AT_DISCS = 512  # at placing one of them

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


@dataclass(frozen=True, eq=False)
class PlaneRoom:
    """A 2D room, and the truth about its lights.

    Parameters
    ----------
    name
        As ``square-3-017``: the make, the number of lights, the room's own number.
    outline
        Its surface, side 1.
    lights
        In the plane z = 0.
    seed
        Of the room's noise.
    """

    name: str
    outline: Outline
    lights: PointLights
    seed: int

    @property
    def surface(self) -> Outline:
        """What distances between observations are measured along."""
        return self.outline

    @property
    def geometry(self) -> Geometry | None:
        """What can occlude: None in a convex empty room."""
        return self.outline if self.outline.occludes else None

    def observe(self, n: int = SAMPLES, noise: float = 0.0, seed: int = 0) -> Observations:
        """B by Eq. 4 at n points evenly along the outline, each seen along its normal.

        With ``noise`` = k, B is replaced by a Gaussian of mean B and standard deviation k sqrt(B)
        (section 6.1), and by 0 where that is negative. ``sigma`` is then k sqrt(B) of the B that is
        seen, of at least `DARK` of its mean; without noise it is 0.

        Examples
        --------
        >>> rooms(2, count=1)[0].observe(8).radiance.shape
        (8, 1)
        """
        positions, normals = self.outline.sample(n)
        dark = Observations(
            positions=positions,
            normals=normals,
            directions=normals,
            radiance=np.zeros(n),
            material=Lambert(albedo=np.pi),
        )
        B = radiance(surfels(dark, self.geometry, double=True), self.lights, self.geometry)
        if not noise:
            return dark.with_radiance(B, 0.0)
        jitter = np.random.default_rng([self.seed, NOISE, seed]).normal(size=B.shape)
        B = np.maximum(B + noise * np.sqrt(B) * jitter, 0.0)
        return dark.with_radiance(B, shot_noise(B, noise))


def shot_noise(B: NDArray[np.float64], k: float) -> NDArray[np.float64]:
    """The standard error k sqrt(B) of section 6.1's noise, of at least `DARK` of the mean B.

    Examples
    --------
    >>> shot_noise(np.array([0.0, 1.0, 4.0]), 0.1).round(4).tolist()
    [0.0129, 0.1, 0.2]
    """
    return k * np.sqrt(np.maximum(B, DARK * B.mean()))


def rooms(lights: int, count: int = PER_COUNT, seed: int = SEED) -> list[PlaneRoom]:
    """Square rooms with so many lights each, as in section 6.1.

    Examples
    --------
    >>> first, second = rooms(3, count=2)
    >>> first.name, len(second.lights), bool((first.outline.clearance(first.lights.positions)
    ...                                       >= CLEARANCE).all())
    ('square-3-000', 3, True)
    """
    square = Outline.polygon(SQUARE)
    return _series("square", lambda rng: square, lights, count, seed)


def data_set(seed: int = SEED, per_count: int = PER_COUNT) -> list[PlaneRoom]:
    """The 400 rooms of section 6.1: 100 each with 2, 3, 4 and 5 lights."""
    return [room for lights in COUNTS for room in rooms(lights, per_count, seed)]


def rooms_of(
    outline: Outline, lights: int, count: int = PER_COUNT, seed: int = SEED, name: str = "room"
) -> list[PlaneRoom]:
    """The same with any outline, whose longer side takes the place of the square's."""
    return _series(name, lambda rng: outline, lights, count, seed)


def rooms_with_discs(
    discs: int, lights: int, count: int = PER_COUNT, seed: int = SEED
) -> list[PlaneRoom]:
    """Square rooms with so many disc occluders each, of random places and `DISC_RADII`.

    Examples
    --------
    >>> room = rooms_with_discs(4, 2, count=1)[0]
    >>> room.name, len(room.outline.occluders)
    ('square+4-2-000', 4)
    """

    def draw(rng: np.random.Generator) -> Outline:
        outline = Outline.polygon(SQUARE)
        for _ in range(discs):
            outline = outline.with_occluders(_free_disc(outline, rng))
        return outline

    return _series(f"square+{discs}", draw, lights, count, seed)


def named_outlines() -> dict[str, Outline]:
    """Rooms of other makes, each within the unit square.

    Examples
    --------
    >>> ", ".join(named_outlines())
    'square, L, circle, stadium, curved, discs, bar'
    """
    square = Outline.polygon(SQUARE)
    bowed = np.tan(np.pi / 8 / 2)  # an eighth of a circle
    curved = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.5), (0.6, 0.5), (0.6, 0.9), (0.1, 0.9)]
    bar = Loop([(0.3, 0.45), (0.75, 0.45), (0.75, 0.5), (0.3, 0.5)])
    return {
        "square": square,
        "L": Outline.polygon([(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)]),
        "circle": Outline.circle([0.5, 0.5], 0.5),
        "stadium": Outline.polygon(
            [(0.25, 0.2), (0.75, 0.2), (0.75, 0.7), (0.25, 0.7)], [0, 1] * 2
        ),
        "curved": Outline.polygon(curved, [0, bowed, 0, -bowed, bowed, bowed]),
        "discs": square.with_occluders(
            Outline.disc([0.35, 0.4], 0.1), Outline.disc([0.7, 0.65], 0.06)
        ),
        "bar": square.with_occluders(bar),
    }


def _series(
    make: str,
    draw: Callable[[np.random.Generator], Outline],
    lights: int,
    count: int,
    seed: int,
) -> list[PlaneRoom]:
    result = []
    for number in range(count):
        own = np.random.SeedSequence([seed, lights, number])
        rng = np.random.default_rng(own)
        outline = draw(rng)
        truth = PointLights(
            _free_places(outline, lights, rng), rng.uniform(*INTENSITIES, size=lights)
        )
        name = f"{make}-{lights}-{number:03}"
        result.append(PlaneRoom(name, outline, truth, int(own.generate_state(1)[0])))
    return result


def _free_places(outline: Outline, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(count, 3) places in free space, apart from each other and from the outline."""
    low, high = outline.bounds
    apart = CLEARANCE * (high - low).max()
    places = np.zeros((0, 3))
    for _ in range(ATTEMPTS):
        if len(places) == count:
            return places
        p = rng.uniform(low, high)
        near = np.linalg.norm(places - p, axis=1).min(initial=np.inf)
        if near >= apart and outline.inside(p[None])[0] and outline.clearance(p[None])[0] >= apart:
            places = np.concatenate([places, p[None]])
    raise ValueError(f"no free place for {count} lights {apart:g} m apart")


def _free_disc(outline: Outline, rng: np.random.Generator) -> Loop:
    """A disc in free space, `CLEARANCE` away from everything."""
    low, high = outline.bounds
    side = (high - low).max()
    radii = rng.uniform(*DISC_RADII, ATTEMPTS_AT_DISCS) * side
    centres = rng.uniform(low, high, (ATTEMPTS_AT_DISCS, 3))
    fits = outline.inside(centres) & (outline.clearance(centres) >= radii + CLEARANCE * side)
    if not fits.any():
        raise ValueError("no free place for another disc")
    first = int(np.argmax(fits))
    return Outline.disc(centres[first], float(radii[first]))
