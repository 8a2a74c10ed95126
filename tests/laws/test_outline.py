"""The laws of a 2D outline: lengths, areas, normals and distances along it.

They hold to the rounding of float64 (`CLOSE`).
"""

from __future__ import annotations

import numpy as np
import pytest
from outlines import ROOMS, SQUARE, every_room, moved, moved_points, off_corners

from lightloc.plane.loop import Loop
from lightloc.plane.outline import Outline

CLOSE = 1e-9
FINE = 2048  # chords of an arc: they enclose 4e-7 less of its circle's area than it does
POINTS = 300


def test_points_on_the_unit_square():
    """Of 400 points 100 stand on each wall, at 0.005, 0.015, ..., with normals into the room."""
    x, n = SQUARE.sample(400)
    t = (np.arange(100) + 0.5) / 100
    walls = [(t, 0 * t), (1 + 0 * t, t), (1 - t, 1 + 0 * t), (0 * t, 1 - t)]
    expected = np.concatenate([np.stack([*wall, 0 * t], axis=1) for wall in walls])
    np.testing.assert_allclose(x, expected, atol=1e-15)
    np.testing.assert_allclose(n, np.repeat([[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]], 100, 0))


@every_room
def test_points_are_even_and_face_free_space(room):
    """Points lie on the outline, equal arcs apart on each loop; normals are unit and point into
    free space, away from the walls and the occluders."""
    n = 500
    x, normals = room.sample(n)
    loop, s, length = room.along(x)
    counts = np.bincount(loop)
    perimeter = sum(each.length for each in room.loops)
    for i, each in enumerate(room.loops):
        on = loop == i
        assert abs(counts[i] - n * each.length / perimeter) < 1
        np.testing.assert_allclose(length[on], each.length, rtol=CLOSE)
        np.testing.assert_allclose(s[on], (np.arange(counts[i]) + 0.5) / counts[i] * each.length)
    np.testing.assert_allclose(room.clearance(x), 0, atol=CLOSE)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=CLOSE)
    apart = off_corners(room, x)
    x, normals = x[apart], normals[apart]
    assert room.inside(x + 1e-5 * normals).all()
    assert not room.inside(x - 1e-5 * normals).any()
    ahead = room.clearance(x + 1e-5 * normals)
    np.testing.assert_allclose(ahead, 1e-5, rtol=1e-3)  # straight up: nothing else is nearer


@every_room
def test_either_direction(room):
    """A loop that is run through backwards bounds the same free space, from the same points."""
    back = [Loop(np.roll(e.vertices[::-1], 1, axis=0), -e.bulges[::-1]) for e in room.loops]
    assert [b.area for b in back] == pytest.approx([-e.area for e in room.loops])
    x, n = room.sample(333)
    y, m = Outline(back[0], tuple(back[1:])).sample(333)
    for loop in range(len(back)):
        on = room.along(x)[0] == loop
        np.testing.assert_allclose(y[on], x[on][::-1], atol=CLOSE)
        apart = off_corners(room, y[on])
        np.testing.assert_allclose(m[on][apart], n[on][::-1][apart], atol=CLOSE)


def test_lengths_and_areas():
    """Closed forms: a circle, a stadium, a square with a half disc cut out of two sides."""
    circle = ROOMS["circle"].walls
    assert circle.length == pytest.approx(2 * np.pi * 0.7)
    assert circle.area == pytest.approx(np.pi * 0.49)
    assert circle.is_circle
    stadium = ROOMS["stadium"].walls
    assert stadium.length == pytest.approx(2 + 2 * np.pi * 0.3)
    assert stadium.area == pytest.approx(0.6 + np.pi * 0.09)
    np.testing.assert_allclose(stadium.extremes, [[-0.3, 0], [1.3, 0.6]], atol=CLOSE)
    assert not stadium.is_circle
    waisted = ROOMS["waisted"].walls
    r = np.sqrt(0.5)
    assert waisted.length == pytest.approx(2 + np.pi * r)
    assert waisted.area == pytest.approx(1 - 2 * (np.pi / 4 * r**2 - 0.25))
    np.testing.assert_allclose(waisted.extremes, [[0, 0], [1, 1]], atol=CLOSE)
    assert ROOMS["discs"].area == pytest.approx(1 - np.pi * (0.15**2 + 0.05**2))


