"""Levenberg-Marquardt for many starts (section 5.2): laws, and agreement with scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from lightloc import Lambert, Observations, PointLights, radiance, shading_gradient
from lightloc.levenberg import descend
from lightloc.solve import Problem

BOUNDS = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])
LIGHTS = PointLights([[0.4, -0.2, 1.1], [-0.5, 0.3, 0.6]], [4.0, 2.0])


def seen(rng: np.random.Generator, channels: int = 1) -> Observations:
    """A floor and two walls, lit by LIGHTS."""
    x = rng.uniform(-1, 1, (300, 3))
    side = np.arange(300) % 3
    normals = np.eye(3)[side]
    x[np.arange(300), side] = -1.0
    dark = Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros((300, channels)),
        material=Lambert(albedo=0.5 if channels == 1 else [0.6, 0.4, 0.2]),
    )
    return dark.with_radiance(radiance(dark, LIGHTS), 0.0)


def problem(q: Observations, sigma: float = 1.0) -> Problem:
    return Problem.of(q, np.full_like(q.radiance, sigma), None, BOUNDS)


def starts(rng: np.random.Generator, m: int, c: int = 1) -> tuple[np.ndarray, np.ndarray]:
    p = LIGHTS.positions + rng.normal(0, 0.1, (m, 2, 3))
    return p, rng.uniform(1, 5, (m, 2, c))


@pytest.mark.parametrize("channels", [1, 3])
def test_near_the_truth_all_starts_come_back(rng, channels):
    """Without noise: to float32's accuracy of S, 1e-6, times the condition of the fit, 100."""
    q = seen(rng, channels)
    there = descend(problem(q), *starts(rng, 7, channels))
    for p, I in zip(there.positions, there.intensities, strict=True):
        np.testing.assert_allclose(p, LIGHTS.positions, atol=1e-4)
        np.testing.assert_allclose(I, np.broadcast_to(LIGHTS.intensities, I.shape), rtol=1e-4)
    assert not there.strayed.any()


def test_starts_do_not_see_each_other(rng):
    """A start ends where it ends alone: bit for bit but for the order of sums."""
    q = seen(rng)
    p, I = starts(rng, 4)
    together = descend(problem(q), p, I, steps=6)
    for i in range(4):
        alone = descend(problem(q), p[i : i + 1], I[i : i + 1], steps=6)
        np.testing.assert_allclose(alone.positions[0], together.positions[i], atol=1e-9)


def test_never_uphill(rng):
    """More steps never end higher, and chi-square is what the residuals say."""
    q = seen(rng)
    p, I = starts(rng, 5)
    p += rng.normal(0, 0.3, p.shape)
    before = np.full(5, np.inf)
    for steps in (0, 1, 2, 4, 8, 16):
        there = descend(problem(q), p, I, steps=steps)
        assert (there.chi2 <= before).all()
        before = there.chi2
    light = PointLights(there.positions[0], np.maximum(there.intensities[0], 0))
    if (there.intensities[0] >= 0).all():
        again = np.square(q.radiance - radiance(q, light)).sum()
        assert np.isclose(again, there.chi2[0], rtol=1e-4, atol=1e-9)


def test_sigma_is_a_unit(rng):
    """Errors s times as large: the same path, chi-square divided by s^2 (s a power of 2)."""
    q = seen(rng)
    p, I = starts(rng, 3)
    once, wide = (descend(problem(q, s), p, I, steps=3) for s in (1.0, 4.0))
    np.testing.assert_allclose(wide.positions, once.positions, rtol=1e-9)
    np.testing.assert_allclose(wide.chi2 * 16, once.chi2, rtol=1e-9)


def test_agrees_with_scipy(rng):
    """With noise the minimum is the one that scipy's Levenberg-Marquardt finds."""
    q = seen(rng)
    noisy = q.with_radiance(q.radiance + rng.normal(0, 0.01, q.radiance.shape), 0.01)
    p, I = starts(rng, 1)
    ours = descend(problem(noisy, 0.01), p, I)

    def split(x):
        return x[:6].reshape(2, 3), x[6:]

    def residual(x):
        S, _ = shading_gradient(noisy, split(x)[0])
        return ((S[:, :, 0] @ split(x)[1]) - noisy.radiance[:, 0]) / 0.01

    def jacobian(x):
        S, g = shading_gradient(noisy, split(x)[0])
        moved = g[:, :, 0] * split(x)[1][None, :, None]
        return np.concatenate([moved.reshape(300, 6), S[:, :, 0]], axis=1) / 0.01

    theirs = least_squares(residual, np.concatenate([p.ravel(), I.ravel()]), jacobian, method="lm")
    np.testing.assert_allclose(ours.chi2[0], 2 * theirs.cost, rtol=1e-6)
    np.testing.assert_allclose(ours.positions[0], split(theirs.x)[0], atol=1e-4)


def test_a_light_that_strays_is_stopped(rng):
    """Section 5.2's early end: only those that go too far, and at once."""
    q = seen(rng)
    p, I = starts(rng, 4)
    p[0] += 0.4
    near = descend(problem(q), p, I, stray=0.45)
    assert near.strayed[0]
    assert not near.strayed[1:].any()
    assert not descend(problem(q), p, I).strayed.any()


def test_nothing_to_see(rng):
    """A light that no observation sees, and one far outside: finite, and no worse than before."""
    q = seen(rng)
    p = np.array([[[-2.0, -2.0, -2.0], [0.4, -0.2, 1.1]], [[1e5, 1e5, 1e5], [0.0, 0.0, 0.5]]])
    there = descend(problem(q), p, np.ones((2, 2, 1)))
    assert np.isfinite(there.chi2).all()
    assert (there.chi2 <= descend(problem(q), p, np.ones((2, 2, 1)), steps=0).chi2).all()
