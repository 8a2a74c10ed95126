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
from lightloc.reprs import short

NEAR = 1e-3  # of the bounds' diagonal: a position further off is not on the outline


@dataclass(frozen=True, eq=False)
class Outline:
    """A 2D room in the plane z = 0; free space is inside the walls and outside the occluders.

    As a `Geometry` it stands for the prism over it, without floor or ceiling: rays that leave the
    plane meet its vertical walls.

    Parameters
    ----------
    walls : Loop
        The walls as a closed curve (`lightloc.plane.Loop`), run through in either direction.
    occluders : tuple of Loop
        More of them, within the walls and apart from each other; none by default.

    Raises
    ------
    ValueError
        If an occluder crosses the walls or another one, or lies outside the walls or within another
        occluder.

    Notes
    -----
    The 2D scenes of section 6.1.

    Examples
    --------
    >>> from lightloc import Outline
    >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> positions, normals = room.sample(400)
    >>> positions[0].round(6).tolist(), normals[0].tolist(), room.occludes
    ([0.005, 0.0, 0.0], [0.0, 1.0, 0.0], False)
    >>> room.with_occluders(Outline.disc([0.5, 0.5], 0.1)).occludes
    True
    """

    walls: Loop
    occluders: tuple[Loop, ...] = ()

    __repr__ = short

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
        """Make a room whose walls are straight, or circular arcs, between vertices.

        Parameters
        ----------
        vertices : (m, 2) or (m, 3) array_like
            Corners in order, in the unit of length; with three coordinates, z = 0.
        bulges : float or (m,) array_like
            Tangent of a quarter of the angle of the arc from each vertex to the next, positive
            where it turns left; 0 is straight.

        Returns
        -------
        Outline
            The room, empty.

        Raises
        ------
        ValueError
            If there are fewer than two vertices, two that follow each other are the same, the walls
            cross themselves or enclose no area, or a value is not finite or off the plane.

        Examples
        --------
        >>> from lightloc import Outline
        >>> Outline.polygon([[0, 0], [3, 0], [3, 2], [0, 2]]).area
        6.0
        """
        return Outline(Loop(vertices, bulges))

    @staticmethod
    def circle(centre: ArrayLike, radius: float) -> Outline:
        """Make a room with one round wall.

        Parameters
        ----------
        centre : (2,) or (3,) array_like
            Centre of the circle, in the unit of length; with three coordinates, z = 0.
        radius : float
            Radius of the circle, in the unit of length.

        Returns
        -------
        Outline
            The room, empty.

        Raises
        ------
        ValueError
            If the radius is 0, or a value is not finite or off the plane.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Outline
        >>> bool(np.isclose(Outline.circle([0, 0], 2).area, np.pi * 2**2))
        True
        """
        return Outline(Outline.disc(centre, radius))

    @staticmethod
    def disc(centre: ArrayLike, radius: float) -> Loop:
        """Make a circle as a loop, for occluders.

        Parameters
        ----------
        centre : (2,) or (3,) array_like
            Centre of the circle, in the unit of length; with three coordinates, z = 0.
        radius : float
            Radius of the circle, in the unit of length.

        Returns
        -------
        Loop
            The circle.

        Raises
        ------
        ValueError
            If the radius is 0, or a value is not finite or off the plane.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Outline
        >>> bool(np.isclose(Outline.disc([0.5, 0.5], 0.1).length, 2 * np.pi * 0.1))
        True
        """
        (c,) = in_plane("centre", np.reshape(numbers("centre", centre), (1, -1)))
        reach = np.array([radius, 0.0])
        return Loop([c - reach, c + reach], 1.0)

    def with_occluders(self, *occluders: Loop) -> Outline:
        """Return the same room with more occluders in it.

        Parameters
        ----------
        *occluders : Loop
            The occluders to add.

        Returns
        -------
        Outline
            The room with them and its own.

        Raises
        ------
        ValueError
            If an occluder crosses the walls or another one, or lies outside the walls or within
            another occluder.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Outline
        >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
        >>> with_column = room.with_occluders(Outline.disc([0.5, 0.5], 0.1))
        >>> bool(np.isclose(with_column.area, 1 - np.pi * 0.1**2))
        True
        """
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
        """(2, 3) lower and upper corner of the walls, in the unit of length."""
        return np.pad(self.walls.extremes, [(0, 0), (0, 1)]) + 0.0  # no negative zeros

    @property
    def area(self) -> float:
        """Area of the free space, m^2."""
        return abs(self.walls.area) - sum(abs(loop.area) for loop in self.occluders)

    def sample(self, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Space n points evenly along the outline.

        Each loop gets a share of the points by its length, and is divided into as many equal arcs;
        the points are their midpoints, in order along the loop, first of the walls and then of the
        occluders.

        Parameters
        ----------
        n : int
            Number of points, at least one for each loop.

        Returns
        -------
        positions : (n, 3) array
            The points, in the unit of length.
        normals : (n, 3) array
            Unit normals there, into free space.

        Raises
        ------
        ValueError
            If there are fewer points than loops.

        Examples
        --------
        >>> from lightloc import Outline
        >>> positions, normals = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).sample(4)
        >>> positions[:2].tolist(), normals[:2].tolist()
        ([[0.5, 0.0, 0.0], [1.0, 0.5, 0.0]], [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
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
        """Find where on the outline positions lie: what `Perimeter` is made of.

        Parameters
        ----------
        positions : (n, 2) or (n, 3) array_like
            Points on the outline, in the unit of length.

        Returns
        -------
        loop : (n,) array of int
            Which loop each point lies on, counted as in ``loops``.
        along : (n,) array
            How far along that loop it lies, in the unit of length.
        length : (n,) array
            The whole length of that loop, in the unit of length.

        Raises
        ------
        ValueError
            If a position is further than a thousandth of the bounds' diagonal off the outline, or
            not finite, or off the plane.

        Examples
        --------
        >>> from lightloc import Outline
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
        """Distance d(x, y) along the surface between pairs of positions on it (section 4.2).

        Parameters
        ----------
        x, y : (n, 2) or (n, 3) array_like
            Points on the outline, in the unit of length.

        Returns
        -------
        (n,) array
            The shorter way round the loop, in the unit of length; infinite from one loop to
            another.

        Raises
        ------
        ValueError
            If a position is further than a thousandth of the bounds' diagonal off the outline, or
            not finite, or off the plane.

        Examples
        --------
        >>> from lightloc import Outline
        >>> room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
        >>> room.distances([[0.5, 0, 0]], [[0, 0.75, 0]]).tolist()
        [1.25]
        """
        (loop, s, length), (other, t, _) = self.along(x), self.along(y)
        d = np.abs(s - t)
        return np.where(loop == other, np.minimum(d, length - d), np.inf)

    def clearance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return how far points are from the nearest wall or occluder.

        Parameters
        ----------
        points : (n, 2) or (n, 3) array_like
            Points in the plane z = 0, in the unit of length.

        Returns
        -------
        (n,) array
            Distances, in the unit of length; at least 0 on either side of a wall.

        Raises
        ------
        ValueError
            If a point is not finite, or off the plane.

        Examples
        --------
        >>> from lightloc import Outline
        >>> Outline.circle([0, 0], 1).clearance([[0.3, 0, 0], [0, -0.6, 0]]).round(6).tolist()
        [0.7, 0.4]
        """
        p = in_plane("points", points)
        return np.min([loop.nearest(p)[1] for loop in self.loops], axis=0)

    def inside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether points lie in free space.

        Parameters
        ----------
        points : (n, 2) or (n, 3) array_like
            Points in the plane z = 0, in the unit of length.

        Returns
        -------
        (n,) array of bool
            True inside the walls and outside the occluders.

        Raises
        ------
        ValueError
            If a point is not finite, or off the plane.

        Examples
        --------
        >>> from lightloc import Outline
        >>> room = Outline.circle([0, 0], 1).with_occluders(Outline.disc([0, 0], 0.2))
        >>> room.inside([[0.5, 0, 0], [0.1, 0, 0], [2, 0, 0]]).tolist()
        [True, False, False]
        """
        p = in_plane("points", points)
        free = self.walls.encloses(p)
        for loop in self.occluders:
            free &= ~loop.encloses(p)
        return free

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """As of `Geometry`: whether neither walls nor occluders are between x and p."""
        return is_free(self._in_the_way, x, p) & active

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """As of `Geometry`: in the plane."""
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
