"""What an answer says of its lights follows from them: errors, bound, residual, outliers, order."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import (
    Localization,
    Observations,
    Options,
    PointLights,
    cramer_rao,
    intensity_distance,
    localize,
    radiance,
)
from lightloc.answer import MARGIN
from lightloc.interreflection.rendered import movement
from validation.rooms.plane import rooms

FAR = 30.0  # standard errors: an outlier


@pytest.fixture(scope="module")
def seen() -> Observations:
    """A square room with three lights, its noise, and an outlier on either side."""
    q = rooms(3, count=1)[0].observe(noise=0.02)
    B = q.radiance.copy()
    bright = np.argsort(B[:, 0])[-40:]  # dark ones could not be so much darker
    B[bright[0]] += FAR * q.sigma[bright[0]]
    B[bright[20]] -= FAR * q.sigma[bright[20]]
    return q.with_radiance(B, q.sigma)


@pytest.fixture(scope="module")
def found(seen) -> Localization:
    return localize(seen)


def test_residual_and_outliers(seen, found):
    """(B - model) / sigma; outliers are counted on both sides."""
    model = radiance(seen, found.lights)
    np.testing.assert_allclose(
        found.residual, (seen.radiance - model) / found.sigma, atol=1e-3, rtol=1e-3
    )
    assert found.residual.max() > Options().outlier
    assert found.residual.min() < -Options().outlier
    assert found.outliers == (np.abs(found.residual) > Options().outlier).sum() == 2


def test_errors_are_those_of_the_lights_in_their_order(seen, found):
    """Brightest first, each with its own Cramér-Rao bound and rows of the covariance."""
    assert (np.diff(found.lights.intensities[:, 0]) < 0).all()
    bound = cramer_rao(seen.with_radiance(seen.radiance, found.sigma), found.lights)
    np.testing.assert_allclose(found.position_error, bound.position, rtol=1e-3)
    np.testing.assert_allclose(found.intensity_error, bound.intensity, rtol=1e-3)
    np.testing.assert_allclose(
        np.sqrt(np.diag(found.covariance))[:6], bound.position[:, :2].ravel(), rtol=1e-3
    )
    assert len(set(found.intensity_error[:, 0].round(6))) == 3  # each has an error of its own


def test_the_bound_holds_under_noise():
    """D is taken of B and `MARGIN` standard errors, so that one light is not above its own bound.

    Without the margin it is: the least of 400 noisy quotients lies some errors below the rest, no
    more than the margin here.
    """
    room = rooms(2, count=1)[0]
    one = PointLights(room.lights.positions[:1], room.lights.intensities[:1])
    dark, rng = room.observe(), np.random.default_rng(4)
    sigma = 0.03 * radiance(dark, one)
    noise = sigma * rng.normal(size=sigma.shape).clip(0.1 - MARGIN, MARGIN)
    q = dark.with_radiance(radiance(dark, one) + noise, sigma)
    found = localize(q)
    plain, _ = intensity_distance(q, found.lights.positions)
    bound, _ = intensity_distance(q, found.lights.positions, margin=MARGIN)
    np.testing.assert_allclose(found.bound, bound, rtol=1e-6)
    assert len(found.lights) == 1
    assert plain[0, 0] < found.lights.intensities[0, 0] < found.bound[0, 0]


def test_one_light_that_moves_is_movement(found):
    """The light that has moved most counts, and the channel of it that has."""
    p, I = found.lights.positions.copy(), found.lights.intensities.copy()
    p[1] += 2 * found.position_error[1]
    assert movement(found, PointLights(p, I)) == pytest.approx(2)
    I[2] -= 5 * found.intensity_error[2]
    assert movement(found, PointLights(p, I)) == pytest.approx(5)
