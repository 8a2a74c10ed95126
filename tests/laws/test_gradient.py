"""dS/dp of `shading_gradient` is the derivative of S, for our BRDFs and for Mitsuba's."""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
import pytest

import lightloc
import render
from lightloc import Conductor, check_gradient, shading, shading_gradient

LIGHT = np.array([0.25, -0.5, 1.25])  # a float32 value, as is STEP: p itself is not rounded
STEP = 2.0**-10  # metres
ROUNDINGS = 4  # sqrt of the 16 float32 operations from p to S, which err at random


def tolerance(q: lightloc.Observations, alpha: float, eps: float) -> float:
    """Worst error of central differences of float32 values, relative to the steepest slope.

    Noise: each S is off by ROUNDINGS eps / 2, hence the difference by that over the step; the
    steepest slope is at least 2 S / d (the inverse square alone). Truncation: with
    s = (2 + 1 / alpha + 1 / cos_l + 1 / cos_w) / d the logarithmic slope of S at the steepest,
    step^2 s^2 / 2.
    """
    to_light = LIGHT - q.positions
    d = np.linalg.norm(to_light, axis=1)
    cos_l = (q.normals * to_light).sum(axis=1) / d
    cos_w = (q.normals * q.directions).sum(axis=1)
    near = (cos_l > 0) & (cos_w > 0)
    steepness = ((2 + 1 / alpha + 1 / cos_l + 1 / cos_w) / d)[near].max()
    noise = ROUNDINGS * eps / 2 / STEP * d[near].max()
    return float(noise + (STEP * steepness) ** 2 / 2)


def away(q: lightloc.Observations) -> lightloc.Observations:
    """Only the observations at least 0.5 m from the light: a lobe must be wide against STEP."""
    return q.at(np.linalg.norm(q.positions - LIGHT, axis=1) > 0.5)


def test_gradient(sample, facing, eps):
    """Automatic differentiation agrees with central differences for each of our BRDFs."""
    q = away(facing(sample.brdf, LIGHT))
    assert len(q) > 80
    allowed = tolerance(q, sample.alpha, eps)
    assert allowed < 0.01
    assert check_gradient(q, LIGHT, step=STEP) < allowed


def test_gradient_comes_with_the_value(sample, facing):
    """`shading_gradient` returns the S of `shading`, and a gradient for every channel."""
    q = facing(sample.brdf, LIGHT)
    S, gradient = shading_gradient(q, [LIGHT, -LIGHT])
    np.testing.assert_allclose(S, shading(q, [LIGHT, -LIGHT]), rtol=1e-6)
    assert gradient.shape == (*S.shape, 3)


def test_euler_homogeneity(sample, facing, rounding):
    """Along l only the inverse square acts: (p - x) . dS/dp = -2 S (Euler, degree -2)."""
    q = facing(sample.brdf, LIGHT)
    S, gradient = shading_gradient(q, [LIGHT])
    along = np.einsum("nca,na->nc", gradient[:, 0], LIGHT - q.positions)
    d = np.linalg.norm(LIGHT - q.positions, axis=1, keepdims=True)
    size = np.linalg.norm(gradient[:, 0], axis=2) * d  # what cancels in the scalar product
    allowed = rounding(q, LIGHT, sample.alpha) * np.maximum(size, S[:, 0])
    assert (np.abs(along + 2 * S[:, 0]) <= allowed).all()


BSDFS: dict[str, dict[str, Any]] = {
    "principled": {"type": "principled", "roughness": 0.5, "metallic": 0.3, "clearcoat": 0.5},
    "beckmann": {"type": "roughconductor", "distribution": "beckmann", "alpha": 0.3},
    "anisotropic": {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha_u": 0.3,
        "alpha_v": 0.6,
    },
}


@pytest.mark.parametrize("name", BSDFS)
def test_gradient_through_mitsuba(name, workshop, eps):
    """The same derivative flows through a BSDF of Mitsuba's, shadows included.

    Tolerance as above, with twice the roundings: directions go through a local frame as well.
    Points within 11 degrees of their horizon are left to their own: only the steepest slopes
    count in the quotient.
    """
    room = workshop(BSDFS[name])
    q = render.observe(room, points=256, seed=1, transport="direct", shapes=["floor"])
    assert type(q.material).__name__ == "SceneBSDF"
    assert check_gradient(q, LIGHT, room.geometry, step=STEP) < 0.01


@dataclass(frozen=True)
class Skewed:
    """A BRDF whose value is right and whose derivative is 1 % too large."""

    brdf: Any
    channels: int = 1

    def bind(self, n: int) -> lightloc.brdf.Scatter:
        right = self.brdf.bind(n)

        def scatter(i, normal, l, w):
            value = right(i, normal, l, w)
            return value + 0.01 * (value - dr.detach(value))

        return scatter


def test_a_gradient_one_percent_off_is_seen(facing, eps):
    """Negative control: the check fails for a derivative that is wrong by 1 %."""
    brdf = Conductor(alpha=0.4, eta=1.2, k=7.0)
    q = away(facing(Skewed(brdf), LIGHT))
    assert check_gradient(q, LIGHT, step=STEP) > tolerance(q, 0.4, eps)


@dataclass(frozen=True)
class Edge:
    """A BRDF whose derivative is none along an edge: the root of how far n . l is above 0.6."""

    channels: int = 1

    def bind(self, n: int) -> Any:
        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            cosine = dr.dot(normal, l)
            return cosine * (1 + dr.sqrt(dr.maximum(cosine - 0.6, 0)))

        return scatter


def test_where_a_brdf_has_no_derivative_the_gradient_is_finite():
    """On the edge and below it, where automatic differentiation finds 0 times infinity."""
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    q = lightloc.Observations(
        positions=x, normals=up, directions=up, radiance=np.zeros(3), material=Edge()
    )
    S, gradient = shading_gradient(q, [[0.0, 0.0, 1.0]])
    assert (S > 0).all() and np.isfinite(gradient).all()
    assert gradient[0].any()  # above the edge it is what it is
