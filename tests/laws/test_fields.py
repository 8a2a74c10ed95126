"""The laws of section 3.2: I(q, p) at the one light is its intensity, and D bounds every light.

Tolerances derive from float32: I = B / S inherits the relative error of S (fixture ``rounding``).
For rendered rooms S agrees with the renderer's own to `AGREEMENT` (float32, grazing plastic
included).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import render
from lightloc import (
    Conductor,
    Grid,
    Lambert,
    Observations,
    PointLights,
    intensity,
    intensity_distance,
    radiance,
    shading,
)
from lightloc.fields.field import NO_LIMITER, Field, limits
from lightloc.optics.kernel import surfels

LIGHT = np.array([0.4, -0.3, 1.1])
INTENSITY = 5.0
OTHERS = np.array([[-1.2, 0.8, 0.4], [1.6, 1.5, -0.7], [0.1, -1.7, 1.3], [-0.5, -0.6, -1.4]])
STRENGTHS = np.array([5.0, 2.0, 7.0, 1.0, 3.0])
BOUNDS = [[-2, -2, -2], [2, 2, 2]]
CELLS = 500
AGREEMENT = 1e-4
SQUARE_SIDE = 3.0  # metres
WALL_POINTS = 40  # on each wall of the 2D room


def lit_by(q: Observations, lights: PointLights) -> Observations:
    """The observations with the direct radiance of lights that nothing occludes."""
    return q.with_radiance(radiance(q, lights), 0.0)


@pytest.fixture
def square() -> Observations:
    """A diffuse square room in the plane z = 0, still dark."""
    t = (np.arange(WALL_POINTS) + 0.5) / WALL_POINTS
    zero, one = np.zeros_like(t), np.ones_like(t)
    x = np.concatenate(
        [
            np.stack(c, axis=1)
            for c in ((t, zero, zero), (one, t, zero), (1 - t, one, zero), (zero, 1 - t, zero))
        ]
    )
    inward = [[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]]
    n = np.repeat(np.array(inward, float), WALL_POINTS, axis=0)
    return Observations(
        positions=SQUARE_SIDE * x,
        normals=n,
        directions=n,
        radiance=np.zeros(len(n)),
        material=Lambert(albedo=0.5),
    )


def test_one_light_has_its_intensity_everywhere(sample, facing, rounding):
    """In a one-light scene I(q, p1) = I1 for every q, whatever the BRDF (below Eq. 3)."""
    q = lit_by(facing(sample.brdf, LIGHT), PointLights([LIGHT], [INTENSITY]))
    I = intensity(q, [LIGHT])[:, 0]
    assert (q.radiance > 0).all()
    assert (np.abs(I / INTENSITY - 1) <= rounding(q, LIGHT, sample.alpha)).all()


def test_elsewhere_the_intensities_disagree(sample, facing):
    """Negative control: 10 cm beside the light the I(q, p) spread by far more than rounding."""
    q = lit_by(facing(sample.brdf, LIGHT), PointLights([LIGHT], [INTENSITY]))
    I = intensity(q, [LIGHT + np.array([0.1, 0, 0])])[:, 0]
    assert np.std(I[np.isfinite(I)]) > 0.01 * INTENSITY


@pytest.mark.parametrize("k", [1, 2, 3, 5])
def test_bound_at_every_light(k, sample, facing, rounding):
    """D(p) at a true light is at least its intensity, for any number of lights (Eq. 5, 6)."""
    places = np.concatenate([[LIGHT], OTHERS])[:k]
    q = facing(sample.brdf, LIGHT)
    q = lit_by(q, PointLights(places, STRENGTHS[:k]))
    D, _ = intensity_distance(q, places)
    # The light that everything faces is the one whose rounding is bounded.
    allowed = rounding(q, LIGHT, sample.alpha).max()
    assert (D[0] >= STRENGTHS[0] * (1 - allowed)).all()
    assert (STRENGTHS[:k, None] * (1 - AGREEMENT) <= D).all()
    if k == 1:
        np.testing.assert_allclose(D[0], STRENGTHS[0], rtol=allowed)


@pytest.mark.parametrize("name", ["box_three", "box_occluder", "furnished", "box_colored"])
def test_bound_in_a_rendered_room(name, load):
    """The bound holds where things occlude, and with every BRDF of a furnished room.

    It holds for all points of smooth meshes too, where a light can stand above the shading
    horizon and below the triangle's own.
    """
    room = load(name)
    q = render.observe(room, points=2048, seed=7, transport="direct")
    D, _ = intensity_distance(q, room.lights.positions, room.geometry)
    assert (room.lights.intensities * (1 - AGREEMENT) <= D).all()


def test_without_the_occluders_the_bound_breaks(load):
    """Negative control: shadows taken for lit surfaces limit a light to nothing."""
    room = load("box_occluder")
    q = render.observe(room, points=1024, seed=7, transport="direct")
    D, _ = intensity_distance(q, room.lights.positions)
    assert (0.9 * room.lights.intensities > D).any()


def test_interreflection_only_loosens_the_bound(load):
    """Indirect light raises B, so D with it is still a bound, and a looser one."""
    room = load("box_one")
    direct = render.observe(room, points=512, seed=7, transport="direct")
    full = render.observe(room, points=512, seed=7, transport="full", spp=64)
    D, _ = intensity_distance(direct, room.lights.positions, room.geometry)
    looser, _ = intensity_distance(full, room.lights.positions, room.geometry)
    assert (looser > 1.1 * D).all()


def test_field_is_the_least_intensity(sample, facing):
    """D and L agree with the brute-force minimum of I(q, p), Eq. 6 and 7.

    Both divide the same float32 S; the field divides in float32, so they differ by roundings.
    """
    q = lit_by(facing(sample.brdf, LIGHT), PointLights([LIGHT, OTHERS[0]], STRENGTHS[:2]))
    points = Grid.over(BOUNDS, CELLS).points
    D, L = intensity_distance(q, points)
    I = intensity(q, points)
    np.testing.assert_allclose(D, I.min(axis=0), rtol=1e-5)
    found = L != NO_LIMITER
    attained = np.take_along_axis(I, np.where(found, L, 0)[None].astype(int), axis=0)[0]
    np.testing.assert_allclose(attained[found], D[found], rtol=1e-5)
    assert np.isinf(D[~found]).all()


def test_field_with_occluders_is_the_least_intensity(load):
    """The same where the field skips observations that are occluded."""
    room = load("box_occluder")
    q = render.observe(room, points=512, seed=2, transport="direct")
    points = Grid.over(room.bounds, CELLS).points
    D, L = intensity_distance(q, points, room.geometry)
    I = intensity(q, points, room.geometry)
    np.testing.assert_allclose(D, I.min(axis=0), rtol=1e-5)
    found = L[:, 0] != NO_LIMITER
    attained = I[L[found, 0], np.flatnonzero(found), 0]
    np.testing.assert_allclose(attained, D[found, 0], rtol=1e-5)


@pytest.mark.parametrize("scale", [0.01, 7.3])
def test_scale(scale, sample, facing):
    """A room s times as large with lights s^2 as strong has D s^2 as high, and the same B."""
    q = lit_by(facing(sample.brdf, LIGHT), PointLights([LIGHT, OTHERS[1]], STRENGTHS[:2]))
    points = Grid.over(BOUNDS, CELLS).points
    D, _ = intensity_distance(q, points)
    scaled, _ = intensity_distance(replace(q, positions=scale * q.positions), scale * points)
    # A grid point near a surface or near its horizon magnifies the rounding of positions.
    finite = np.isfinite(D) & np.isfinite(scaled)
    assert (np.isfinite(D) == np.isfinite(scaled)).mean() > 0.99
    error = np.abs(scaled / scale**2 / np.where(finite, D, 1) - 1)[finite]
    assert np.quantile(error, 0.99) < 1e-4
    brighter, _ = intensity_distance(q.with_radiance(4 * q.radiance, 0.0), points)
    np.testing.assert_array_equal(brighter, 4 * D)


def test_plane_scene(square):
    """In a 2D scene (z = 0, a grid one cell deep) D is I at the light and above it nowhere lower.

    A light anywhere could be no brighter than D; the true one attains it.
    """
    p = np.array([1.1, 1.9, 0.0])
    q = lit_by(square, PointLights([p], [INTENSITY]))
    grid = Grid.over(q.bounds, 32 * 32)
    assert grid.shape == (32, 32, 1)
    D, L = intensity_distance(q, grid.points)
    assert (grid.points[:, 2] == 0).all()
    assert np.isfinite(D).all()
    assert (len(q) > L).all()
    at_light, _ = intensity_distance(q, [p])
    np.testing.assert_allclose(at_light, INTENSITY, rtol=1e-5)
    np.testing.assert_allclose(D[:, 0], intensity(q, grid.points).min(axis=0)[:, 0], rtol=1e-5)


def test_nothing_limits_behind_every_surface():
    """Behind all observed surfaces D is infinite and L is `NO_LIMITER`."""
    floor = Observations(
        positions=[[0, 0, 0], [1, 0, 0]],
        normals=[[0, 0, 1]] * 2,
        directions=[[0, 0, 1]] * 2,
        radiance=[1.0, 2.0],
        material=Lambert(albedo=0.5),
    )
    D, L = intensity_distance(floor, [[0.3, 0.2, -1.0], [0.3, 0.2, 1.0]])
    assert np.isinf(D[0]).all()
    assert (L[0] == NO_LIMITER).all()
    assert np.isfinite(D[1]).all()


def test_dark_observations_forbid_every_light(square):
    """Where B = 0 at surfaces that face p, D(p) is 0."""
    D, L = intensity_distance(square, Grid.over(square.bounds, 64).points)
    assert not D.any()
    assert (L != NO_LIMITER).all()


def test_no_position():
    """No position, no bound."""
    q = Observations(
        positions=[[0, 0, 0]],
        normals=[[0, 0, 1]],
        directions=[[0, 0, 1]],
        radiance=[[1.0, 2.0, 3.0]],
        material=Lambert(albedo=0.5),
    )
    D, L = intensity_distance(q, np.zeros((0, 3)))
    assert D.shape == L.shape == (0, 3)


def test_margin_raises_the_bound(square):
    """A margin of m raises B by m standard errors first, and D(p) = min (B + m sigma) / S.

    With 5 % noise the plain D undercuts the true light; with three standard errors it does not.
    """
    p = np.array([[1.1, 1.9, 0.0]])
    q = lit_by(square, PointLights(p, [INTENSITY]))
    sigma = 0.05 * q.radiance
    noise = np.random.default_rng(3).normal(size=q.radiance.shape)
    noisy = q.with_radiance(q.radiance + sigma * noise.clip(-2.9, 2.9), sigma)
    plain, _ = intensity_distance(noisy, p)
    safe, _ = intensity_distance(noisy, p, margin=3.0)
    assert plain[0, 0] < INTENSITY < safe[0, 0]
    S = shading(q, p)[:, 0]
    np.testing.assert_allclose(safe[0], ((noisy.radiance + 3 * sigma) / S).min(axis=0), rtol=1e-5)


def test_grid_is_its_points(sample, facing):
    """A grid has the field of its points: other kernels, the same D and limiters that attain it.

    The two add up n.d and |d|^2 in another order, which costs a few roundings.
    """
    q = lit_by(facing(sample.brdf, LIGHT), PointLights([LIGHT, OTHERS[0]], STRENGTHS[:2]))
    grid = Grid([-2, -2, -2], [2, 1, 2], (9, 10, 11))
    D, L = intensity_distance(q, grid)
    expected, who = intensity_distance(q, grid.points)
    np.testing.assert_allclose(D, expected, rtol=1e-5)
    assert (who != L).mean() < 0.01


@pytest.mark.parametrize("shape", [(50, 1, 1), (1, 40, 1), (1, 7, 33), (21, 1, 19), (1, 1, 1)])
def test_flat_grids(shape, square):
    """Grids one cell deep along any axis."""
    p = np.array([1.1, 1.9, 0.0])
    q = lit_by(square, PointLights([p], [INTENSITY]))
    grid = Grid([0.1, 0.2, -0.3], [2.9, 2.8, 0.4], shape)
    D, _ = intensity_distance(q, grid)
    np.testing.assert_allclose(D, intensity_distance(q, grid.points)[0], rtol=1e-5)


@pytest.mark.parametrize("material", [Lambert(albedo=0.5), Conductor(alpha=0.4)])
def test_many_radiances_at_once(material, square, rng):
    """D and L of k radiances are those of each one alone, bit for bit, for any k."""
    s = surfels(replace(square, material=material))
    B = rng.uniform(0.5, 1.5, (len(square), 13))
    grid = Grid.over(square.bounds, 5000)
    D, L = limits(s, B, grid)
    assert D.shape == L.shape == (len(grid.points), 13)
    for k in range(13):
        alone, who = limits(s, B[:, k : k + 1], grid)
        np.testing.assert_array_equal(D[:, k], alone[:, 0])
        np.testing.assert_array_equal(L[:, k], who[:, 0])


def test_field_for_one_radiance_after_another(square, rng):
    """A `Field` that is used again gives what a new one gives."""
    s, grid = surfels(square), Grid.over(square.bounds, 5000)
    kept = Field.over(s, grid)
    for k in (1, 3, 1):
        B = rng.uniform(0.5, 1.5, (len(square), k))
        D, L = kept.limits(B)
        fresh, who = Field.over(s, grid).limits(B)
        np.testing.assert_array_equal(D, fresh)
        np.testing.assert_array_equal(L, who)


def test_order_of_observations(part, facing, rng):
    """D does not depend on the order of the observations, and L follows them."""
    q = lit_by(facing(part.brdf, LIGHT), PointLights([LIGHT, OTHERS[0]], STRENGTHS[:2]))
    shuffled = rng.permutation(len(q))
    other = Observations(
        positions=q.positions[shuffled],
        normals=q.normals[shuffled],
        directions=q.directions[shuffled],
        radiance=q.radiance[shuffled],
        material=q.material,
    )
    points = Grid.over(BOUNDS, CELLS).points
    D, L = intensity_distance(q, points)
    moved, who = intensity_distance(other, points)
    np.testing.assert_array_equal(moved, D)
    found = L != NO_LIMITER
    np.testing.assert_array_equal(shuffled[who[found]], L[found])


def test_limits_of_three_channels(square):
    """A material of three channels takes three radiances, channel by channel, and no others."""
    albedo = [0.8, 0.5, 0.2]
    rgb = surfels(replace(square, material=Lambert(albedo=albedo), radiance=np.ones((160, 3))))
    points = Grid.over(square.bounds, 64).points
    D, _ = limits(rgb, np.ones((160, 3)), points)
    for c in range(3):
        one = surfels(replace(square, material=Lambert(albedo=albedo[c])))
        np.testing.assert_allclose(D[:, c], limits(one, np.ones((160, 1)), points)[0][:, 0])
    with pytest.raises(ValueError, match="expected 3"):
        limits(rgb, np.ones((160, 2)), points)


def test_limits_refuses(square, refuses):
    """Radiances below zero, or not one per observation, are refused in a sentence."""
    s, points = surfels(square), [[1.0, 1.0, 0.0]]
    with refuses("B"):
        limits(s, -np.ones((len(square), 1)), points)
    with refuses("B"):
        limits(s, np.ones((len(square) - 1, 1)), points)
    with refuses("B"):
        limits(s, np.ones(len(square)), points)


def test_grid_over():
    """About as many cubic cells as asked for, centred within the bounds; flat where they are."""
    grid = Grid.over([[0, 0, 0], [4, 2, 1]], 1000)
    assert abs(np.prod(grid.shape) / 1000 - 1) < 0.2
    assert grid.step.max() / grid.step.min() < 1.1
    points = grid.points
    assert len(points) == np.prod(grid.shape)
    np.testing.assert_allclose(points.min(axis=0), grid.lower + grid.step / 2)
    np.testing.assert_allclose(points.max(axis=0), grid.upper - grid.step / 2)
    cube = points.reshape(*grid.shape, 3)
    np.testing.assert_allclose(np.diff(cube, axis=0)[..., 0], grid.step[0])
    np.testing.assert_allclose(np.diff(cube, axis=2)[..., 2], grid.step[2])
    assert Grid.over([[0, 1, 2], [4, 3, 2]], 200).shape == (20, 10, 1)


def test_grid_around():
    """A zoomed grid keeps within reach of its centre and within the bounds."""
    grid = Grid.around([0.9, 0.5, 0.0], [0.2, 0.2, 0.2], [[0, 0, 0], [1, 1, 0]], 5)
    assert grid.shape == (5, 5, 1)
    np.testing.assert_allclose(grid.lower, [0.7, 0.3, 0.0])
    np.testing.assert_allclose(grid.upper, [1.0, 0.7, 0.0])


@pytest.mark.parametrize(
    ("lower", "upper", "shape"),
    [([0, 0, 0], [-1, 1, 1], (2, 2, 2)), ([0, 0, 0], [1, 1, 1], (2, 0, 2))],
)
def test_grid_refuses(lower, upper, shape, refuses):
    """A grid turned inside out, or without cells, is refused in a sentence."""
    with refuses("Grid"):
        Grid(lower, upper, shape)