@every_room
def test_arcs_are_the_limit_of_chords(room):
    """Length and area of a loop are those of a fine polyline; so is what it encloses, by the
    angle that the polyline turns about a point."""
    for loop in room.loops:
        line = loop.polyline(FINE)
        step = np.roll(line, -1, axis=0) - line
        assert np.linalg.norm(step, axis=1).sum() == pytest.approx(loop.length, rel=1e-5)
        area = (line[:, 0] * step[:, 1] - line[:, 1] * step[:, 0]).sum() / 2
        assert area == pytest.approx(loop.area, rel=1e-5)


@every_room
def test_inside_is_the_winding_number(room, rng):
    """Points are in free space where the walls wind about them and no occluder does."""
    low, high = room.bounds
    margin = np.array([0.2, 0.2, 0.0])
    p = rng.uniform(low - margin, high + margin, (POINTS, 3))
    p = p[room.clearance(p) > 1e-5]
    winds = []
    for loop in room.loops:
        away = loop.polyline(FINE)[:, None] - p[None, :, :2]
        angle = np.unwrap(np.arctan2(away[..., 1], away[..., 0]), axis=0)
        closing = np.angle(np.exp(1j * (angle[0] - angle[-1])))
        winds.append(np.abs(np.rint((angle[-1] - angle[0] + closing) / (2 * np.pi))) == 1)
    expected = winds[0] & ~np.any(winds[1:], axis=0) if len(winds) > 1 else winds[0]
    np.testing.assert_array_equal(room.inside(p), expected)


@pytest.mark.parametrize("turn", [0.0, 0.5 * np.pi, np.pi, 0.3, 2.0])
def test_points_on_a_chord(turn):
    """What lies on the chord between two arcs is inside, however the chord is rounded."""
    c = np.array([0.35, 0.4])
    for bulges in ([1, 1], [0.3, 0.8], [-0.3, -0.8], [0.8, -0.3]):
        along = 0.1 * np.array([np.cos(turn), np.sin(turn)])
        loop = Loop([c - along, c + along], bulges)
        t = np.linspace(-0.999, 0.999, 999)[:, None]
        assert loop.encloses(c + t * along).all() == (np.prod(bulges) > 0)
        assert not loop.encloses(c + np.sign(t) * (1.01 + np.abs(t)) * along).any()


@every_room
def test_nearest_point(room, rng):
    """The clearance is the distance to the nearest of many points on the outline, and no more."""
    p = rng.uniform(*room.bounds, (200, 3))
    x, _ = room.sample(4000)
    spacing = sum(loop.length for loop in room.loops) / 4000
    least = np.linalg.norm(x[None] - p[:, None], axis=2).min(axis=1)
    clearance = room.clearance(p)
    assert (clearance <= least + CLOSE).all()
    assert (least <= clearance + spacing).all()


@every_room
def test_distance_along_the_surface(room, rng):
    """d is a metric, at most half the perimeter, infinite between loops, and locally Euclidean."""
    x, _ = room.sample(6000)
    a, b, c = rng.permutation(x).reshape(3, -1, 3)
    d = room.distances
    np.testing.assert_array_equal(d(a, b), d(b, a))
    assert not d(a, a).any()
    assert (d(a, c) <= d(a, b) + d(b, c) + CLOSE).all()
    (loop, _, length), (other, _, _) = room.along(a), room.along(b)
    np.testing.assert_array_equal(np.isinf(d(a, b)), loop != other)
    assert (d(a, b)[loop == other] <= length[loop == other] / 2).all()
    assert (d(a, b) >= np.linalg.norm(a - b, axis=1) - CLOSE).all()
    step = x[1:] - x[:-1]
    near = d(x[1:], x[:-1]) < 0.01
    straight = np.linalg.norm(step, axis=1)[near]
    assert np.quantile(d(x[1:], x[:-1])[near] / straight, 0.95) < 1.001


