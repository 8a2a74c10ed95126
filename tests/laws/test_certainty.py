"""How sure: the Cramér-Rao bound and the resolution, against what fits really do."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Lambert, Observations, Options, PointLights, cramer_rao, radiance
from lightloc.fit.criterion import Criterion
from lightloc.fit.information import TOLD_APART, covariance, inseparable, resolution
from lightloc.fit.levenberg import Descents, descend
from lightloc.fit.problem import Problem
from lightloc.search.polish import sharpened
from validation.rooms.plane import rooms

SIGMA = 0.05


@pytest.fixture
def floor(rng) -> Observations:
    x = rng.uniform(-2, 2, (600, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (600, 1))
    return Observations(
        positions=x,
        normals=up,
        directions=up,
        radiance=np.zeros(600),
        sigma=SIGMA,
        material=Lambert(albedo=0.5),
    )


def test_scaling(floor):
    """Twice the noise, twice every error; twice the light, the same errors relative to it."""
    lights = PointLights([[0.3, -0.2, 1.1]], [9.0])
    once = cramer_rao(floor, lights)
    twice = cramer_rao(floor.with_radiance(floor.radiance, 2 * SIGMA), lights)
    np.testing.assert_allclose(twice.position, 2 * once.position, rtol=1e-6)
    np.testing.assert_allclose(twice.intensity, 2 * once.intensity, rtol=1e-6)
    bright = cramer_rao(floor, PointLights(lights.positions, 2 * lights.intensities))
    np.testing.assert_allclose(bright.position, once.position / 2, rtol=1e-6)
    np.testing.assert_allclose(bright.intensity, once.intensity, rtol=1e-6)


def test_known_position(floor):
    """With the position known too well to matter, the error of I is sigma / |S| (one column)."""
    lights = PointLights([[0.0, 0.0, 1.5]], [9.0])
    full = cramer_rao(floor, lights).covariance
    information = np.linalg.inv(full)
    S = radiance(floor, PointLights(lights.positions, [1.0]))
    np.testing.assert_allclose(information[3, 3], np.square(S / SIGMA).sum(), rtol=1e-5)


def test_plane_rooms_have_no_error_across(rng):
    """In a 2D scene the error across the plane is 0, as nothing can move there."""
    room = rooms(2, count=1)[0]
    q = room.observe(100)
    bound = cramer_rao(q.with_radiance(q.radiance, 0.1), room.lights)
    assert (bound.position[:, :2] > 0).all()
    assert not bound.position[:, 2].any()
    assert bound.covariance.shape == (6, 6)


def test_exact_data_have_no_bound(floor, refuses):
    with refuses("the Cramér-Rao bound"):
        cramer_rao(floor.with_radiance(floor.radiance, 0.0), PointLights([[0, 0, 1]], [1.0]))


def test_fewer_observations_than_unknowns(floor):
    """Directions that nothing measures have infinite errors, not wrong ones."""
    few = Observations(
        positions=floor.positions[:3],
        normals=floor.normals[:3],
        directions=floor.directions[:3],
        radiance=[1.0, 1.0, 1.0],
        sigma=SIGMA,
        material=floor.material,
    )
    assert np.isinf(cramer_rao(few, PointLights([[0.1, 0.2, 1.0]], [5.0])).position).any()


def test_resolution_is_what_a_fit_of_one_light_leaves():
    """Two halves as far apart as `resolution` says leave one light with `TOLD_APART` sigma.

    The prediction is to second order in the distance; with the sigma chosen here that is a tenth
    of the room's side, where the fourth order still counts: a quarter covers it.
    """
    room = rooms(2, count=1)[0]
    dark = room.observe(400)
    one = PointLights([[0.4, 0.55, 0.0]], [4.0])
    B = radiance(dark, one)
    problem = Problem.of(
        dark.with_radiance(B, 0.0), 0.03 * np.sqrt(B), None, dark.bounds, double=True
    )
    (apart,) = resolution(problem, one)
    assert 0.01 < apart < 0.2
    left = []
    for angle in np.arange(12) / 12 * np.pi:
        h = apart / 2 * np.array([np.cos(angle), np.sin(angle), 0])
        two = PointLights([one.positions[0] + h, one.positions[0] - h], [2.0, 2.0])
        halves = Problem(problem.surfels, radiance(dark, two), problem.sigma, None, problem.bounds)
        there = descend(halves, Descents.of(one.positions[None], one.intensities[None]))
        left.append(np.sqrt(there.chi2[0]))
    assert min(left) == pytest.approx(TOLD_APART, rel=0.25)


def test_nearer_lights_are_one(rng):
    """Negative control: with ten times the noise, lights ten times sqrt further are needed."""
    room = rooms(2, count=1)[0]
    q = room.observe(400)
    low, high = (
        resolution(Problem.of(q, k * np.sqrt(q.radiance), None, q.bounds), room.lights)
        for k in (0.01, 0.1)
    )
    np.testing.assert_allclose(high / low, np.sqrt(10), rtol=1e-6)


def test_covariance_is_that_of_repeated_fits():
    """80 noisy fits of two lights scatter as the covariance says: mean z^2 is 1 within 3 sigma."""
    room = rooms(2, count=1)[0]
    q = room.observe(200)
    sigma = 0.03 * np.sqrt(q.radiance)
    problem = Problem.of(q, sigma, None, q.bounds)
    spread = covariance(problem, room.lights)
    rng, errors = np.random.default_rng(5), []
    truth = np.concatenate([room.lights.positions[:, :2].ravel(), room.lights.intensities.ravel()])
    for _ in range(80):
        B = q.radiance + sigma * rng.normal(size=sigma.shape)
        noisy = Problem(problem.surfels, B, sigma, None, problem.bounds)
        fit = sharpened(noisy, Descents.at(room.lights), Criterion.of(Options()))
        found = [fit.lights.positions[:, :2].ravel(), fit.lights.intensities.ravel()]
        errors.append(np.concatenate(found) - truth)
    z2 = np.einsum("ti,ij,tj->t", errors, np.linalg.inv(spread), errors) / len(truth)
    assert abs(z2.mean() - 1) < 3 * np.sqrt(2 / (80 * len(truth))) + 0.02  # 1 % for Cauchy's loss


def test_pairs_nearer_than_their_joint_error_are_inseparable():
    """Errors of 0.3 and 0.4 m add up to 0.5 m: two lights are told apart from twice that on."""
    error = np.array([[0.3, 0, 0], [0, 0.24, 0.32], [0, 0, 0]])
    far = [50.0, 0, 0]
    for apart, pairs in ((0.99, ((0, 1),)), (1.01, ())):
        lights = PointLights([[0, 0, 0], [0, apart, 0], far], np.ones(3))
        assert inseparable(lights, error) == pairs
