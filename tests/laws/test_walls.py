"""Walls followed through points on them: the laws of `Perimeter.of`, against the true outline.

Points on straight walls and on arcs that turn by less than 30 degrees a step lie exactly as far
apart as along the outline, to rounding. Where a curved wall meets another in a corner, the two are
continued straight, which is off by a small share of the one step around it.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import Outline, Perimeter
from lightloc.plane.walls import NEAREST, _pairs, follow
from validation.rooms.plane import named_outlines, rooms_with_discs

OUTLINES = {**named_outlines(), "eight discs": rooms_with_discs(8, 2, count=1)[0].outline}
KINKS = 0.05  # steps: corners of curved walls; 0.006 was measured at 400 points a room
ROUNDING = 1e-9  # of a step
MOST_PAIRS = 2 * (NEAREST + 1)  # looked at for a point, before it and after

every_outline = pytest.mark.parametrize("name", OUTLINES)


def unevenly(outline: Outline, n: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """n of 20 n points along an outline, twice as many on one side of the room, in any order."""
    x, normals = outline.sample(20 * n)
    share = np.where(x[:, 0] < x[:, 0].mean(), 2.0, 1.0)
    some = rng.choice(len(x), n, replace=False, p=share / share.sum())
    return x[some], normals[some]


def some_pairs(n: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Random pairs, and all of neighbours in order."""
    a, b = rng.integers(0, n, (2, 20_000))
    return np.concatenate([a, np.arange(n)]), np.concatenate([b, np.roll(np.arange(n), -1)])


def assert_like(found: Perimeter, true: Perimeter, rng: np.random.Generator, steps: float) -> None:
    """The same distances to within so many steps, and infinite ones between the same walls."""
    a, b = some_pairs(len(true.loop), rng)
    np.testing.assert_allclose(
        found.distances(a, b), true.distances(a, b), rtol=0, atol=steps * true.spacing
    )


@every_outline
def test_evenly_sampled(name, rng):
    """At section 6.1's 400 points, walls and occluders of all makes are found as they are."""
    outline = OUTLINES[name]
    x, normals = outline.sample(400)
    true, found = Perimeter(*outline.along(x)), Perimeter.of(x, normals)
    assert_like(found, true, rng, KINKS)
    assert len(np.unique(found.loop)) == len(outline.loops)
    assert np.isclose(found.spacing, true.spacing, rtol=KINKS / 400)


@pytest.mark.parametrize("name", ["square", "L", "circle", "bar"])
def test_unevenly_sampled(name, rng):
    """Steps of a twentieth to some ten times the mean change nothing, straight or around arcs."""
    outline = OUTLINES[name]
    x, normals = unevenly(outline, 400, rng)
    assert_like(Perimeter.of(x, normals), Perimeter(*outline.along(x)), rng, ROUNDING)


def test_clusters(rng):
    """Forty points in a hundredth of a side, then none for half of it: the nearest lie behind."""
    outline = OUTLINES["square"]
    s = np.concatenate([np.linspace(start, start + 0.01, 40) for start in np.arange(0.2, 4, 0.5)])
    x, along = outline.walls.at(s)
    normals = along[:, ::-1] * [-1, 1]
    true = Perimeter(np.zeros(len(s), int), s, np.full(len(s), 4.0))
    assert_like(Perimeter.of(x, normals), true, rng, ROUNDING)


@every_outline
def test_order(name, rng):
    """Observations in another order lie as far apart as before, to the bit."""
    x, normals = OUTLINES[name].sample(300)
    order = rng.permutation(300)
    here, there = Perimeter.of(x, normals), Perimeter.of(x[order], normals[order])
    a, b = some_pairs(300, rng)
    np.testing.assert_array_equal(there.distances(a, b), here.distances(order[a], order[b]))


@every_outline
def test_motion_and_scale(name, rng):
    """A room that is turned, moved and s times as large has distances s times as long."""
    x, normals = OUTLINES[name].sample(300)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    moved = Perimeter.of(5.0 * x @ turn + [3.0, -2.0, 0.0], normals @ turn)
    a, b = some_pairs(300, rng)
    d = Perimeter.of(x, normals).distances(a, b)
    np.testing.assert_allclose(moved.distances(a, b), 5.0 * d, rtol=0, atol=1e-12)