@every_room
def test_distance_follows_the_room(room, rng):
    """Turned, shifted and scaled by s, a room keeps its distances, times s."""
    where = (0.7, 2.5, np.array([3.0, -1.0]))
    x, n = room.sample(300)
    other = moved(room, *where)
    y, m = other.sample(300)
    np.testing.assert_allclose(y, moved_points(x, *where), atol=CLOSE)
    np.testing.assert_allclose(m, moved_points(n, 0.7, 1.0, np.zeros(2)), atol=CLOSE)
    i, j = rng.integers(0, 300, (2, 1000))
    np.testing.assert_allclose(
        other.distances(y[i], y[j]), 2.5 * room.distances(x[i], x[j]), atol=CLOSE
    )


@pytest.mark.parametrize(
    ("vertices", "bulges", "words"),
    [
        ([(0, 0)], 1.0, "Loop has 1 edges"),
        ([(0, 0), (1, 0)], 0.0, "Loop encloses no area"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], 0.0, "Loop.vertices[1] and the next"),
        ([(0, 0), (1, 1), (1, 0), (0, 1.5)], 0.0, "Loop crosses itself"),
        ([(0, 0), (1, 0), (1, 0.2), (0, 0.2)], [0, 0, -1, 0], "Loop crosses itself"),
        ([(0, 0), (1, np.nan), (1, 1)], 0.0, "Loop.vertices[1][1] is nan"),
        ([(0, 0), (1, 0), (1, 1)], [0, np.inf, 0], "Loop.bulges[1] is inf"),
        ([(0, 0), (1, 0), (1, 1)], [0, 0], "Loop.bulges has shape"),
        ([(0, 0, 0), (1, 0, 0.1), (1, 1, 0)], 0.0, "Loop.vertices[1] has z = 0.1"),
        ([(0, 0, 0, 0)] * 3, 0.0, "Loop.vertices has shape"),
    ],
)
def test_loops_refuse(vertices, bulges, words, refuses):
    """What is no closed curve in the plane is refused in a sentence."""
    with refuses(words):
        Loop(vertices, bulges)


@pytest.mark.parametrize(
    ("occluders", "words"),
    [
        ([([0.9, 0.5], 0.2)], "Outline.occluders[0] crosses the walls"),
        ([([1.5, 0.5], 0.2)], "Outline.occluders[0] lies outside the walls"),
        ([([0.4, 0.5], 0.2), ([0.7, 0.5], 0.2)], "Outline.occluders[1] crosses occluders[0]"),
        ([([0.4, 0.5], 0.2), ([0.4, 0.5], 0.1)], "Outline.occluders[1] and occluders[0] lie in"),
        ([([0.4, 0.5], 0.1), ([0.4, 0.5], 0.2)], "Outline.occluders[1] and occluders[0] lie in"),
    ],
)
def test_outlines_refuse(occluders, words, refuses):
    """Occluders stand within the walls, apart from each other."""
    with refuses(words):
        SQUARE.with_occluders(*(Outline.disc(*each) for each in occluders))


def test_positions_off_the_outline(refuses):
    """Where a point is not on the surface there is no distance along it."""
    with refuses("positions[1] lies 0.3 m off the outline"):
        SQUARE.along([[0.5, 0, 0], [0.5, 0.3, 0]])
    with refuses("positions[0] has z = 0.5"):
        SQUARE.along([[0.5, 0, 0.5]])
    with refuses("sample of 1 points"):
        ROOMS["bar"].sample(1)
