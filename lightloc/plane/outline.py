"""The walls and occluders of a 2D room, as an observable surface and as a `Geometry`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import numbers
from lightloc.plane.crossing import edges_of, first_hit, is_free
from lightloc.plane.loop import Loop
from lightloc.plane.vectors import in_plane

NEAR = 1e-3  # of the bounds' diagonal: a position further off is not on the outline


@dataclass(frozen=True, eq=False)
class Outline:
    """A 2D room in the plane z = 0; free space is inside the walls and outside the occluders.

    As a `Geometry` it stands for the prism over it, without floor or ceiling: rays that leave
    the plane meet its vertical walls.

    Args:
        walls: a `Loop`, run through in either direction.
        occluders: more of them, within the walls and apart from each other.

    Raises:
        ValueError: an occluder crosses the walls or another one, lies outside the walls or
            within another occluder.

    >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> positions, normals = room.sample(400)
    >>> positions[0].round(6).tolist(), normals[0].tolist(), room.occludes
    ([0.005, 0.0, 0.0], [0.0, 1.0, 0.0], False)
    >>> room.with_occluders(Outline.disc([0.5, 0.5], 0.1)).occludes
    True
    """

    walls: Loop
    occluders: tuple[Loop, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "occluders", tuple(self.occluders))
        for i, loop in enumerate(self.occluders):
            name = f"Outline.occluders[{i}]"
            if self.walls.crosses(loop):
                raise ValueError(f"{name} crosses the walls")
            if not self.walls.contains(loop):
                raise ValueError(f"{name} lies outside the walls")
            for j, other in enumerate(self.occluders[:i]):
                if other.crosses(loop):
                    raise ValueError(f"{name} crosses occluders[{j}]")
                if other.contains(loop) or loop.contains(other):
                    raise ValueError(f"{name} and occluders[{j}] lie in one another")

    @staticmethod
    def polygon(vertices: ArrayLike, bulges: ArrayLike = 0.0) -> Outline:
        """Walls with (m, 2) or (m, 3) vertices in metres; `Loop` says what ``bulges`` are."""
        return Outline(Loop(vertices, bulges))

    @staticmethod
    def circle(centre: ArrayLike, radius: float) -> Outline:
        """One round wall."""
        return Outline(Outline.disc(centre, radius))

    @staticmethod
    def disc(centre: ArrayLike, radius: float) -> Loop:
        """A circle as a loop, for occluders."""
        (c,) = in_plane("centre", np.reshape(numbers("centre", centre), (1, -1)))
        reach = np.array([radius, 0.0])
        return Loop([c - reach, c + reach], 1.0)

    def with_occluders(self, *occluders: Loop) -> Outline:
        """The same room with more in it."""
        return Outline(self.walls, self.occluders + occluders)

    @property
    def loops(self) -> tuple[Loop, ...]:
        """The walls, then the occluders; `along` counts them in this order."""
        return (self.walls, *self.occluders)

    @property
    def occludes(self) -> bool:
        """Whether anything can come between two points: an occluder, or a wall that juts in."""
        return bool(self.occluders) or not self.walls.on_hull.all()

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) lower and upper corner of the walls, metres."""
        return np.pad(self.walls.extremes, [(0, 0), (0, 1)]) + 0.0  # no negative zeros

    @property
    def area(self) -> float:
        """Of the free space, square metres."""
        return abs(self.walls.area) - sum(abs(loop.area) for loop in self.occluders)

    def sample(self, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (n, 3) and unit normals (n, 3) into free space, evenly spaced.

        Each loop gets a share of the points by its length, and stands there divided into as many
        equal arcs; the points are their midpoints, in order along the loop.

        Raises:
            ValueError: there are fewer points than loops.
        """
        if n < len(self.loops):
            raise ValueError(f"sample of {n} points; expected at least one on each loop")
        share = n * np.array([loop.length for loop in self.loops])
        counts = _rounded(share / sum(loop.length for loop in self.loops))
        positions, normals = np.zeros((n, 3)), np.zeros((n, 3))
        last = 0
        for i, (loop, count) in enumerate(zip(self.loops, counts, strict=True)):
            here = slice(last, last + count)
            last += count
            x, along = loop.at((np.arange(count) + 0.5) / count * loop.length)
            free_on_the_left = (loop.area > 0) == (i == 0)
            positions[here, :2] = x
            normals[here, :2] = along[:, ::-1] * ([-1, 1] if free_on_the_left else [1, -1])
        return positions, normals + 0.0  # no negative zeros

    def along(
        self, positions: ArrayLike
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        """Where on the outline (n, 3) positions lie.

        Returns the index of each one's loop (n,), the arc-length coordinate on it (n,) and that
        loop's whole length (n,), metres: what `Perimeter` is made of.

        Raises:
            ValueError: a position is further than `NEAR` of the bounds' diagonal off the outline.

        >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
        >>> [v.tolist() for v in room.along([[0.25, 0, 0], [1, 0.5, 0]])]
        [[0, 0], [0.25, 1.5], [4.0, 4.0]]
        """
        p = in_plane("positions", positions)
        s, d = (np.stack(v) for v in zip(*(loop.nearest(p) for loop in self.loops), strict=True))
        loop = d.argmin(axis=0)
        off = d.min(axis=0) > NEAR * np.linalg.norm(np.ptp(self.bounds, axis=0))
        if off.any():
            row = int(np.argmax(off))
            raise ValueError(f"positions[{row}] lies {d[:, row].min():g} m off the outline")
        lengths = np.array([each.length for each in self.loops])
        return loop, s[loop, np.arange(len(p))], lengths[loop]

    def distances(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """d(x, y) along the surface between (n, 3) positions on it (section 4.2), metres: the
        shorter way round a loop, infinite from one loop to another.

        >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
        >>> room.distances([[0.5, 0, 0]], [[0, 0.75, 0]]).tolist()
        [1.25]
        """
        (loop, s, length), (other, t, _) = self.along(x), self.along(y)
        d = np.abs(s - t)
        return np.where(loop == other, np.minimum(d, length - d), np.inf)

    def clearance(self, points: ArrayLike) -> NDArray[np.float64]:
        """(n,) how far (n, 3) points are from the nearest wall or occluder, metres."""
        p = in_plane("points", points)
        return np.min([loop.nearest(p)[1] for loop in self.loops], axis=0)

    def inside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(n,) whether (n, 3) points lie in free space."""
        p = in_plane("points", points)
        free = self.walls.encloses(p)
        for loop in self.occluders:
            free &= ~loop.encloses(p)
        return free

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """V(x, p) for points in free space, as `Geometry` asks: (Array3f, Array3f) -> Bool.

        Walls that nothing inside can see past are not tested, so that a convex room costs
        nothing.
        """
        return is_free(self._in_the_way, x, p) & active

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """First point of the outline along the ray x + t d: (Bool, Array3f)."""
        hit, t = first_hit(self._everything, x, d)
        return hit & active, x + t * d

    @cached_property
    def _everything(self) -> Sequence[Any]:
        return [edge for loop in self.loops for edge in edges_of(loop)]

    @cached_property
    def _in_the_way(self) -> Sequence[Any]:
        return [e for i, loop in enumerate(self.loops) for e in edges_of(loop, inner=i == 0)]


def _rounded(share: NDArray[np.float64]) -> NDArray[np.intp]:
    """Whole numbers with the same sum, at least 1 each, as near the shares as that allows."""
    counts = np.maximum(share.astype(int), 1)
    total = int(np.rint(share.sum()))
    while counts.sum() < total:
        counts[np.argmax(share - counts)] += 1
    while counts.sum() > total:
        counts[np.argmin(np.where(counts > 1, share - counts, np.inf))] -= 1
    return counts
