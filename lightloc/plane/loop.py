"""A closed curve in the plane z = 0 whose edges are straight or circular arcs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.checks import array, numbers
from lightloc.plane.vectors import cross, crossings, in_plane, turn

FLAT = 1e-7
"""Smaller bulges are straight: such an arc leaves its chord by 5e-8 of it, below float32."""
SMALLEST_EDGE = 1e-6  # of the loop's extent: shorter edges have no direction in float32
ROUNDING = 1e-9  # of the loop's extent: what float64 arithmetic on its edges may lose
PIECES = 64  # chords of an arc where a polyline must do: they leave it by 3e-4 of the radius


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed curve of edges: edge i runs from vertex i to the next, and the last one back.

    Parameters
    ----------
    vertices : (m, 2) or (m, 3) array_like
        Where edges begin, in the unit of length; with three coordinates, z = 0.
    bulges : float or (m,) array_like
        As in DXF: the tangent of a quarter of the arc's angle, positive where the arc turns left; 0
        is straight. A circle is two edges of bulge 1.

    Raises
    ------
    ValueError
        If there are fewer than 2 edges, no area inside, an edge without length, a value that is not
        finite or off the plane, or edges that cross (arcs are taken as `PIECES` chords for that).

    Examples
    --------
    >>> disc = Loop([[-1, 0], [1, 0]], 1.0)
    >>> bool(np.isclose(disc.area, np.pi)), bool(np.isclose(disc.length, 2 * np.pi))
    (True, True)
    """

    vertices: NDArray[np.float64]
    bulges: NDArray[np.float64]

    def __init__(self, vertices: ArrayLike, bulges: ArrayLike = 0.0) -> None:
        put = object.__setattr__
        v = in_plane("Loop.vertices", vertices)
        if len(v) < 2:
            raise ValueError(f"Loop has {len(v)} edges; expected at least 2")
        b = numbers("Loop.bulges", bulges)
        b = array("Loop.bulges", np.full(len(v), b) if b.ndim == 0 else b, (len(v),))
        put(self, "vertices", v)
        put(self, "bulges", np.where(np.abs(b) < FLAT, 0.0, b))
        short = np.linalg.norm(self.chords, axis=1) <= SMALLEST_EDGE * np.ptp(v, axis=0).max()
        if short.any():
            raise ValueError(f"Loop.vertices[{int(np.argmax(short))}] and the next are the same")
        if abs(self.area) < SMALLEST_EDGE * self.length**2:
            raise ValueError("Loop encloses no area")
        if crossings(self.polyline()):
            raise ValueError("Loop crosses itself; expected edges that meet only at vertices")

    # What follows is one row per edge.

    @cached_property
    def chords(self) -> NDArray[np.float64]:
        """(m, 2) from each edge's start to its end, in the unit of length."""
        return np.roll(self.vertices, -1, axis=0) - self.vertices

    @cached_property
    def angles(self) -> NDArray[np.float64]:
        """(m,) signed angle of each arc, radians; 0 where straight."""
        return 4 * np.arctan(self.bulges)

    @cached_property
    def radii(self) -> NDArray[np.float64]:
        """(m,) lengths; infinite where straight."""
        b = np.abs(self.bulges)
        with np.errstate(divide="ignore"):
            return np.linalg.norm(self.chords, axis=1) * (1 + b * b) / (4 * b)

    @cached_property
    def centres(self) -> NDArray[np.float64]:
        """(m, 2) of the arcs' circles, in the unit of length; of no meaning where straight."""
        b = np.where(self.bulges == 0, 1.0, self.bulges)[:, None]
        left = self.chords[:, ::-1] * [-1, 1]
        return self.vertices + self.chords / 2 + left * (1 - b * b) / (4 * b)

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """(m,) lengths along each edge."""
        straight = np.linalg.norm(self.chords, axis=1)
        return np.where(
            self.bulges == 0,
            straight,
            np.abs(self.angles) * np.where(self.bulges == 0, 0.0, self.radii),
        )

    # The loop as a whole.

    @property
    def length(self) -> float:
        """The perimeter, in the unit of length."""
        return float(self.lengths.sum())

    @cached_property
    def area(self) -> float:
        """Enclosed area, squared length; positive where the loop runs counterclockwise."""
        v, after = self.vertices, np.roll(self.vertices, -1, axis=0)
        r = np.where(self.bulges == 0, 0.0, self.radii)
        return float((cross(v, after) + r**2 * (self.angles - np.sin(self.angles))).sum() / 2)

    @cached_property
    def extremes(self) -> NDArray[np.float64]:
        """(2, 2) lower and upper corner of the bounding box, in the unit of length."""
        axes = np.concatenate([-np.eye(2), np.eye(2)])
        low_x, low_y, high_x, high_y = self.support(axes)
        return np.array([[-low_x, -low_y], [high_x, high_y]])

    @property
    def is_circle(self) -> bool:
        """Whether all edges are arcs of one circle."""
        if not self.bulges.all():
            return False
        circles = np.column_stack([self.centres, self.radii * np.sign(self.bulges)])
        return bool(np.ptp(circles, axis=0).max() < ROUNDING * self.length)

    def at(self, s: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points (n, 2) and unit tangents (n, 2) at (n,) distances along the loop."""
        s = np.mod(numbers("s", s), self.length)
        ends = np.cumsum(self.lengths)
        edge = np.minimum(np.searchsorted(ends, s, side="right"), len(ends) - 1)
        share = 1 - (ends[edge] - s) / self.lengths[edge]
        return self.on_edge(share, edge)

    def on_edge(
        self, share: NDArray[np.float64], edge: NDArray[np.intp]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points (..., 2) and unit tangents (..., 2) at shares (...) of the lengths of edges (...).

        The chord to the point at share u is sin(u a/2) / sin(a/2) of the edge's, turned by
        (u - 1) a/2; the tangent is turned by (u - 1/2) a.
        """
        half = self.angles[edge] / 2
        flat = half == 0
        ratio = np.where(flat, share, np.sin(share * half) / np.where(flat, 1, np.sin(half)))
        chord = self.chords[edge]
        points = self.vertices[edge] + ratio[..., None] * turn(chord, (share - 1) * half)
        tangents = turn(chord, (2 * share - 1) * half)
        return points, tangents / np.linalg.norm(tangents, axis=-1, keepdims=True)

    def nearest(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The arc-length coordinate of the loop's point nearest to each of (n, 2) points, and its
        distance, both (n,) in the unit of length."""
        p = np.asarray(points, float)[:, None, :]
        with np.errstate(invalid="ignore"):
            along = ((p - self.vertices) * self.chords).sum(axis=2) / (self.chords**2).sum(axis=1)
            turned = self._turned(np.arctan2(*np.moveaxis((p - self.centres)[..., ::-1], -1, 0)))
        sweep = np.where(self.bulges == 0, 1.0, np.abs(self.angles))
        beyond = np.where(turned > (2 * np.pi + sweep) / 2, 0.0, np.minimum(turned, sweep)) / sweep
        share = np.where(self.bulges == 0, along.clip(0, 1), beyond)
        edges = np.broadcast_to(np.arange(len(self.vertices)), share.shape)
        d = np.linalg.norm(self.on_edge(share, edges)[0] - p, axis=2)
        best = np.argmin(d, axis=1)
        row = np.arange(len(best))
        s = (np.cumsum(self.lengths) - self.lengths)[best] + share[row, best] * self.lengths[best]
        return s, d[row, best]

    def encloses(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(n,) whether each of (n, 2) points lies inside: the chords' even-odd rule, turned over
        for each arc between which and its chord the point lies."""
        p = np.asarray(points, float)[:, None, :]
        c, a, b = self.chords, self.vertices, np.roll(self.vertices, -1, axis=0)
        # Two arcs on one chord must see a point on it on opposite sides: they count from the same
        # end, and on the chord itself the point moves right or, where that is along it, up.
        first = (a[:, 0] < b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] < b[:, 1]))
        side = cross(c, p - np.where(first[:, None], a, b))
        side = np.where(side == 0, np.where(c[:, 1] == 0, c[:, 0], -c[:, 1]), side)
        above = (a[:, 1] > p[..., 1]) != (b[:, 1] > p[..., 1])
        crossed = above & (side * c[:, 1] > 0)
        bowed = side * self.bulges < 0
        bowed &= np.linalg.norm(p - self.centres, axis=2) < self.radii
        return (crossed.sum(axis=1) + bowed.sum(axis=1)) % 2 == 1

    def crosses(self, other: Loop) -> bool:
        """Whether an edge crosses one of another loop's (arcs as `PIECES` chords)."""
        return self._boxes_meet(other) and crossings(self.polyline(), other.polyline())

    def contains(self, other: Loop) -> bool:
        """Whether a loop that does not cross this one lies inside it."""
        return self._boxes_meet(other) and bool(self.encloses(other.vertices[:1])[0])

    def support(self, directions: ArrayLike) -> NDArray[np.float64]:
        """(k,) how far the loop reaches along each of (k, 2) unit vectors."""
        u = np.asarray(directions, float)
        far = (u @ self.vertices.T).max(axis=1)
        arcs = self.bulges != 0
        turned = self._turned(np.arctan2(u[:, 1], u[:, 0])[:, None])
        bowed = np.where(
            (turned <= np.abs(self.angles)) & arcs,
            u @ self.centres.T + np.where(arcs, self.radii, 0),
            -np.inf,
        )
        return np.maximum(far, bowed.max(axis=1))

    @cached_property
    def on_hull(self) -> NDArray[np.bool_]:
        """(m,) whether an edge lies on the loop's convex hull: no segment between two points
        inside the loop crosses it.

        Such an edge is bowed outwards or straight, and the loop nowhere reaches beyond its
        tangents. What it reaches beyond the tangent of an arc, as a function of the tangent's
        direction, is greatest at an end of an arc or where it points at a vertex or a centre.
        """
        slack = ROUNDING * np.ptp(self.vertices, axis=0).max()
        turn = np.sign(self.area)
        result = np.zeros(len(self.vertices), bool)
        starts = self._start_angles()
        for i, (v, c, b) in enumerate(zip(self.vertices, self.chords, self.bulges, strict=True)):
            if b == 0:
                u = turn * c[None, ::-1] * [1, -1] / np.linalg.norm(c)
                result[i] = bool((self.support(u) <= u @ v + slack).all())
            elif b * turn > 0:
                arcs = self.bulges != 0
                aims = np.concatenate([self.vertices, self.centres[arcs]]) - self.centres[i]
                ends = np.concatenate([starts, starts + self.angles])[np.tile(arcs, 2)]
                angle = np.concatenate([np.arctan2(aims[:, 1], aims[:, 0]), ends])
                angle = angle[self._turned(angle[:, None])[:, i] <= abs(self.angles[i])]
                u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
                reach = u @ self.centres[i] + self.radii[i]
                result[i] = bool((self.support(u) <= reach + slack).all())
        return result

    def polyline(self, pieces: int = PIECES) -> NDArray[np.float64]:
        """(k, 2) vertices, with ``pieces`` chords in the place of each arc."""
        counts = np.where(self.bulges == 0, 1, pieces)
        edge = np.repeat(np.arange(len(counts)), counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        return self.on_edge((np.arange(len(edge)) - first) / counts[edge], edge)[0]

    def _start_angles(self) -> NDArray[np.float64]:
        away = self.vertices - self.centres
        return np.arctan2(away[:, 1], away[:, 0])

    def _turned(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far along each arc an angle is seen from its centre, 0 to 2 pi: (..., m)."""
        back = np.where(self.bulges < 0, -1.0, 1.0) * (angle - self._start_angles())
        return np.mod(back + ROUNDING, 2 * np.pi) - ROUNDING

    def _boxes_meet(self, other: Loop) -> bool:
        (low, high), (other_low, other_high) = self.extremes, other.extremes
        return bool((low <= other_high).all() and (other_low <= high).all())
