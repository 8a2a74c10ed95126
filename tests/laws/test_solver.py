"""The solver: intensities are a linear problem, positions a smooth one, and errors are real."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

import render
from lightloc import Lambert, Observations, Options, PointLights, radiance, shading
from lightloc.fit.criterion import Criterion
from lightloc.fit.information import covariance, jacobian
from lightloc.fit.levenberg import Descents
from lightloc.fit.problem import Fit, Problem, intensities, no_lights, nonnegative, residuals
from lightloc.search.moves import are_needed, without_one
from lightloc.search.polish import pruned, sharpened

LIGHTS = PointLights([[0.4, -0.3, 0.9], [-1.0, 0.9, 0.2]], [5.0, 2.0])
BOUNDS = np.array([[-1.9, -1.9, -1.9], [1.9, 1.9, 1.9]])
SCALE = Options().outlier
CRITERION = Criterion.of(Options())
POINTS = 240
NOISE = 0.05  # of the mean radiance
TRIALS = 60


@pytest.fixture
def room(rng) -> Observations:
    """An empty diffuse cube, 4 m wide, still dark."""
    n = POINTS // 6
    sides = [(axis, sign) for axis in range(3) for sign in (-1, 1)]
    x = rng.uniform(-2, 2, (6, n, 3))
    normals = np.zeros((6, n, 3))
    for side, (axis, sign) in enumerate(sides):
        x[side, :, axis] = 2 * sign
        normals[side, :, axis] = -sign
    normals = normals.reshape(-1, 3)
    return Observations(
        positions=x.reshape(-1, 3),
        normals=normals,
        directions=normals,
        radiance=np.zeros(POINTS),
        material=Lambert(albedo=rng.uniform(0.2, 0.8, POINTS)),
    )


def posed(q: Observations, lights: PointLights, noise: float = NOISE) -> Problem:
    """The problem of finding ``lights``, with equal standard errors and no noise in B."""
    B = radiance(q, lights)
    return Problem.of(q.with_radiance(B, 0.0), np.full(B.shape, noise * B.mean()), None, BOUNDS)


def test_intensities_are_least_squares(room):
    """`intensities` is the non-negative least-squares solution of B / sigma = (S / sigma) I."""
    problem = posed(room, LIGHTS)
    places = np.concatenate([LIGHTS.positions, [[0.1, 0.2, -1.0]]])
    A = shading(room, places)[:, :, 0] / problem.sigma
    expected, _ = nnls(A, (problem.radiance / problem.sigma)[:, 0])
    found = intensities(problem, places)
    np.testing.assert_allclose(found[:, 0], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[:2], LIGHTS.intensities, rtol=1e-4)
    assert found[2, 0] < 1e-4


def test_intensities_are_not_negative(room):
    """A light that only negative light could explain gets none."""
    problem = posed(room, LIGHTS)
    problem = Problem(problem.surfels, -problem.radiance, problem.sigma, None, BOUNDS)
    assert not intensities(problem, LIGHTS.positions).any()


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("flat", [False, True])
def test_jacobian(channels, flat, room):
    """The Jacobian agrees with central differences of the residuals.

    Differences of float32 residuals over h = 1e-2: rounding is 1e-7 / h, truncation h^2 / d^2
    with lights a metre from every wall; a quarter of a percent of the largest entry covers both.
    """
    colours = np.array([[1.0, 0.7, 0.3], [0.2, 0.5, 1.0]])
    I = LIGHTS.intensities * (colours if channels == 3 else 1)
    lights = PointLights(LIGHTS.positions * [1, 1, 0 if flat else 1], I)
    q = Observations(
        positions=room.positions,
        normals=room.normals,
        directions=room.directions,
        radiance=np.zeros((POINTS, channels)),
        material=room.material,
    )
    bounds = BOUNDS * [1, 1, 0] if flat else BOUNDS
    B = 0.8 * radiance(q, lights)  # residuals that are not zero
    problem = Problem.of(q.with_radiance(B, 0.0), np.full(B.shape, 0.1), None, bounds)
    J = jacobian(problem, lights)
    d, h = len(problem.axes), 1e-2
    assert J.shape == (channels, POINTS, 2 * d + 2 * channels)
    for column in range(J.shape[2]):
        ends = []
        for step in (h, -h):
            p, I = lights.positions.copy(), lights.intensities.copy()
            if column < 2 * d:
                p[column // d, problem.axes[column % d]] += step
            else:
                I.ravel()[column - 2 * d] += step
            ends.append(-residuals(problem, PointLights(p, I)).T)
        slope = (ends[0] - ends[1]) / (2 * h)
        assert np.abs(J[:, :, column] - slope).max() < 2.5e-3 * np.abs(slope).max()


def test_sharpened_finds_the_minimum(room):
    """From 9 cm away and a tenth too dim the lights are found to float32 rounding."""
    start = PointLights(LIGHTS.positions + 0.05, 0.9 * LIGHTS.intensities)
    fit = sharpened(posed(room, LIGHTS), Descents.at(start), CRITERION)
    np.testing.assert_allclose(fit.lights.positions, LIGHTS.positions, atol=1e-4)
    np.testing.assert_allclose(fit.lights.intensities, LIGHTS.intensities, rtol=1e-4)
    assert fit.cost < 1e-3


def test_standard_errors_are_real(room):
    """Over 60 noisy trials the lights scatter by the standard errors that `covariance` gives.

    A standard deviation from N trials is off by 1 / sqrt(2 N - 2) = 9 % (one sigma); four
    parameters within 0.75 to 1.3 is three sigma. The loss is Cauchy's at 5 sigma, which loses 1 %
    of efficiency. The mean squared z over all parameters, with the correlations between them
    taken out, is chi-square: 1 within 3 sqrt(2 / (4 N)).
    """
    one = PointLights(LIGHTS.positions[:1], LIGHTS.intensities[:1])
    problem = posed(room, one)
    predicted = covariance(problem, one)
    rng = np.random.default_rng(7)
    found = []
    for _ in range(TRIALS):
        B = problem.radiance + problem.sigma * rng.normal(size=problem.radiance.shape)
        noisy = Problem(problem.surfels, B, problem.sigma, None, BOUNDS)
        fit = sharpened(noisy, Descents.at(one), CRITERION)
        found.append(np.concatenate([fit.lights.positions.ravel(), fit.lights.intensities.ravel()]))
    error = np.array(found) - np.concatenate([one.positions.ravel(), one.intensities.ravel()])
    ratio = np.sqrt(np.square(error).mean(axis=0) / np.diag(predicted))
    assert (ratio > 0.75).all(), ratio
    assert (ratio < 1.3).all(), ratio
    whitened = np.einsum("ti,ij,tj->t", error, np.linalg.inv(predicted), error).mean() / 4
    assert abs(whitened - 1) < 3 * np.sqrt(2 / (4 * TRIALS))


def test_errors_follow_the_noise(room):
    """Twice the noise, twice every standard error."""
    once, twice = (covariance(posed(room, LIGHTS, n), LIGHTS) for n in (NOISE, 2 * NOISE))
    np.testing.assert_allclose(np.diag(twice), 4 * np.diag(once), rtol=1e-9)


def test_what_nothing_sees_has_no_finite_error(room):
    """A light that is black leaves its position free: the error says so."""
    dark = PointLights(LIGHTS.positions, [5.0, 0.0])
    errors = np.diag(covariance(posed(room, LIGHTS), dark))
    assert np.isfinite(errors[:3]).all()
    assert np.isinf(errors[3:6]).all()


@pytest.mark.parametrize("place", [[1.95, 0, 0], [0, -5.0, 0], [3.0, 3.0, 3.0]])
def test_sharpened_keeps_within_bounds(place, room):
    """A light outside the region is looked for inside it, and never leaves it."""
    problem = posed(room, PointLights([[1.97, 0.3, -0.2]], [5.0]))
    fit = sharpened(problem, Descents.at(PointLights([place], [1.0])), CRITERION)
    assert (fit.lights.positions >= BOUNDS[0]).all()
    assert (fit.lights.positions <= BOUNDS[1]).all()
    assert (fit.lights.intensities >= 0).all()


def test_prune_drops_a_duplicate(room):
    """A light found twice is one light."""
    problem = posed(room, LIGHTS)
    twice = PointLights([*LIGHTS.positions, LIGHTS.positions[0] + [0.02, 0, 0]], [2.5, 2.0, 2.5])
    kept = pruned(problem, sharpened(problem, Descents.at(twice), CRITERION), CRITERION)
    assert len(kept) == 2
    np.testing.assert_allclose(
        np.sort(kept.lights.positions, axis=0), np.sort(LIGHTS.positions, axis=0), atol=1e-3
    )


def test_prune_keeps_what_is_needed(room):
    """Negative control: lights that explain something stay."""
    problem = posed(room, LIGHTS)
    kept = pruned(problem, sharpened(problem, Descents.at(LIGHTS), CRITERION), CRITERION)
    assert len(kept) == 2


def test_a_light_is_needed_unless_another_stands_there(room):
    """At 1e-4 of B each of two lights would be missed; a half of one that is there twice not."""
    problem = posed(room, LIGHTS, 1e-4)
    twice = PointLights([*LIGHTS.positions, LIGHTS.positions[0]], [2.5, 2.0, 2.5])
    assert are_needed(problem, Descents.at(LIGHTS), SCALE)
    assert not are_needed(problem, Descents.at(twice), SCALE)
    assert not are_needed(posed(room, LIGHTS, 0.1), Descents.at(LIGHTS), SCALE)


def test_some_of_the_rows(load):
    """A problem posed by some observations has their residuals, in a room with occluders."""
    scene = load("furnished")
    q = render.observe(scene, points=256, seed=4, transport="direct")
    whole = Problem.of(q, np.full(q.radiance.shape, 0.1), scene.geometry, scene.bounds)
    some = np.array([3, 250, 17, 17, 90])
    part = whole.rows_of(some)
    np.testing.assert_array_equal(
        shading(part.surfels, scene.lights.positions, scene.geometry),
        shading(whole.surfels, scene.lights.positions, scene.geometry)[some],
    )
    np.testing.assert_array_equal(part.radiance, whole.radiance[some])
    assert part.rows == 5
    again = part.rows_of(np.array([1, 4]))
    np.testing.assert_array_equal(
        shading(again.surfels, scene.lights.positions, scene.geometry),
        shading(whole.surfels, scene.lights.positions, scene.geometry)[[250, 90]],
    )


def test_no_lights(room):
    """The fit of darkness has all of B / sigma for its residual."""
    problem = posed(room, LIGHTS)
    fit = no_lights(problem, SCALE)
    assert isinstance(fit, Fit)
    assert len(fit) == 0
    np.testing.assert_array_equal(fit.residual, problem.radiance / problem.sigma)


def test_least_squares_where_the_active_set_goes_in_circles(room, monkeypatch):
    """What steps in reaches the same least squares: its cost to 1e-10, so the norm to 1e-5."""
    problem = posed(room, LIGHTS)
    places = np.concatenate([LIGHTS.positions, [[0.1, 0.2, -1.0]], LIGHTS.positions + 1e-3])
    A, b = shading(room, places)[:, :, 0], problem.radiance[:, 0]
    _, left = nnls(A, b)

    asked = []

    def circles(A, b):
        asked.append(len(b))
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr("lightloc.fit.problem.nnls", circles)
    found = nonnegative(A, b)
    assert (found >= 0).all()
    assert np.linalg.norm(A @ found - b) < left + 1e-5 * np.linalg.norm(b)
    assert asked == [len(b)]


def test_some_of_the_rows_keep_their_ambient_light(room):
    """What a sample leaves to the ambient term is what the same rows of the whole leave to it."""
    problem = replace(posed(room, LIGHTS), ambient=room.material.albedo)
    some = np.array([3, 200, 17, 90, 91, 5])
    part = problem.rows_of(some)
    np.testing.assert_array_equal(part.ambient, room.material.albedo[some])
    alone = (problem.ambient / problem.sigma)[some]
    np.testing.assert_allclose(part.without_ambient(0.3 * alone), 0, atol=1e-12 * alone.max())


def test_two_lights_are_joined_where_they_balance(room):
    """Of a bright and a faint light 0.5 m apart, a hypothesis has the sum where they balance."""
    p, I = np.array([[0.4, -0.3, 0.9], [0.9, -0.3, 0.9], [-1.0, 0.9, 0.2]]), [[3.0], [1.0], [2.0]]
    fewer = without_one(posed(room, LIGHTS), Descents.at(PointLights(p, I)), SCALE)
    assert fewer.positions.shape[1] == 2
    sums = fewer.intensities[:, :, 0].sum(axis=1)
    (joined,) = np.flatnonzero(np.isclose(sums, 6.0))
    bright = np.argmax(fewer.intensities[joined, :, 0])
    assert fewer.intensities[joined, bright, 0] == pytest.approx(4.0)
    np.testing.assert_allclose(fewer.positions[joined, bright], [0.525, -0.3, 0.9])
    assert (sums < 6.0).any()  # others have one dropped
