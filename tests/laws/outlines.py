"""The 2D rooms that the laws of outlines are tried on, and how they are moved and asked."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.plane.loop import Loop
from lightloc.plane.outline import Outline

UNIT = [(0, 0), (1, 0), (1, 1), (0, 1)]
HALF = np.tan(np.pi / 4)  # the bulge of a half circle
QUARTER = np.tan(np.pi / 8)

SQUARE = Outline.polygon(UNIT)
ROOMS = {
    "square": SQUARE,
    "L": Outline.polygon([(0, 0), (1, 0), (1, 0.5), (0.5, 0.5), (0.5, 1), (0, 1)]),
    "circle": Outline.circle([0.4, -0.3], 0.7),
    "stadium": Outline.polygon([(0, 0), (1, 0), (1, 0.6), (0, 0.6)], [0, HALF, 0, HALF]),
    "waisted": Outline.polygon(UNIT, [0, -QUARTER, 0, -QUARTER]),
    "keyhole": Outline.polygon([(-0.2, 0.0), (-0.2, -1), (0.2, -1), (0.2, 0.0)], [0, 0, 0, 2.5]),
    "discs": SQUARE.with_occluders(Outline.disc([0.3, 0.4], 0.15), Outline.disc([0.7, 0.6], 0.05)),
    "bar": SQUARE.with_occluders(Loop([(0.3, 0.45), (0.75, 0.45), (0.75, 0.5), (0.3, 0.5)])),
    "lens": SQUARE.with_occluders(Loop([(0.3, 0.5), (0.7, 0.4)], [QUARTER, -QUARTER / 3])),
}
CONVEX = ("square", "circle", "stadium")

every_room = pytest.mark.parametrize("room", ROOMS.values(), ids=ROOMS.keys())


def on_device(v: NDArray):
    f = types()
    return f.Array3f(*(f.Float(column.astype(np.float32)) for column in np.asarray(v, float).T))


def visible(room: Outline, x: NDArray, p: NDArray) -> NDArray[np.bool_]:
    return np.broadcast_to(np.array(room.visible(on_device(x), on_device(p))), len(x))


def moved(room: Outline, turn: float, scale: float, shift: NDArray) -> Outline:
    """The room turned, scaled and shifted."""
    matrix = _motion(turn, scale)
    walls, *rest = (Loop(loop.vertices @ matrix + shift, loop.bulges) for loop in room.loops)
    return Outline(walls, tuple(rest))


def moved_points(x: NDArray, turn: float, scale: float, shift: NDArray) -> NDArray[np.float64]:
    """Points (n, 3), turned, scaled and shifted in the plane."""
    return np.pad(x[:, :2] @ _motion(turn, scale) + shift, [(0, 0), (0, 1)])


def _motion(turn: float, scale: float) -> NDArray[np.float64]:
    cos, sin = np.cos(turn), np.sin(turn)
    return scale * np.array([[cos, sin], [-sin, cos]])


def off_corners(room: Outline, x: NDArray) -> NDArray[np.bool_]:
    """Which points are not on a vertex, which has no one normal."""
    vertices = np.concatenate([loop.vertices for loop in room.loops])
    return np.linalg.norm(x[:, None, :2] - vertices, axis=2).min(axis=1) > 1e-4
