"""S(q, p) falls with the square of the distance along a ray from the surface."""

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Lambert, Observations, shading

LIGHT = np.array([0.3, 0.4, 1.5])
FARTHER = np.array([0.5, 1.7, 3.0, 10.0])


def test_inverse_square(sample, facing, rounding):
    """S(x + t l) t^2 is the same for every t, at every point and for every BRDF.

    Tolerance: the float32 error of both sides (the fixture ``rounding`` derives it).
    """
    q = facing(sample.brdf, LIGHT)
    near = shading(q, [LIGHT])[:, 0]
    assert (near > 0).all()
    for t in FARTHER:
        p = q.positions + t * (LIGHT - q.positions)
        far = shading(q, p)[np.arange(len(q)), np.arange(len(q))]
        error = np.abs(far * t**2 / near - 1)
        assert (error <= 2 * rounding(q, LIGHT, sample.alpha) * max(1, 1 / t)).all()


def test_powers_of_two_are_exact(sample, facing):
    """Seen from the origin, doubling the distance divides S by four to the last bit or two."""
    q = facing(sample.brdf, LIGHT)
    q = replace(q, positions=np.zeros_like(q.positions))
    near, far = shading(q, [LIGHT, 2 * LIGHT]).transpose(1, 0, 2)
    np.testing.assert_allclose(4 * far, near, rtol=2 * np.finfo(np.float32).eps)


def test_lambert_in_closed_form():
    """A light 2 m above a white Lambertian point gives S = 1 / (4 pi), within one rounding."""
    up = [[0.0, 0.0, 1.0]]
    q = Observations(
        positions=[[0, 0, 0]],
        normals=up,
        directions=up,
        radiance=[0.0],
        material=Lambert(albedo=1.0),
    )
    assert shading(q, [[0, 0, 2]])[0, 0, 0] == pytest.approx(1 / (4 * np.pi), rel=2.4e-7)


def test_a_different_law_would_be_seen(sample, facing, rounding):
    """Negative control: an exponent of 2.001 in place of 2 is outside the tolerance."""
    q = facing(sample.brdf, LIGHT)
    allowed = 2 * rounding(q, LIGHT, sample.alpha)
    assert (np.abs(10.0**0.001 - 1) > allowed).mean() > 0.9
