"""Lights that are known, looked for and found: rooms without interreflection.

Without noise what is exact must come back exact: the right count, positions within 0.1 % of the
room's diagonal, intensities within 0.5 %. (Measured: a few 1e-6 %.)
"""

from __future__ import annotations

import numpy as np
import pytest

import lightloc
import render
import validation
from lightloc import Lambert, Mixed, Observations, PointLights, Reason, localize, radiance
from lightloc.search.climb import PATIENCE

POSITION, INTENSITY = 0.1, 0.5  # limits, percent
POINTS, SEED = 2048, 1


def judged(found: lightloc.Localization, room: render.Room) -> validation.Comparison:
    return validation.compare(found.lights, room.lights, room.diagonal)


def assert_exact(found: lightloc.Localization, room: render.Room) -> None:
    verdict = judged(found, room)
    assert verdict.count_right, verdict
    assert not verdict.missed, verdict
    assert verdict.worst_position_percent < POSITION, verdict
    assert verdict.worst_intensity_percent < INTENSITY, verdict
    assert found.reason is Reason.CONVERGED


def observed(room: render.Room, noise: float = 0.0, points: int = POINTS) -> Observations:
    return render.observe(room, points=points, seed=SEED, transport="direct", noise=noise)


@pytest.mark.parametrize(
    ("name", "parameters", "points"),
    [
        ("box_two", {}, POINTS),
        ("box_occluder", {}, 4096),
        ("alcove", {}, POINTS),
        ("box_conductor", {"alpha": 0.1}, 4096),
        ("box_colored", {}, 1024),
    ],
)
def test_noiseless(name, parameters, points, load):
    """Empty, with occluders, glossy, coloured: all lights are found, and exactly."""
    room = load(name, **parameters)
    found = localize(observed(room, points=points), room.geometry)
    assert_exact(found, room)
    assert (found.bound >= found.lights.intensities * (1 - 1e-4)).all()
    assert not found.inseparable


def test_a_wrong_light_is_seen(load):
    """Negative control: the judge's limits fail a light moved by 1 % or 2 % too bright."""
    room = load("box_two")
    found = localize(observed(room), room.geometry)
    one = np.eye(2)[:, :1]
    for lights in (
        PointLights(found.lights.positions + 0.01 * room.diagonal * one, found.lights.intensities),
        PointLights(found.lights.positions, found.lights.intensities * (1 + 0.02 * one)),
    ):
        verdict = validation.compare(lights, room.lights, room.diagonal)
        worst = verdict.worst_position_percent / POSITION, verdict.worst_intensity_percent
        assert worst[0] > 1 or worst[1] > INTENSITY


def test_dropped_occluders_are_seen(load):
    """Negative control: without its pillar and table a room does not converge on its lights."""
    room = load("box_occluder")
    found = localize(observed(room), None)
    assert found.reason is not Reason.CONVERGED or not judged(found, room).count_right


def test_noise(load):
    """With 5 % noise (section 6.1) the lights lie within their own standard errors.

    Chi-square of the errors over 12 parameters is below 40 with probability 1 - 7e-5.
    """
    room = load("box_three")
    found = localize(observed(room, noise=0.05, points=4096), room.geometry)
    verdict = judged(found, room)
    assert verdict.count_right, verdict
    assert verdict.worst_position_percent < 1
    assert verdict.worst_intensity_percent < 2
    assert found.reason is Reason.CONVERGED
    order = [pair.true for pair in sorted(verdict.pairs, key=lambda pair: pair.found)]
    true = PointLights(room.lights.positions[order], room.lights.intensities[order])
    error = np.concatenate(
        [
            (found.lights.positions - true.positions).ravel(),
            (found.lights.intensities - true.intensities).ravel(),
        ]
    )
    assert error @ np.linalg.solve(found.covariance, error) < 40


