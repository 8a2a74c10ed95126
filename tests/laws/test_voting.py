"""Votes: laws of the voting function V(p), sections 3.4 and 4.2 to 4.4.

The plane scene is a diffuse square with 400 points along its walls (as in section 6.1), seen on a
grid of 128 x 128 positions, without noise. WIDE is a T that no two neighbours about a light
exceed; the paper's own T is tried beside it.
"""

from __future__ import annotations

import numpy as np
import pytest

import render
from lightloc import (
    Grid,
    Lambert,
    Observations,
    Perimeter,
    PointLights,
    SolidAngle,
    intensity_distance,
    radiance,
    vote,
)
from lightloc.fields.ranking import NO_LIMITER
from lightloc.paper.voting import DISCONTINUITY, MERGE, Votes, circle, icosahedron

POINTS, CELLS = 400, 128
RADIUS = np.sqrt(0.5)  # of the unit square
WIDE = 0.5 * RADIUS


def square(lights: PointLights, side: float = 1.0, points: int = POINTS) -> Observations:
    """A diffuse square room in z = 0, centred at the origin, lit by ``lights``."""
    t = (np.arange(points // 4) + 0.5) / (points // 4) - 0.5
    zero, half = np.zeros_like(t), np.full_like(t, 0.5)
    walls = ((t, -half, zero), (half, t, zero), (-t, half, zero), (-half, -t, zero))
    inward = np.array([[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]], float)
    normals = np.repeat(inward, points // 4, axis=0)
    q = Observations(
        positions=side * np.concatenate([np.stack(wall, axis=1) for wall in walls]),
        normals=normals,
        directions=normals,
        radiance=np.zeros(len(normals)),
        material=Lambert(albedo=0.5),
    )
    return q.with_radiance(radiance(q, lights), 0.0)


def edge(side: float = 1.0, points: int = POINTS) -> Perimeter:
    """The square's outline, on which its points lie evenly."""
    along = (np.arange(points) + 0.5) * 4 * side / points
    return Perimeter(np.zeros(points, int), along, np.full(points, 4.0 * side))


def votes_of(
    q: Observations, T: float = WIDE, side: float = 1.0, cells: int = CELLS, radius: int = 1
) -> Votes:
    grid = Grid.over(q.bounds, cells**2)
    _, L = intensity_distance(q, grid)
    return vote(grid, L[:, 0], edge(side, len(q)), T * side, radius)


def one_light(place: np.ndarray, scale: float = 1.0) -> PointLights:
    """A light at a place of the unit square (0 to 1), the room scaled and centred at 0."""
    return PointLights([[*(scale * (place - 0.5)), 0.0]], [scale**2])


SINGLE = [one_light(place) for place in np.random.default_rng(2018).uniform(0.05, 0.95, (24, 2))]


def off(p: np.ndarray, votes: Votes) -> float:
    """How many cells off the nearest peak above half the highest is, on the worse axis."""
    peaks = votes.peaks(votes.votes.max() / 2, RADIUS, merge=0.0)
    flat = votes.grid.step > 0
    return float((np.abs(peaks - p)[:, flat] / votes.grid.step[flat]).max(axis=1).min())


def test_peak_is_at_the_light():
    """One light in the square, T wide: a peak of V lies at it.

    A limiter runs along the wall as fast as p turns about the light: h / 2 a radian at the foot of
    a wall h away, so up to 0.4 h between two of the eight neighbours, which T must not cut off. V
    is high in all cells whose circle goes round the light: within one cell in most rooms, and two
    where the limiter leaps from wall to wall in the light's own cell.
    """
    cells = np.array([off(p.positions[0], votes_of(square(p))) for p in SINGLE])
    assert np.median(cells) <= 1
    assert np.quantile(cells, 0.9) <= 2.5


def test_peak_with_the_papers_threshold():
    """T = 5 % of the radius is 0.035: 0.4 h is more for lights further than 0.09 inside.

    So the light itself does not vote, and V peaks where consecutive pixels of the circle turn by
    less than T / (h / 2) about the light: at h / (2 T) cells, 7 for h = 0.5. Some peak is nearer.
    """
    T = DISCONTINUITY * RADIUS
    cells = np.array([off(p.positions[0], votes_of(square(p), T)) for p in SINGLE])
    assert cells.max() <= 0.5 / (2 * T)
    assert np.median(cells) > 1.5  # and so no peak at the light, as a rule


def test_the_papers_threshold_votes_for_rings():
    """Further inside, the votes with the paper's T lie around the light and not at it.

    Turning about a light h = 0.4 away by the angle between two pixels of a circle, 1 / r, moves
    the limiter by h / (2 r) at least; below T only for r > 5 cells.
    """
    lights = one_light(np.array([0.4, 0.4]))
    votes = votes_of(square(lights), DISCONTINUITY * RADIUS)
    p = votes.grid.points - lights.positions[0]
    near = (np.abs(p) < 1.5 * votes.grid.step.max()).all(axis=1).reshape(votes.grid.shape)
    assert votes.votes[near].max() < 0.5 * votes.votes.max()
    assert votes.medial_axis[near].all()


def test_peak_of_a_wrong_scene():
    """Negative control: the votes of one light are no votes for another."""
    lights, others = one_light(np.array([0.3, 0.4])), one_light(np.array([0.7, 0.6]))
    assert off(others.positions[0], votes_of(square(lights))) > 10


@pytest.mark.parametrize("T", [DISCONTINUITY * RADIUS, WIDE])
@pytest.mark.parametrize("radius", [1, 15])
def test_a_quarter_turn(T, radius):
    """Turning the square room by 90 degrees turns V with it.

    Turned points keep their float32 values up to sign and order; where two limiters tie to
    rounding either may win, so a few limiters may differ, each in the circles of its neighbours.
    """
    lights = one_light(np.array([0.37, 0.61]))
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = PointLights(lights.positions @ quarter.T, lights.intensities)
    here, there = (votes_of(square(one), T, radius=radius) for one in (lights, turned))
    a, b = np.rot90(here.votes[:, :, 0]), there.votes[:, :, 0]
    assert np.isclose(a, b, atol=1e-6).mean() > 0.97
    assert np.isclose(np.rot90(a), b, atol=1e-6).mean() < 0.9


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_scale(scale):
    """V counts limiters: it is the same in a room s times as large (s a power of 2)."""
    place = np.array([0.37, 0.61])
    once, scaled = (
        votes_of(square(one_light(place, s), side=s), DISCONTINUITY * RADIUS, s)
        for s in (1.0, scale)
    )
    np.testing.assert_allclose(scaled.votes, once.votes, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(scaled.medial_axis, once.medial_axis)


def test_votes_are_the_mean_of_the_distances():
    """Against the definition, cell by cell: consecutive pixels on the circle, T, the mean."""
    rng = np.random.default_rng(4)
    grid = Grid([0, 0, 0], [12, 9, 0], (12, 9, 1))
    L = rng.integers(0, 40, (12, 9))
    outline = Perimeter(np.zeros(40, int), np.arange(40.0), np.full(40, 40.0))
    for radius, T in ((1, 6.0), (2, 11.0), (3, 30.0)):
        V = vote(grid, L.ravel(), outline, T, radius).votes[:, :, 0]
        for x, y in ((6, 4), (3, 3), (8, 5)):
            ring = np.add(circle(radius), [x, y])
            ends = [L[tuple(a)] for a in ring]
            d = np.abs(np.subtract(ends, np.roll(ends, -1)))
            d = np.minimum(d, 40 - d)
            assert np.isclose(V[x, y], np.where(d < T, d, 0).mean(), rtol=1e-6)


@pytest.mark.parametrize("radius", [1, 2, 3, 7, 15])
def test_circle(radius):
    """Each pixel of the circle is a neighbour of the next, none twice, all at its radius."""
    ring = circle(radius)
    steps = np.abs(ring - np.roll(ring, -1, axis=0)).max(axis=1)
    assert (steps == 1).all()
    assert len(np.unique(ring, axis=0)) == len(ring)
    assert np.abs(np.linalg.norm(ring, axis=1) - radius).max() <= np.sqrt(0.5)


def test_peak_in_three_dimensions(load):
    """In a box with one light V peaks within two cells of it, on a grid of 32^3."""
    room = load("box_one")
    q = render.observe(room, points=4096, seed=1, transport="direct")
    grid = Grid.over(q.bounds, 32**3)
    _, L = intensity_distance(q, grid, room.geometry)
    radius = q.diagonal / 2
    votes = vote(grid, L[:, 0], SolidAngle(q.positions), 0.5 * radius)
    assert votes.votes.shape == grid.shape
    peak = votes.peaks(votes.votes.max() / 2, radius)[0]
    assert (np.abs(peak - room.lights.positions[0]) / grid.step).max() <= 2


def test_no_limiter_no_votes():
    """Cells without a limiter vote for nothing, and nothing is not a number."""
    for shape in ((4, 4, 4), (4, 4, 1)):
        grid = Grid([0, 0, 0], shape, shape)
        limiters = np.full(np.prod(shape), NO_LIMITER, np.uint32)
        votes = vote(grid, limiters, SolidAngle(np.eye(3)), 1.0)
        assert not votes.votes.any()
        assert not votes.medial_axis.any()
        assert votes.peaks(1.0, 1.0).shape == (0, 3)


def test_one_limiter_everywhere():
    """Where L is the same all around, there is no vote and no medial axis."""
    grid = Grid([0, 0, 0], [4, 4, 0], (4, 4, 1))
    votes = vote(grid, np.zeros(16, int), edge(), WIDE)
    assert not votes.votes.any()
    assert not votes.medial_axis.any()


def test_medial_axis():
    """Two walls that share the room meet at its middle line, and nowhere else (section 4.2)."""
    grid = Grid([0, 0, 0], [8, 8, 0], (8, 8, 1))
    limiters = np.repeat([0, POINTS // 2], 4 * 8)  # x is slowest: the left half has limiter 0
    for radius in (1, 2):
        votes = vote(grid, limiters, edge(), WIDE, radius)
        assert votes.medial_axis[3:5, 1:-1].all()
        assert not votes.medial_axis[:3, 1:-1].any()
        assert not votes.medial_axis[5:, 1:-1].any()
        assert not votes.votes.any()


def test_peaks_within_reach_are_one():
    """Peaks nearer than `MERGE` of the radius are one, and the highest stands for them."""
    grid = Grid([0, 0, 0], [20, 1, 0], (20, 1, 1))
    values = np.zeros(20)
    values[[4, 6, 14]] = 2.0, 3.0, 2.5
    votes = Votes(grid, values.reshape(grid.shape), np.zeros(grid.shape, bool))
    near, wide = votes.peaks(1.0, 3.0 / MERGE), votes.peaks(1.0, 100 / MERGE)
    np.testing.assert_allclose(near[:, 0], [6.5, 14.5])
    np.testing.assert_allclose(wide[:, 0], [6.5])
    np.testing.assert_allclose(votes.peaks(1.0, 0.5 / MERGE)[:, 0], [6.5, 14.5, 4.5])


def test_slopes_are_no_peaks():
    """A peak is higher than its neighbours: the flank of one is none, however high."""
    grid = Grid([0, 0, 0], [9, 9, 0], (9, 9, 1))
    x, y = np.meshgrid(np.arange(9), np.arange(9), indexing="ij")
    hill = (20 - np.hypot(x - 3, y - 5))[:, :, None]
    peaks = Votes(grid, hill, hill > 99).peaks(10.0, 1e-3)
    np.testing.assert_allclose(peaks, [[3.5, 5.5, 0]])


def test_height_is_lowered_until_a_peak_is_found():
    """H starts as high as one likes (section 4.3)."""
    grid = Grid([0, 0, 0], [5, 5, 0], (5, 5, 1))
    values = np.zeros(grid.shape)
    values[2, 3] = 1e-3
    votes = Votes(grid, values, np.zeros(grid.shape, bool))
    np.testing.assert_allclose(votes.peaks(1e6, 1.0), [[2.5, 3.5, 0]])


def test_icosahedron_covers_the_sphere():
    """The triangles about p cover 4 pi, each an equal part."""
    corners, faces = icosahedron()
    ball = SolidAngle(corners)
    a, b, c = faces.T
    np.testing.assert_allclose(ball.areas(a, b, c), 4 * np.pi / 20)
    assert len(faces) == 20