@every_outline
def test_points_seen_twice(name, rng):
    """Two observations of one point lie 0 m apart, and as far from all others."""
    x, normals = OUTLINES[name].sample(200)
    once, twice = (
        Perimeter.of(x, normals),
        Perimeter.of(np.tile(x, (2, 1)), np.tile(normals, (2, 1))),
    )
    a, b = some_pairs(200, rng)
    assert not twice.distances(a, a + 200).any()
    np.testing.assert_array_equal(twice.distances(a, b + 200), once.distances(a, b))


def test_points_in_the_corners(rng):
    """A corner may be a point of both its walls, with both normals, or nearly one of them."""
    t = np.linspace(0, 1, 101)[:, None]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], float)
    sides = [a + t * (b - a) for a, b in itertools.pairwise(corners)]
    inwards = np.repeat([[0.0, 1], [-1, 0], [0, -1], [1, 0]], 101, axis=0)
    along = np.concatenate([i + t[:, 0] for i in range(4)])
    true = Perimeter(np.zeros(404, int), along, np.full(404, 4.0))
    for off in (0.0, 1e-7):
        x = np.concatenate(sides) + off * rng.normal(size=(404, 2))
        assert_like(Perimeter.of(x, inwards), true, rng, ROUNDING + 1e4 * off)


@every_outline
def test_wrong_normals(name, rng):
    """Normals that are off by a Gaussian of 5 degrees cost a step at most some tenths of itself."""
    outline = OUTLINES[name]
    x, normals = outline.sample(400)
    angle = np.radians(5) * rng.normal(size=400)
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [c * normals[:, 0] - s * normals[:, 1], s * normals[:, 0] + c * normals[:, 1]], 1
    )
    true, found = Perimeter(*outline.along(x)), Perimeter.of(x[:, :2], turned)
    a, b = np.arange(400), np.roll(np.arange(400), -1)
    d, expected = found.distances(a, b), true.distances(a, b)
    np.testing.assert_array_equal(np.isinf(d), np.isinf(expected))
    same = np.isfinite(d)
    np.testing.assert_allclose(d[same], expected[same], rtol=0, atol=0.3 * true.spacing)


def test_a_wall_that_is_seen_in_part(rng):
    """It is open: no way around, the rest as before; a spacing is that of its points."""
    outline = OUTLINES["square"]
    x, normals = outline.sample(400)
    seen = x[:, 0] < 0.8
    true, found = Perimeter(*outline.along(x[seen])), Perimeter.of(x[seen], normals[seen])
    assert np.isinf(found.length).all()
    assert not found.loop.any()
    assert np.isclose(found.spacing, 0.01)
    a, b = rng.integers(0, seen.sum(), (2, 5000))
    other_way = np.abs(true.along[a] - true.along[b]) > 2.1  # not through the part left out
    d = found.distances(a, b)
    within = true.distances(a, b) < 0.9
    assert within.sum() > 1000
    near = within & ~other_way | (d < 1)
    np.testing.assert_allclose(d[near], true.distances(a, b)[near], rtol=0, atol=1e-12)


def test_normals_tell_where_free_space_is(rng):
    """Negative control: with every other normal turned over, a wall is two, one on each side."""
    x, normals = OUTLINES["circle"].sample(400)
    normals[::2] *= -1
    found = Perimeter.of(x, normals)
    assert (found.loop[::2] == found.loop[0]).all()
    assert (found.loop[1::2] == found.loop[1]).all()
    assert found.loop[0] != found.loop[1]


def test_pairs_in_proportion_to_the_points():
    """No more than so many a point are looked at, however many points there are."""
    for n in (5, 400, 6400):
        x, _ = OUTLINES["discs"].sample(n)
        all_of = np.arange(n)
        assert len(_pairs(x[:, :2], all_of, all_of)[0]) <= MOST_PAIRS * n


def test_a_few_points(refuses):
    """One point, or two that face each other, are walls of their own, and no neighbour is near."""
    for n in (1, 2):
        x, normals = OUTLINES["circle"].sample(n)
        found = Perimeter.of(x, normals)
        assert found.loop.tolist() == list(range(n))
        assert np.isinf(found.spacing)
    corner = Perimeter.of([[1, 0, 0], [1, 0, 0]], [[0, 1, 0], [-1, 0, 0]])  # which comes first?
    assert np.isinf(corner.distances(np.array([0]), np.array([1]))).all()
    with refuses("positions are empty"):
        follow(np.zeros((0, 3)), np.zeros((0, 3)))
    with refuses("positions[0] has z = 1"):
        follow([[0, 0, 1]], [[1, 0, 0]])