def square(n: int = 400, side: float = 3.0) -> Observations:
    """A dark diffuse square room in the plane z = 0 with n points along its walls."""
    t = (np.arange(n // 4) + 0.5) / (n // 4)
    zero, one = np.zeros_like(t), np.ones_like(t)
    walls = ((t, zero, zero), (one, t, zero), (1 - t, one, zero), (zero, 1 - t, zero))
    inward = np.array([[0, 1, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0]], float)
    normals = np.repeat(inward, n // 4, axis=0)
    return Observations(
        positions=side * np.concatenate([np.stack(wall, axis=1) for wall in walls]),
        normals=normals,
        directions=normals,
        radiance=np.zeros(len(normals)),
        material=Lambert(albedo=0.5),
    )


def test_plane_room():
    """Three lights in a 2D room: found in its plane, with no error across it."""
    q = square()
    lights = PointLights([[0.6, 0.9, 0], [2.1, 2.3, 0], [2.0, 0.7, 0]], [3.0, 5.0, 2.0])
    found = localize(q.with_radiance(radiance(q, lights), 0.0))
    assert len(found.lights) == 3
    assert not found.lights.positions[:, 2].any()
    assert not found.position_error[:, 2].any()
    assert found.covariance.shape == (9, 9)
    verdict = validation.compare(found.lights, lights, q.diagonal)
    assert verdict.worst_position_percent < POSITION
    assert verdict.worst_intensity_percent < INTENSITY


def test_dark_room():
    """Where nothing is lit there is no light, and the reason says so."""
    found = localize(square())
    assert found.reason is Reason.DARK
    assert len(found.lights) == 0
    assert found.bound.shape == (0, 1)
    assert found.covariance.shape == (0, 0)
    assert "0 light" in str(found)


def test_noise_alone_is_no_light():
    """Observations that are noise about darkness are explained by darkness."""
    q = square()
    sigma = 0.1
    noise = sigma * np.random.default_rng(5).normal(size=(len(q), 1))
    found = localize(q.with_radiance(noise, sigma))
    assert found.reason is Reason.DARK
    assert len(found.lights) == 0
    assert len(found.history) <= PATIENCE[0] + 1  # and no long search for any


def test_few_observations(load):
    """A light that only 24 points see is pinned down by them: 4 unknowns, 24 equations."""
    room = load("box_one")
    found = localize(observed(room, points=24), room.geometry)
    assert_exact(found, room)


def test_a_light_in_a_corner_seen_by_few():
    """A faint light near a corner of a 2D room lights few points much; it is found all the same."""
    q = square()
    lights = PointLights([[1.6, 1.4, 0], [2.9, 2.85, 0]], [5.0, 0.01])
    found = localize(q.with_radiance(radiance(q, lights), 0.0))
    verdict = validation.compare(found.lights, lights, q.diagonal)
    assert verdict.count_right, verdict
    assert verdict.worst_position_percent < POSITION


def test_same_seed_same_answer(load):
    """The same observations and seed give the same answer to the bit."""
    room = load("box_two")
    q = observed(room, noise=0.01)
    once, twice = localize(q, room.geometry, seed=3), localize(q, room.geometry, seed=3)
    np.testing.assert_array_equal(once.lights.positions, twice.lights.positions)
    np.testing.assert_array_equal(once.lights.intensities, twice.lights.intensities)
    np.testing.assert_array_equal(once.covariance, twice.covariance)
    assert once.history == twice.history


def shuffled(q: Observations, order: np.ndarray) -> Observations:
    """The observations in another order, each with its own material."""
    material = Mixed((q.material,), np.zeros(len(q), int)[order])
    if isinstance(q.material, Mixed):
        material = Mixed(q.material.brdfs, q.material.index[order])
    elif isinstance(q.material, Lambert):
        albedo = q.material.albedo
        material = Lambert(albedo=albedo[order] if len(albedo) == len(q) else albedo)
    return Observations(
        positions=q.positions[order],
        normals=q.normals[order],
        directions=q.directions[order],
        radiance=q.radiance[order],
        sigma=q.sigma[order],
        material=material,
        facets=q.facets[order],
    )


def test_order_of_observations(load, rng):
    """The order of the observations decides nothing but the sample and the order of sums.

    Both answers minimize the same chi-square to the tolerance of the fit (1e-8 of a step).
    """
    room = load("box_two")
    q = observed(room)
    here = localize(q, room.geometry)
    there = localize(shuffled(q, rng.permutation(len(q))), room.geometry)
    np.testing.assert_allclose(there.lights.positions, here.lights.positions, atol=1e-5)
    np.testing.assert_allclose(there.lights.intensities, here.lights.intensities, rtol=1e-5)


def test_no_geometry_in_an_empty_room(load):
    """In a convex empty room nothing occludes: ``geometry=None`` finds the same lights."""
    room = load("box_three")
    q = observed(room)
    given, none = localize(q, room.geometry), localize(q)
    assert_exact(none, room)
    np.testing.assert_allclose(none.lights.positions, given.lights.positions, atol=1e-5)


def test_bounds_are_kept(load):
    """Lights are looked for within the bounds that are given, and nowhere else."""
    room = load("box_two")
    low, high = room.bounds
    bounds = np.array([low, [*(low + high)[:2] / 2, high[2]]])
    found = localize(observed(room), room.geometry, bounds=bounds)
    assert (found.lights.positions >= bounds[0]).all()
    assert (found.lights.positions <= bounds[1]).all()


def test_bounds_of_a_wrong_shape(load, refuses):
    """Bounds that are not two corners are refused in a sentence."""
    with refuses("bounds"):
        localize(square(), bounds=[0, 0, 0])
