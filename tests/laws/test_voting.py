"""Votes: laws of the voting function V(p), sections 3.4 and 4.2 to 4.4.

The plane scene is a diffuse square with 400 points along its walls (as in section 6.1), seen on a
grid of 128 x 128 positions, without noise.
"""

from __future__ import annotations

import numpy as np
import pytest

import render
from lightloc import Grid, Lambert, Observations, PointLights, intensity_distance, radiance, vote
from lightloc.fields import NO_LIMITER
from lightloc.voting import DISCONTINUITY, MERGE, SOLID_ANGLE_PIECES, Votes, _icosahedron
from lightloc.voting import _solid_angle as solid_angle

POINTS, CELLS = 400, 128
LIGHTS_OF_A_SQUARE = np.random.default_rng(2018).uniform(0.15, 0.85, (12, 2))  # in sides


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


def votes_of(q: Observations, cells: int = CELLS, radius: int = 1) -> Votes:
    grid = Grid.over(q.bounds, cells**2)
    _, L = intensity_distance(q, grid.points)
    return vote(grid, L[:, 0], q.positions, radius)


def one_light(place: np.ndarray, scale: float = 1.0) -> PointLights:
    """A light at a place of the unit square (0 to 1), the room scaled and centred at 0."""
    return PointLights([[*(scale * (place - 0.5)), 0.0]], [scale**2])


def off(q: Observations, p: np.ndarray, votes: Votes) -> float:
    """How many cells the highest peak lies from the light along the worse axis."""
    radius = np.linalg.norm(q.positions, axis=1).max()
    peak = votes.peaks(votes.votes.max() / 2, radius)[0]
    flat = votes.grid.step > 0
    return float((np.abs(peak - p)[flat] / votes.grid.step[flat]).max())


@pytest.mark.parametrize("place", LIGHTS_OF_A_SQUARE)
def test_peak_is_at_the_light(place):
    """One light in the square: V is highest within two cells of it.

    A limiter runs along the wall as fast as p turns about the light: h / 2 a radian at the foot of
    a wall h away, so up to 0.4 h between two of the eight neighbours. A threshold below that
    would leave out the light itself and vote for a ring about it.
    """
    lights = one_light(place)
    q = square(lights)
    assert off(q, lights.positions[0], votes_of(q)) <= 2


def test_peak_of_a_wrong_scene():
    """Negative control: the votes of one light are no votes for another."""
    lights, others = one_light(np.array([0.3, 0.4])), one_light(np.array([0.7, 0.6]))
    q = square(lights)
    assert off(q, others.positions[0], votes_of(q)) > 10


