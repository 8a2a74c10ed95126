"""Where rays cross the edges of a 2D outline: tests over Dr.Jit arrays, one kernel a structure.

An edge from v along the chord c, of bulge b, is where F(y) = b y.(y - c) - (1 - b^2)/2 (c x y) = 0
with y counted from v: a line where b = 0, and else a circle, of which the arc is the part nearer
than v to the arc's middle. No centre appears, so flat arcs lose nothing in float32.

An edge's numbers enter kernels as data, so that rooms of the same make share one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.plane.loop import Loop

FAR_END = 8.9e-4
"""Share of a segment left out at its far end, as in Mitsuba: p may lie on a surface itself."""


@dataclass(frozen=True)
class Disc:
    """A whole circle of any number of arcs."""

    centre: NDArray[np.float64]
    radius: float


@dataclass(frozen=True)
class Segment:
    """A straight edge."""

    start: NDArray[np.float64]
    chord: NDArray[np.float64]


@dataclass(frozen=True)
class Arc:
    """An edge of a bulge other than 0."""

    start: NDArray[np.float64]
    chord: NDArray[np.float64]
    bulge: float


Edge = Disc | Segment | Arc


def edges_of(loop: Loop, inner: bool = False) -> list[Edge]:
    """A loop's edges; with ``inner``, those that can come between two points inside it."""
    if loop.is_circle:
        return [] if inner else [Disc(loop.centres[0], float(loop.radii[0]))]
    rows = np.flatnonzero(~loop.on_hull) if inner else range(len(loop.vertices))
    return [
        Arc(loop.vertices[i], loop.chords[i], float(loop.bulges[i]))
        if loop.bulges[i]
        else Segment(loop.vertices[i], loop.chords[i])
        for i in rows
    ]


def is_free(edges: Sequence[Edge], x: Any, p: Any) -> Any:
    """Whether no edge crosses the segment from x to p, the last `FAR_END` of it left out."""
    free = types().Bool(True)
    if not edges:
        return free
    d = [(p[0] - x[0]) * (1 - FAR_END), (p[1] - x[1]) * (1 - FAR_END)]
    for edge in edges:
        if isinstance(edge, Disc):
            free &= ~_meets(edge, x, d)
        else:
            for t, on in _crossings(edge, x, d):
                free &= ~(on & (t > 0) & (t < 1))
    return free


def first_hit(edges: Sequence[Edge], x: Any, d: Any) -> tuple[Any, Any]:
    """Whether the ray from x along d meets an edge, and the least t > 0 at which it does, or 0."""
    nearest = types().Float(np.inf)
    for edge in edges:
        for t, on in _crossings(edge, x, d):
            nearest = dr.select(on & (t > 0) & (t < nearest), t, nearest)
    hit = dr.isfinite(nearest)
    return hit, dr.select(hit, nearest, 0)


def _meets(disc: Disc, x: Any, d: Any) -> Any:
    """Whether the segment's point nearest to the centre lies within the disc."""
    cx, cy, r = _data(*disc.centre, disc.radius)
    ax, ay = x[0] - cx, x[1] - cy
    t = dr.clip(-(ax * d[0] + ay * d[1]) / (d[0] * d[0] + d[1] * d[1]), 0, 1)
    ax, ay = ax + t * d[0], ay + t * d[1]
    return ax * ax + ay * ay < r * r


def _crossings(edge: Edge, x: Any, d: Any) -> list[tuple[Any, Any]]:
    """Each t at which the line x + t d may meet an edge, and whether it does."""
    if isinstance(edge, Segment):
        vx, vy, cx, cy = _data(*edge.start, *edge.chord)
        ax, ay = vx - x[0], vy - x[1]
        ends = d[0] * ay - d[1] * ax, d[0] * (ay + cy) - d[1] * (ax + cx)
        t = (ax * cy - ay * cx) / (d[0] * cy - d[1] * cx)
        return [(t, (ends[0] > 0) != (ends[1] > 0))]
    if isinstance(edge, Disc):
        cx, cy, r = _data(*edge.centre, edge.radius)
        ax, ay = x[0] - cx, x[1] - cy
        roots = _roots(
            d[0] * d[0] + d[1] * d[1],
            ax * d[0] + ay * d[1],
            ax * ax + ay * ay - r * r,
        )
        return [(t, t == t) for t in roots]  # NaN where there is none
    vx, vy, cx, cy, b = _data(*edge.start, *edge.chord, edge.bulge)
    ax, ay = x[0] - vx, x[1] - vy
    k = 0.5 * (1 - b * b)
    roots = _roots(
        b * (d[0] * d[0] + d[1] * d[1]),
        b * (ax * d[0] + ay * d[1] - 0.5 * (cx * d[0] + cy * d[1]))
        - 0.5 * k * (cx * d[1] - cy * d[0]),
        b * (ax * (ax - cx) + ay * (ay - cy)) - k * (cx * ay - cy * ax),
    )
    apex_x, apex_y = cx + b * cy, cy - b * cx  # twice the way from v to the arc's middle
    on = []
    for t in roots:
        x_at, y_at = ax + t * d[0], ay + t * d[1]
        on.append((t, x_at * (x_at - apex_x) + y_at * (y_at - apex_y) < 0))
    return on


def _roots(a: Any, half_b: Any, c: Any) -> tuple[Any, Any]:
    """Of a t^2 + 2 half_b t + c = 0, without cancellation; NaN where there is none."""
    q = -(half_b + dr.copysign(dr.sqrt(half_b * half_b - a * c), half_b))
    return q / a, c / q


def _data(*values: float) -> list[Any]:
    """Numbers that a kernel reads, rather than holds: it serves for others too."""
    f = types()
    return [dr.opaque(f.Float, float(value)) for value in values]
