"""A BRDF in plain NumPy is the one that a kernel computes: S, its slope, D and L, and searches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import (
    BRDF,
    Conductor,
    FromNumPy,
    Grid,
    Lambert,
    Mixed,
    Observations,
    PointLights,
    Sum,
    check_gradient,
    intensity_distance,
    localize,
    radiance,
    shading,
    shading_gradient,
)

ALPHA = 0.4
ALBEDO = np.linspace(0.2, 0.8, 96)
COLOUR = np.array([0.6, 0.4, 0.1])
LIGHTS = PointLights([[0.4, -0.3, 1.1], [-1.2, 0.8, 0.4]], [5.0, 2.0])


def diffuse(i: NDArray, normals: NDArray, l: NDArray, w: NDArray) -> NDArray:
    return np.full(len(i), 0.5 / np.pi)


def painted(i: NDArray, normals: NDArray, l: NDArray, w: NDArray) -> NDArray:
    return ALBEDO[i] / np.pi


def coloured(i: NDArray, normals: NDArray, l: NDArray, w: NDArray) -> NDArray:
    return np.tile(COLOUR / np.pi, (len(i), 1))


def lobe(i: NDArray, normals: NDArray, l: NDArray, w: NDArray) -> NDArray:
    """GGX with F = 1 (Walter et al. 2007, equations 20, 33 and 34)."""
    h = l + w
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    cos_h, cos_l, cos_w = ((normals * v).sum(axis=1) for v in (h, l, w))
    tan2 = 1 / cos_h**2 - 1
    D = ALPHA**2 / (np.pi * cos_h**4 * (ALPHA**2 + tan2) ** 2)
    G = np.prod([2 / (1 + np.sqrt(1 + ALPHA**2 * (1 / c**2 - 1))) for c in (cos_l, cos_w)], axis=0)
    return D * G / (4 * cos_l * cos_w)


ALIKE: dict[str, tuple[BRDF, BRDF, float]] = {
    "lambert": (FromNumPy(diffuse), Lambert(albedo=0.5), 1.0),
    "by point": (FromNumPy(painted), Lambert(albedo=ALBEDO), 1.0),
    "coloured": (FromNumPy(coloured, channels=3), Lambert(albedo=COLOUR), 1.0),
    "lobe": (FromNumPy(lobe), Conductor(alpha=ALPHA), ALPHA),
    "sum": (
        Sum([FromNumPy(coloured, channels=3), FromNumPy(lobe)]),
        Sum([Lambert(albedo=COLOUR), Conductor(alpha=ALPHA)]),
        ALPHA,
    ),
    "mixed": (
        Mixed([FromNumPy(painted), FromNumPy(lobe)], np.arange(96) % 2),
        Mixed([Lambert(albedo=ALBEDO), Conductor(alpha=ALPHA)], np.arange(96) % 2),
        ALPHA,
    ),
}


@pytest.mark.parametrize("name", ALIKE)
def test_the_same_as_a_kernel(name, facing, rounding):
    """S is the kernel's, by rounding; so is its gradient, which is at most ``steepness`` S / d
    and off by as many roundings. D is the least B / S of all pairs, too, on a grid and off it."""
    slow, fast, alpha = ALIKE[name]
    q = facing(fast, LIGHTS.positions[0])
    own = replace(q, material=slow)
    S, slope = shading_gradient(own, LIGHTS.positions)
    expected, turn = shading_gradient(q, LIGHTS.positions)
    allowed = rounding(q, LIGHTS.positions[0], alpha)
    assert (np.abs(S - expected)[:, 0] <= allowed * expected[:, 0]).all()
    steepest = np.linalg.norm(turn[:, 0], axis=2, keepdims=True)
    assert (np.abs(slope - turn)[:, 0] <= 2 * allowed[:, :, None] / alpha * steepest).all()
    np.testing.assert_array_equal(shading(own, LIGHTS.positions), S)
    seen = q.with_radiance(radiance(q, LIGHTS), 0.0)
    for where in (LIGHTS.positions, Grid([-1, -1, 0], [1, 1, 1], (5, 4, 3))):
        D, L = intensity_distance(replace(seen, material=slow), where)
        right, _ = intensity_distance(seen, where)
        np.testing.assert_allclose(D, right, rtol=1e-4)
        S = shading(seen, where.points if isinstance(where, Grid) else where)
        with np.errstate(divide="ignore", invalid="ignore"):
            every = seen.radiance[:, None] / S
        limit = np.take_along_axis(every, L[None].astype(int), axis=0)[0]
        np.testing.assert_allclose(limit, right, rtol=1e-4)  # two may limit equally


def test_its_slope_is_its_own(facing):
    """The derivative agrees with central differences of S, also where some points are picked."""
    q = facing(ALIKE["mixed"][0], LIGHTS.positions[0])
    q = q.at(np.linalg.norm(q.positions - LIGHTS.positions[0], axis=1) > 0.5)
    assert check_gradient(q, LIGHTS.positions[0], step=2.0**-10) < 0.01


def floor(material: BRDF, n: int = 96) -> Observations:
    x = np.random.default_rng(1).uniform(-2, 2, (n, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    w = np.array([0.5, -0.5, 2.0]) - x
    black = np.zeros((n, material.channels))
    return Observations(positions=x, normals=up, directions=w, radiance=black, material=material)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lambert", "mixed"])
def test_a_search_finds_the_same(name, rng):
    """The same lights, to a hundredth of each one's error: the descents end where chi-square falls
    by a share of 1e-9 at most, and that share of 96 residuals is a thousandth of an error."""
    slow, fast, _ = ALIKE[name]
    q = floor(fast)
    B = radiance(q, LIGHTS)
    sigma = 0.01 * B.mean()
    q = q.with_radiance(B + sigma * rng.normal(size=B.shape), sigma)
    bounds = [[-2, -2, 0.05], [2, 2, 2]]
    one, other = (localize(replace(q, material=each), bounds=bounds) for each in (slow, fast))
    assert len(one.lights) == len(other.lights) == 2
    assert one.reason is other.reason
    off = np.abs(one.lights.positions - other.lights.positions)
    assert (off <= 0.01 * other.position_error).all()
    off = np.abs(one.lights.intensities - other.lights.intensities)
    assert (off <= 0.01 * other.intensity_error).all()


def test_what_a_function_gives_is_checked(facing, refuses):
    """A wrong shape, a negative value, NaN: one sentence each; as for what is no function."""
    q = facing(Lambert(albedo=0.5), LIGHTS.positions[0])
    for wrong in (lambda i, n, l, w: -1 + 0 * i, lambda i, n, l, w: n * np.nan, lambda *a: 0.5):
        with refuses("FromNumPy.function gave"):
            shading(replace(q, material=FromNumPy(wrong)), LIGHTS.positions)
    with refuses("FromNumPy.function is 0.5"):
        FromNumPy(0.5)
    with refuses("FromNumPy.channels is 2"):
        FromNumPy(diffuse, channels=2)
