"""Eq. 2's clamp: a surface neither catches nor shows light from below its horizon."""

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Conductor, Lambert, Mixed, Observations, shading, shading_gradient
from lightloc.brdf.protocol import evaluate

LIGHT = np.array([0.4, -0.3, 1.1])


def test_light_below_the_horizon(sample, facing):
    """S and its gradient are 0 where the light stands behind the surface."""
    q = facing(sample.brdf, LIGHT)
    q = replace(q, normals=-q.normals, directions=-q.directions)
    S, gradient = shading_gradient(q, [LIGHT])
    assert not shading(q, [LIGHT]).any()
    assert not S.any()
    assert not gradient.any()


def test_viewer_below_the_horizon(sample, facing):
    """S is 0 where the surface is seen from behind."""
    q = facing(sample.brdf, LIGHT)
    assert not shading(replace(q, directions=-q.directions), [LIGHT]).any()


def test_a_flipped_normal_is_seen(sample, facing):
    """Negative control: with its right normal every one of these points is lit."""
    assert (shading(facing(sample.brdf, LIGHT), [LIGHT]) > 0).all()


DOWN, UP, SIDE = [[0.0, 0.0, -1.0]], [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]


@pytest.mark.parametrize(("l", "w"), [(DOWN, UP), (UP, DOWN), (SIDE, UP), (UP, SIDE), (DOWN, DOWN)])
def test_exactly_opposite_is_zero_and_not_nan(part, l, w):
    """Light straight behind the surface as the viewer sees it, or in its plane: f (n.l)_+ = 0.

    There l + w = 0 and the half vector has no direction, so a careless formula gives NaN.
    """
    np.testing.assert_array_equal(evaluate(part.brdf, UP, l, w), 0)


def test_gradient_straight_behind_is_zero(part):
    """The gradient of that 0 is 0 as well."""
    q = Observations(
        positions=[[0, 0, 0]],
        normals=UP,
        directions=UP,
        radiance=np.zeros((1, part.brdf.channels)),
        material=part.brdf,
    )
    S, gradient = shading_gradient(q, [[0, 0, -1.0]])
    np.testing.assert_array_equal(S, 0)
    np.testing.assert_array_equal(gradient, 0)


def test_another_points_parameters_do_no_harm():
    """In a mixture a BRDF is never felt at points of another, even where it has no value there.

    eta = k = 0 seen head-on makes Fresnel's quotient 0/0.
    """
    void = Conductor(alpha=0.3, eta=[1.2, 0.0], k=[7.0, 0.0])
    mixed = Mixed((void, Lambert(albedo=0.5)), [0, 1])
    up = UP * 2
    value = evaluate(mixed, up, up, up)
    assert value[1, 0] == pytest.approx(0.5 / np.pi, rel=1e-6)
    assert np.isfinite(value).all()
