"""The laws of what a 2D outline hides, and of where rays meet it.

Kernels compute in float32; pairs of points whose visibility changes within `GRAZING` are left out
where another way of asking can't tell.
"""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import numpy as np
import pytest
from numpy.typing import NDArray
from outlines import (
    CONVEX,
    ROOMS,
    SQUARE,
    every_room,
    moved,
    moved_points,
    on_device,
    visible,
)
from scipy.spatial import ConvexHull

from lightloc import Lambert, Observations, PointLights, radiance
from lightloc.plane.outline import Outline

GRAZING = 1e-3  # metres: the points looked at along a segment stand half of that apart
BETWEEN = 3000
PAIRS = 2000
FINE = 2048  # chords of an arc


@pytest.fixture
def free_points(rng) -> Callable[[Outline, int], NDArray]:
    def draw(room: Outline, n: int) -> NDArray:
        p = rng.uniform(*room.bounds, (40 * n, 3))
        p = p[room.inside(p)]
        assert len(p) >= n
        return p[:n]

    return draw


@every_room
def test_what_lies_on_the_hull(room):
    """Edges in no one's way are those on the convex hull of the walls, found by other means."""
    walls = room.walls
    line = walls.polyline(FINE)
    hull = ConvexHull(line)
    middles, _ = walls.on_edge(
        np.tile(np.linspace(0.01, 0.99, 33), (len(walls.vertices), 1)),
        np.arange(len(walls.vertices))[:, None] + np.zeros(33, int),
    )
    beyond = hull.equations[:, :2] @ middles.reshape(-1, 2).T + hull.equations[:, 2:]
    on = (beyond.max(axis=0) > -1e-6).reshape(-1, 33).all(axis=1)
    np.testing.assert_array_equal(walls.on_hull, on)


@every_room
def test_visibility_is_a_free_segment(room, free_points):
    """V(x, p) = 1 exactly where all points between x and p are in free space.

    Of pairs that stay the same when p moves by `GRAZING`: others may touch an edge between the
    points that are looked at.
    """
    x, p = free_points(room, PAIRS // 2).reshape(2, -1, 3)
    V = visible(room, x, p)
    t = (np.arange(BETWEEN) + 0.5) / BETWEEN
    free = np.array(
        [room.inside(a + t[:, None] * (b - a)).all() for a, b in zip(x, p, strict=True)]
    )
    steps = GRAZING * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    steady = np.all([visible(room, x, p + step) == V for step in steps], axis=0)
    assert steady.mean() > 0.97
    np.testing.assert_array_equal(V[steady], free[steady])


@every_room
def test_visibility_is_mutual(room, free_points):
    """V(x, p) = V(p, x)."""
    x, p = free_points(room, 2 * PAIRS).reshape(2, -1, 3)
    assert (visible(room, x, p) == visible(room, p, x)).mean() > 0.998


@every_room
def test_visibility_follows_the_room(room, free_points):
    """A rigid motion and a scale change no visibility, but for the rounding of grazing rays."""
    where = (1.1, 0.3, np.array([-0.4, 0.2]))
    x, p = free_points(room, 2 * PAIRS).reshape(2, -1, 3)
    other = visible(moved(room, *where), moved_points(x, *where), moved_points(p, *where))
    assert (visible(room, x, p) == other).mean() > 0.999


@pytest.mark.parametrize("name", ROOMS)
def test_a_convex_room_costs_nothing(name):
    """In an empty convex room no edge is tested: V is a literal, whatever x and p are."""
    room = ROOMS[name]
    x = on_device(room.sample(8)[0])
    V = room.visible(x, x)
    assert room.occludes == (name not in CONVEX)
    assert (V.state == dr.VarState.Literal) == (name in CONVEX)


@every_room
def test_the_surface_sees_what_is_above_it(room):
    """Every observed point sees 1 cm straight up and, in convex rooms, all points above it.

    Nothing shades itself, where shadow rays leave the surface at a grazing angle too.
    """
    x, n = room.sample(1000)
    q = Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(1000), material=Lambert(np.pi)
    )
    for height, tilt in ((0.01, 0), (1e-3, 0.9), (1e-3, -0.9)):
        side = np.stack([-n[:, 1], n[:, 0], n[:, 2]], axis=1)
        p = x + height * (np.sqrt(1 - tilt**2) * n + tilt * side)
        clear = room.inside(p) & room.inside(x + 0.5 * (p - x))
        assert clear.mean() > 0.98
        for i in np.flatnonzero(clear)[::37]:
            B = radiance(q, PointLights(p[i : i + 1], [1.0]), room)
            assert B[i] > 0


@every_room
def test_first_hit(room, free_points):
    """A ray from free space meets the outline, at the first place where it leaves free space."""
    x, p = free_points(room, 2 * PAIRS).reshape(2, -1, 3)
    d = (p - x) / np.linalg.norm(p - x, axis=1, keepdims=True)
    hit, y = room.intersect(on_device(x), on_device(d))
    y = np.array(y, float).T
    assert np.array(hit).all()
    distance = np.linalg.norm(y - x, axis=1)
    off = room.clearance(np.pad(y[:, :2], [(0, 0), (0, 1)]))
    assert np.quantile(off, 0.99) < 1e-5
    assert off.max() < 1e-3  # grazing hits of a circle are off along the ray, not off the circle
    t = (np.arange(BETWEEN // 10) + 0.5) / (BETWEEN // 10)
    free = [
        room.inside(a + t[:, None] * (1 - 1e-3) * s * u).all()
        for a, u, s in zip(x, d, distance, strict=True)
    ]
    assert np.mean(free) > 0.99
    beyond = x + (distance[:, None] + 1e-3) * d
    assert room.inside(beyond).mean() < 0.01


def test_rays_out_of_the_plane_meet_the_prism():
    """A ray that climbs meets the vertical wall over the place where its shadow meets the wall."""
    x = np.array([[0.5, 0.5, 0.0]] * 2)
    d = np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    hit, y = SQUARE.intersect(on_device(x), on_device(d))
    assert np.array(hit).tolist() == [True, False]
    np.testing.assert_allclose(np.array(y).T[0], [1, 0.5, 0.5 / 0.6 * 0.8], rtol=1e-6)


@pytest.mark.parametrize("bulge", [1e-3, 1e-5, 1e-6, 1e-8])
def test_flat_arcs_are_walls(bulge, free_points):
    """An arc that is nearly flat hides what the straight edge hides: nothing is lost to the far
    centre of its circle."""
    straight = ROOMS["L"]
    bowed = Outline.polygon(straight.walls.vertices, np.full(6, -bulge))
    x, p = free_points(straight, 2 * PAIRS).reshape(2, -1, 3)
    same = visible(straight, x, p) == visible(bowed, x, p)
    assert same.mean() > 1 - 2 * bulge - 2e-3
    np.testing.assert_allclose(bowed.sample(60)[0], straight.sample(60)[0], atol=bulge)


def test_rooms_of_one_make_share_a_kernel(free_points):
    """An outline's numbers are data to kernels: a second room of the same make compiles nothing."""
    x, p = (on_device(v) for v in free_points(SQUARE, 200).reshape(2, -1, 3))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for centre, radius in (([0.3, 0.4], 0.15), ([0.6, 0.5], 0.2)):
            room = SQUARE.with_occluders(Outline.disc(centre, radius))
            dr.kernel_history_clear()
            dr.eval(room.visible(x, p))
        (kernel,) = dr.kernel_history([dr.KernelType.JIT])
        assert kernel["cache_hit"]
