"""One scene in several variants: another unit of length, a mirror image, another order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

Point = tuple[float, float, float]


@dataclass(frozen=True)
class World:
    """Where a scene stands: from its own metres and axes into those of its file.

    A point p goes to m(s (p + at)), with the scale s and, in a mirrored world, m: x to -x. Light
    that is W/sr grows by s squared, so that radiance stays what it is.

    Parameters
    ----------
    scale
        Units of the file in a metre.
    mirrored
        Whether x is -x.
    shuffled
        Whether the elements of the file stand in another order.
    seed
        Of all that is random: the order, the observations, the search.
    at
        Where the scene's origin is, in metres.
    """

    scale: float = 1.0
    mirrored: bool = False
    shuffled: bool = False
    seed: int = 0
    at: Point = (0.0, 0.0, 0.0)

    @property
    def sign(self) -> float:
        return -1.0 if self.mirrored else 1.0

    def in_units(self, scale: float) -> World:
        """The same world in units of which a metre has so many more."""
        return replace(self, scale=self.scale * scale)

    def points(self, p: ArrayLike) -> NDArray[np.float64]:
        """(n, 3) or (3,) positions in the file."""
        return (np.asarray(p, float) + self.at) * self.scale * [self.sign, 1, 1]

    def faces(self, corners: ArrayLike) -> NDArray[np.intp]:
        """(f, 3) corners of triangles, in the order that keeps the front in front."""
        return np.asarray(corners)[:, :: -1 if self.mirrored else 1]

    def point(self, *p: float) -> str:
        return text(self.points(p))

    def vector(self, x: float, y: float, z: float) -> str:
        """A direction."""
        return text([self.sign * x, y, z])

    def length(self, metres: float) -> str:
        return text([metres * self.scale])

    def power(self, *intensity: float) -> str:
        """Radiant intensity, W/sr."""
        return text(np.array(intensity) * self.scale**2)

    def turn(self, degrees: float) -> str:
        """An angle of rotation about x, y or z of a transform that `place` mirrors as a whole."""
        return text([degrees])

    def place(self, inside: str = "", name: str = "to_world") -> str:
        """The transform of a shape: its own, then the world's."""
        s = self.scale
        own = f'<translate value="{text(self.at)}"/>' if any(self.at) else ""
        own += f'<scale x="{text([self.sign * s])}" y="{text([s])}" z="{text([s])}"/>'
        return f'<transform name="{name}">{inside}{own}</transform>'

    def aim(self, origin: Point, target: Point, up: Point = (0, 0, 1), tag: str = "lookat") -> str:
        """The transform of a camera or a spot, which may have no scale."""
        ends = f'origin="{self.point(*origin)}" target="{self.point(*target)}"'
        return f'<transform name="to_world"><{tag} {ends} up="{self.vector(*up)}"/></transform>'


def text(values: ArrayLike) -> str:
    """Numbers as a file has them, to the last bit."""
    return " ".join(repr(float(value)) for value in np.asarray(values, float))


VARIANTS = {
    "unit": World(scale=100.0, seed=1),
    "handedness": World(mirrored=True, seed=2),
    "order": World(shuffled=True, seed=3),
    "seed": World(seed=4),
}
