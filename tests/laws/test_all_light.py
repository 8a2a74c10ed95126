"""All light together: a noisy rendering of its indirect part does not pull the answer astray."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Lambert, Observations, PointLights, shading
from lightloc.fit.problem import Problem
from lightloc.interreflection.all_light import Split, taken, together

N, TRIALS = 1500, 60
LIGHTS = PointLights([[0.4, -0.3, 0.9], [-1.0, 0.9, 0.2]], [5.0, 3.0])
BOUNDS = np.array([[-1.9, -1.9, -1.9], [1.9, 1.9, 1.9]])
NOISE = 0.02  # of the mean radiance
RENDERED = 0.4  # standard error of the rendering, of the indirect light's mean


@pytest.fixture
def cube(rng) -> Observations:
    """An empty diffuse cube, 4 m wide, still dark."""
    x, axis = rng.uniform(-2, 2, (N, 3)), rng.integers(0, 3, N)
    sign, normals = rng.choice([-1.0, 1.0], N), np.zeros((N, 3))
    x[np.arange(N), axis], normals[np.arange(N), axis] = 2 * sign, -sign
    return Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros(N),
        material=Lambert(albedo=0.5),
    )


@pytest.fixture
def seen(cube, rng):
    """B with indirect light, and a split of it rendered anew in each trial."""
    S = shading(cube, LIGHTS.positions)
    x = cube.positions[:, None, :]
    H = S.mean() * (1.0 + 0.3 * np.sin(x.sum(axis=2, keepdims=True) + LIGHTS.positions[:, :1]))
    clean = ((S + H) * LIGHTS.intensities).sum(axis=1)
    sigma = np.full(clean.shape, NOISE * clean.mean())
    error = np.full(H.shape, RENDERED * H.mean())

    def draw() -> Split:
        q = cube.with_radiance(clean + sigma * rng.normal(size=clean.shape), sigma)
        return Split(q, S, H + error * rng.normal(size=H.shape), error, 5.0)

    return draw


def off(splits: list[Split], believed: float) -> np.ndarray:
    """Mean errors of the intensities over their standard errors."""
    said = [replace(split, error=believed * split.error) for split in splits]
    errors = np.array([split.intensities()[:, 0] for split in said]) - LIGHTS.intensities[:, 0]
    return errors.mean(axis=0) / (errors.std(axis=0) / np.sqrt(len(errors)))


def test_noise_in_the_rendering_does_not_bias(seen):
    """Mean errors of the intensities over 60 renderings are 0 to within chance."""
    splits = [seen() for _ in range(TRIALS)]
    assert np.abs(off(splits, 1.0)).max() < 3.3


def test_power_of_that(seen):
    """Negative control: noise that is taken for signal pulls the intensities astray."""
    assert np.abs(off([seen() for _ in range(TRIALS)], 1e-3)).min() > 10


def test_errors_stated_are_real(cube, seen):
    """Positions and intensities refined together: errors over stated errors have spread 1.

    Over 60 trials of 8 parameters, the spread is known to 0.032 if they were independent, and
    twice that is allowed for their being related.
    """
    problem = Problem.of(cube, np.ones((N, 1)), None, BOUNDS)
    rng, z = np.random.default_rng(3), []
    for _ in range(TRIALS):
        near = PointLights(
            LIGHTS.positions + 0.02 * rng.normal(size=(2, 3)), LIGHTS.intensities * [[1.1], [0.9]]
        )
        lights, _, bound = together(seen(), near, problem)
        z.append(((lights.positions - LIGHTS.positions) / bound.position).ravel())
        z.append(((lights.intensities - LIGHTS.intensities) / bound.intensity).ravel())
    flat = np.concatenate(z)
    assert 0.87 < flat.std() < 1.13
    assert abs(flat.mean()) < 0.2


def test_at_the_truth_nothing_moves(cube, seen):
    """Without any noise the truth stays where it is."""
    split = seen()
    clean = (split.straight * LIGHTS.intensities).sum(axis=1)
    zero = np.zeros_like(split.around)
    still = Split(cube.with_radiance(clean, split.q.sigma), split.straight, zero, zero, 5.0)
    lights, _, bound = together(still, LIGHTS, Problem.of(cube, np.ones((N, 1)), None, BOUNDS))
    assert np.abs((lights.positions - LIGHTS.positions) / bound.position).max() < 1e-3
    assert np.abs((lights.intensities - LIGHTS.intensities) / bound.intensity).max() < 1e-3


def test_what_is_left_of_the_normal_equations_can_be_solved(rng):
    """However much noise there is, the equations stay positive definite."""
    A = rng.normal(size=(40, 5))
    for noise in (0.0, 1.0, 1e3, 1e9):
        left = A.T @ A - np.diag(taken(A.T @ A, noise * rng.uniform(size=5)))
        assert np.linalg.eigvalsh(left)[0] > 0.1 * np.linalg.eigvalsh(A.T @ A)[0]
