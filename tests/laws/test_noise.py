"""Standard errors for the search: floors, laws of sigma, and levels."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Options, PointLights, localize, radiance
from lightloc.fit.noise import is_exact, law_of, level_of, working_sigma
from validation.rooms.plane import rooms


@pytest.fixture
def q():
    return rooms(2, count=1)[0].observe(400)


def test_exact_observations_have_the_arithmetics_error(q):
    """Without sigma: one part in a million of B, and of its mean for the dark."""
    assert is_exact(q)
    o = Options()
    sigma = working_sigma(q, o)
    assert (sigma > 0).all()
    np.testing.assert_allclose(
        sigma, o.relative * q.radiance + o.absolute * q.radiance.mean(), rtol=0.5
    )


def test_no_sigma_is_far_below_the_others(q):
    """One observation that claims to be exact does not decide alone."""
    sigma = np.full((400, 1), 0.1)
    sigma[7] = 0.0
    assert working_sigma(q.with_radiance(q.radiance, sigma), Options())[7] == pytest.approx(0.01)


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0])
def test_laws(power, q):
    """Constant, shot and relative noise are functions of B, and are found as such."""
    law = law_of(q.radiance, 0.1 * q.radiance**power)
    assert law is not None
    B = np.linspace(q.radiance.min(), q.radiance.max(), 50)[:, None]
    np.testing.assert_allclose(law(B), 0.1 * B**power, rtol=1e-3)


def test_no_law(q, rng):
    """Negative control: errors that have nothing to do with B."""
    assert law_of(q.radiance, rng.uniform(0.1, 0.2, (400, 1))) is None


def test_level(rng):
    """The standard deviation of a Gaussian, whatever a tenth of outliers does."""
    z = 3 * rng.normal(size=4000)
    assert level_of(z) == pytest.approx(3, rel=3 * 1.17 / np.sqrt(4000))
    z[:400] = 1e6
    assert level_of(z) == pytest.approx(3, rel=0.2)


def test_weights_are_those_of_the_model():
    """With k = 0.2 weights from the noisy B would bias intensities by k^2 / B n / ... : none left.

    Over 40 trials of one light the mean error of I, in its standard errors, is 0 within 3 sigma.
    Weighted by the noisy B it would be off by k sum(S / B) / sqrt(sum(S^2 / B)), 1.6 errors here.
    """
    room = rooms(2, count=1)[0]
    exact = room.observe(400)
    one = PointLights([[0.45, 0.6, 0.0]], [3.0])
    B = radiance(exact, one)
    rng, errors = np.random.default_rng(2), []
    for _ in range(40):
        seen = np.maximum(B + 0.2 * np.sqrt(B) * rng.normal(size=B.shape), 1e-3)
        found = localize(exact.with_radiance(seen, 0.2 * np.sqrt(seen)))
        assert len(found.lights) == 1
        errors.append((found.lights.intensities[0, 0] - 3.0) / found.intensity_error[0, 0])
    assert abs(np.mean(errors)) < 3 / np.sqrt(40)
    assert np.std(errors) == pytest.approx(1, abs=3 / np.sqrt(80))


def test_sigma_is_estimated():
    """Told nothing of sigma, the search finds it to within its own error, and the lights."""
    room = rooms(3, count=3)[2]
    q = room.observe(400, noise=0.03)
    blind = q.with_radiance(q.radiance, 0.0)
    found = localize(blind, options=Options(noise="estimate"))
    assert len(found.lights) == 3
    ratio = np.median(found.sigma / q.sigma)
    assert ratio == pytest.approx(1, rel=5 / np.sqrt(2 * 400) + 0.1)  # the law of sigma is a guess
    ten = localize(q.with_radiance(q.radiance, 10 * q.sigma), options=Options(noise="scaled"))
    told = localize(q)
    np.testing.assert_allclose(ten.lights.positions, told.lights.positions, atol=0.01)
    np.testing.assert_allclose(np.median(ten.sigma / q.sigma), 1, rtol=0.2)


def test_level_counts_what_was_fitted(rng):
    """Of residuals that half as many parameters were fitted to, the level is still sigma's.

    The median of n residuals tells sigma to 1.17 / sqrt(n), three of which are allowed; without
    the degrees of freedom it would be off by a factor of sqrt(2).
    """
    n, fitted = 2000, 1000
    basis, _ = np.linalg.qr(rng.normal(size=(n, fitted)))
    z = 3 * rng.normal(size=n)
    left = z - basis @ (basis.T @ z)
    assert level_of(left, fitted) == pytest.approx(3, rel=3 * 1.17 / np.sqrt(n))
    assert level_of(left) < 0.8 * level_of(left, fitted)


def test_errors_of_the_model_add_up_in_squares(q):
    """The sensor's error and the arithmetic's are independent: 3 % and 4 % of B are 5 %."""
    B = q.radiance
    sigma = working_sigma(q.with_radiance(B, 0.03 * B), Options(relative=0.04, absolute=0.0))
    np.testing.assert_allclose(sigma, 0.05 * B, rtol=1e-12)