def test_a_quarter_turn(rng):
    """Turning the square room by 90 degrees turns V with it.

    Turned points keep their float32 values up to sign and order; where two limiters tie to
    rounding either may win, so a few cells may differ.
    """
    lights = one_light(np.array([0.37, 0.61]))
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = PointLights(lights.positions @ quarter.T, lights.intensities)
    here, there = votes_of(square(lights)), votes_of(square(turned))
    same = np.isclose(np.rot90(here.votes[:, :, 0]), there.votes[:, :, 0], atol=1e-9)
    assert same.mean() > 0.97
    assert np.isclose(np.rot90(here.votes[:, :, 0], 2), there.votes[:, :, 0]).mean() < 0.9


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_scale(scale):
    """V is a length in 2D: a room s times as large has votes s times as high (s a power of 2)."""
    place = np.array([0.37, 0.61])
    once, scaled = (votes_of(square(one_light(place, s), side=s)) for s in (1.0, scale))
    np.testing.assert_allclose(scaled.votes, scale * once.votes, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(scaled.medial_axis, once.medial_axis)


def test_peak_in_three_dimensions(load):
    """In a box with one light V peaks within two cells of it, on a grid of 32^3."""
    room = load("box_one")
    q = render.observe(room, points=4096, seed=1, transport="direct")
    grid = Grid.over(q.bounds, 32**3)
    _, L = intensity_distance(q, grid.points, room.geometry)
    votes = vote(grid, L[:, 0], q.positions)
    assert votes.votes.shape == grid.shape
    peak = votes.peaks(votes.votes.max() / 2, q.diagonal / 2)[0]
    assert (np.abs(peak - room.lights.positions[0]) / grid.step).max() <= 2


def test_no_limiter_no_votes():
    """Cells without a limiter vote for nothing, and nothing is not a number."""
    grid = Grid([0, 0, 0], [4, 4, 4], (4, 4, 4))
    votes = vote(grid, np.full(64, NO_LIMITER, np.uint32), [[0, 0, 0], [1, 1, 1]])
    assert not votes.votes.any()
    assert not votes.medial_axis.any()
    assert votes.peaks(1.0, 1.0).shape == (0, 3)


def test_one_limiter_everywhere():
    """Where L is the same all around, there is no vote and no medial axis."""
    grid = Grid([0, 0, 0], [4, 4, 0], (4, 4, 1))
    votes = vote(grid, np.zeros(16, int), [[0, 0, 0], [1, 1, 0]])
    assert not votes.votes.any()
    assert not votes.medial_axis.any()


def test_medial_axis():
    """Two walls that share the room meet at its middle line, and nowhere else (section 4.2)."""
    grid = Grid([0, 0, 0], [8, 8, 0], (8, 8, 1))
    limiters = np.repeat([0, 1], 4 * 8)  # x is slowest: the left half has limiter 0
    votes = vote(grid, limiters, [[0, 4, 0], [8, 4, 0]])
    assert votes.medial_axis[3:5, 1:-1].all()
    assert not votes.medial_axis[:3, 1:-1].any()
    assert not votes.medial_axis[5:, 1:-1].any()
    assert not votes.votes.any()


def test_peaks_within_reach_are_one():
    """Peaks nearer than `MERGE` of the radius are one, and the highest stands for them."""
    grid = Grid([0, 0, 0], [20, 1, 0], (20, 1, 1))
    values = np.zeros(20)
    values[[4, 5, 14]] = 2.0, 3.0, 2.5
    votes = Votes(grid, values.reshape(grid.shape), np.zeros(grid.shape, bool))
    near, wide = votes.peaks(1.0, 2.0 / MERGE), votes.peaks(1.0, 100 / MERGE)
    np.testing.assert_allclose(near[:, 0], [5.5, 14.5])
    np.testing.assert_allclose(wide[:, 0], [5.5])
    np.testing.assert_allclose(votes.peaks(1.0, 0.5 / MERGE)[:, 0], [5.5, 14.5, 4.5])


def test_height_is_lowered_until_a_peak_is_found():
    """H starts as high as one likes (section 4.3)."""
    grid = Grid([0, 0, 0], [5, 5, 0], (5, 5, 1))
    values = np.zeros(grid.shape)
    values[2, 3] = 1e-3
    votes = Votes(grid, values, np.zeros(grid.shape, bool))
    np.testing.assert_allclose(votes.peaks(1e6, 1.0), [[2.5, 3.5, 0]])


def test_solid_angle_of_an_octant():
    """The three axes span an eighth of the sphere, pi / 2, at any distance and in any order."""
    x, y, z = np.eye(3)
    assert np.isclose(solid_angle(x, y, z), np.pi / 2)
    assert np.isclose(solid_angle(5 * y, 0.1 * x, z), np.pi / 2)
    assert np.isclose(solid_angle(x, x, z), 0)


def test_icosahedron_covers_the_sphere():
    """The triangles about p cover 4 pi, each an equal part."""
    corners, faces = _icosahedron()
    parts = np.array([solid_angle(*corners[face]) for face in faces])
    np.testing.assert_allclose(parts, 4 * np.pi / SOLID_ANGLE_PIECES)
    assert 0 < DISCONTINUITY <= 1
