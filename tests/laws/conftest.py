"""The BRDFs that each law is tried on, points that have them, and the float32 error of S."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import BRDF, Conductor, Lambert, Mixed, Observations, Plastic, Sum

POINTS = 96
LEAST_COSINE = 0.2  # lights and viewers stand at least this high above each surface
ROUNDINGS = 4  # p, x, n and w are rounded to float32, each by half an eps


@dataclass(frozen=True)
class Sample:
    """A BRDF, and the smallest GGX roughness in it (1 where it has no lobe)."""

    brdf: BRDF
    alpha: float = 1.0


GOLD = {"eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.1]}
PARTS = {
    "lambert": Sample(Lambert(albedo=0.6)),
    "lambert_rgb": Sample(Lambert(albedo=[0.6, 0.4, 0.1])),
    "mirror": Sample(Conductor(alpha=0.2), 0.2),
    "metal": Sample(Conductor(alpha=0.4, eta=1.2, k=7.0), 0.4),
    "gold": Sample(Conductor(alpha=0.1, specular=[0.9, 0.8, 0.7], **GOLD), 0.1),
    "plastic": Sample(Plastic(alpha=0.3, diffuse=0.5, ior=1.5), 0.3),
    "plastic_rgb": Sample(
        Plastic(alpha=0.3, diffuse=[0.8, 0.5, 0.1], ior=1.5, nonlinear=True), 0.3
    ),
    "sum": Sample(Sum([Lambert(albedo=[0.3, 0.2, 0.1]), Conductor(alpha=0.4)]), 0.4),
}
MIXTURE = Mixed(tuple(s.brdf for s in PARTS.values()), np.arange(POINTS) % len(PARTS))
SAMPLES = {
    **PARTS,
    "mixed": Sample(MIXTURE, 0.1),
    "sum_with_mixed": Sample(Sum([Lambert(albedo=0.2), MIXTURE]), 0.1),
    "sloped_sum": Sample(Sum([Lambert(albedo=0.2), Lambert(albedo=[0.3, 0.4, 0.1])])),
}


@pytest.fixture(params=SAMPLES.values(), ids=SAMPLES.keys())
def sample(request: pytest.FixtureRequest) -> Sample:
    """Each BRDF in turn, a mixture of them all included."""
    return request.param


@pytest.fixture(params=PARTS.values(), ids=PARTS.keys())
def part(request: pytest.FixtureRequest) -> Sample:
    """Each BRDF in turn that does not depend on the point."""
    return request.param


@pytest.fixture
def above(rng: np.random.Generator) -> Callable[[NDArray, float], NDArray]:
    """Draw unit vectors at least ``least`` (a cosine) above each of (n, 3) normals."""

    def draw(normals: NDArray, least: float = LEAST_COSINE) -> NDArray:
        side = np.cross(normals, rng.normal(size=normals.shape))
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        cosine = rng.uniform(least, 1, (len(normals), 1))
        return cosine * normals + np.sqrt(1 - cosine**2) * side

    return draw


@pytest.fixture
def facing(rng: np.random.Generator, above) -> Callable[[BRDF, NDArray], Observations]:
    """Observe ``POINTS`` random surfels in a 4 m cube, each well above whose horizon p stands."""

    def observe(brdf: BRDF, p: NDArray) -> Observations:
        x = rng.uniform(-2, 2, (POINTS, 3))
        to_light = p - x
        normals = above(to_light / np.linalg.norm(to_light, axis=1, keepdims=True))
        return Observations(
            positions=x,
            normals=normals,
            directions=above(normals),
            radiance=np.zeros((POINTS, brdf.channels)),
            material=brdf,
        )

    return observe


@pytest.fixture(scope="session")
def rounding(eps: float) -> Callable[[Observations, NDArray, float], NDArray]:
    """The relative error of S(q, p) in float32, (n, 1).

    p and x are rounded by eps max(|p|, |x|), which turns l by that over d and changes d^-2 by
    twice that over d; a turn by t changes ln (n.l) by t / (n.l), ln G1 by at most as much, and
    ln D by at most t / alpha: |d ln D / d theta_h| <= 2 / alpha at tan(theta_h) = alpha, and h
    turns half as far as l. The rounding of w and n turns by eps alone (the 1 in 1 + reach).
    """

    def bound(q: Observations, p: NDArray, alpha: float) -> NDArray:
        to_light = p - q.positions
        d = np.linalg.norm(to_light, axis=1, keepdims=True)
        cos_l = (q.normals * to_light).sum(axis=1, keepdims=True) / d
        cos_w = (q.normals * q.directions).sum(axis=1, keepdims=True)
        reach = np.maximum(np.abs(q.positions).max(axis=1, keepdims=True), np.abs(p).max()) / d
        steepness = 2 + 1 / alpha + 1 / cos_l + 1 / cos_w
        return ROUNDINGS / 2 * eps * (1 + reach) * steepness

    return bound
