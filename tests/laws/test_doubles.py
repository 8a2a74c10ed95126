"""Kernels in 64 bits: the same numbers as in 32, to 32 bits; the closed form's, to 64."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Conductor, Lambert, Mixed, Observations, Plastic, shading, shading_gradient
from lightloc.optics.kernel import surfels

MATERIALS = {
    "diffuse": Lambert(albedo=[0.6, 0.4, 0.2]),
    "metal": Conductor(alpha=0.2, eta=0.2, k=3.9),
    "plastic": Plastic(alpha=0.3, diffuse=0.4),
    "mixed": Mixed((Lambert(albedo=0.3), Conductor(alpha=0.3)), np.arange(64) % 2),
}


def seen(material, rng) -> Observations:
    x = rng.uniform(-1, 1, (64, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (64, 1))
    w = up + rng.uniform(-0.5, 0.5, (64, 3))
    c = material.channels
    return Observations(
        positions=x, normals=up, directions=w, radiance=np.zeros((64, c)), material=material
    )


@pytest.mark.parametrize("name", MATERIALS)
def test_both_agree(name, rng):
    """S and its gradient, relative to their largest: 1e-5, a hundred roundings of float32."""
    q = seen(MATERIALS[name], rng)
    p = rng.uniform([-1, -1, 1], [1, 1, 3], (5, 3))
    for single, double in zip(
        shading_gradient(surfels(q), p), shading_gradient(surfels(q, double=True), p), strict=True
    ):
        assert np.abs(single - double).max() < 1e-5 * np.abs(double).max()
        assert np.abs(single - double).max() > 0  # negative control: they are not the same kernel


def test_closed_form(rng):
    """Lambert's S = albedo / pi cos / d^2 to a few roundings of float64."""
    q = seen(Lambert(albedo=0.5), rng)
    p = rng.uniform([-1, -1, 1], [1, 1, 3], (5, 3))
    to = p - q.positions[:, None]
    d2 = np.square(to).sum(axis=2)
    expected = 0.5 / np.pi * (to * q.normals[:, None]).sum(axis=2) / d2**1.5
    S = shading(surfels(q, double=True), p)[:, :, 0]
    np.testing.assert_allclose(S, expected, rtol=1e-13)


def test_what_follows_has_32_bits_again(rng):
    """The precision is that of the surfels, not of whoever was asked last."""
    q = seen(Lambert(albedo=0.5), rng)
    p = rng.uniform([-1, -1, 1], [1, 1, 3], (5, 3))
    before = shading(q, p)
    shading(surfels(q, double=True), p)
    np.testing.assert_array_equal(shading(q, p), before)


def test_some_of_them_keep_their_precision(rng):
    """Rows taken out of double surfels compute as those did."""
    q = seen(Lambert(albedo=0.5), rng)
    p = rng.uniform([-1, -1, 1], [1, 1, 3], (5, 3))
    s, some = surfels(q, double=True), np.array([3, 60, 3])
    np.testing.assert_array_equal(shading(s.take(some), p), shading(s, p)[some])
