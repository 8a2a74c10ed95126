"""Light that was subtracted leaves its noise: the law of what is left still holds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Lambert, Observations, PointLights, radiance
from lightloc.fit import Problem, Subtracted, fit_of

N = 3000
LIGHTS = PointLights([[0.5, -0.3, 0.4]], [1.0])
RELATIVE, RENDERED, AROUND = 0.05, 0.03, 0.2
Z99 = 3.3  # standard errors: one in a thousand lies beyond


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A floor under one light, with more light by way of surfaces, which was rendered."""
    rng = np.random.default_rng(0)
    floor = rng.uniform(-4, 4, (N, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0, 1], (N, 1))
    q = Observations(
        positions=floor,
        normals=up,
        directions=up,
        radiance=np.zeros(N),
        material=Lambert(albedo=0.5),
    )
    M = radiance(q, LIGHTS)
    around = np.full_like(M, AROUND * M.max())
    seen = (M + around) * (1 + RELATIVE * rng.normal(size=M.shape))
    error = RENDERED * around
    direct = seen - around - error * rng.normal(size=M.shape)
    before = q.with_radiance(seen, 0.1 * M.max())
    after = q.with_radiance(direct, np.hypot(before.sigma, error))
    box = np.array([[-4.0, -4, 0], [4, 4, 4]])
    posed = Problem.of(after, after.sigma, None, box)
    return replace(posed, subtracted=Subtracted.between(before, after))


def test_the_law_is_that_of_all_light(problem):
    """Noise that is a share of all of B is found to be that, and the rendering's is not in it."""
    law = fit_of(problem, LIGHTS, np.inf).law
    relative = np.sqrt(law.variance[0, 2])
    error = law.error[0, 2] / (2 * relative)
    assert abs(relative - RELATIVE) < Z99 * error
    assert law.variance[0, 0] < Z99 * law.error[0, 0]
    assert law.share[0] < 0.01


def test_without_it_the_law_is_another(problem):
    """Negative control: beside direct light alone, some noise is the same in the dark."""
    law = fit_of(replace(problem, subtracted=None), LIGHTS, np.inf).law
    assert law.variance[0, 0] > Z99 * law.error[0, 0]


def test_errors_hold_both(problem):
    """Standard errors are those of all light and of what was rendered."""
    fit = fit_of(problem, LIGHTS, np.inf)
    some = np.arange(10)
    own = problem.rows_of(some).errors_by(fit.law, fit.model[some])
    light = problem.subtracted.radiance[some] + fit.model[some]
    rendered = problem.subtracted.error[some]
    np.testing.assert_allclose(own, np.hypot(fit.law.sigma(light), rendered))


def test_what_is_left_is_noise_by_that_law(problem):
    fit = fit_of(replace(problem, sigma=fit_of(problem, LIGHTS, np.inf).sigma), LIGHTS, np.inf)
    assert abs(fit.residual.std() - 1) < Z99 / np.sqrt(2 * N)
