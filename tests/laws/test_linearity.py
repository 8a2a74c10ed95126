"""Radiance is linear in the lights' intensities."""

import numpy as np
import pytest

import render
from lightloc import PointLights, radiance, shading

PLACES = np.array([[0.4, -0.3, 1.1], [-1.2, 0.8, 0.4], [1.6, 1.5, -0.7]])
FLOAT64 = 1e-13  # sums of three float64 products


def test_superposition(sample, facing, rng):
    """B(a I + b J) = a B(I) + b B(J) within float64 rounding, for every BRDF."""
    q = facing(sample.brdf, PLACES[0])
    I, J = rng.uniform(0, 9, (2, 3, 3))
    together = radiance(q, PointLights(PLACES, 2.5 * I + 0.7 * J))
    apart = 2.5 * radiance(q, PointLights(PLACES, I)) + 0.7 * radiance(q, PointLights(PLACES, J))
    np.testing.assert_allclose(together, apart, rtol=FLOAT64)


def test_lights_add_up(sample, facing, rng):
    """The light of three lamps is the sum of each one's alone."""
    q = facing(sample.brdf, PLACES[0])
    I = rng.uniform(1, 9, (3, 1))
    alone = [radiance(q, PointLights(PLACES[i : i + 1], I[i : i + 1])) for i in range(3)]
    np.testing.assert_allclose(radiance(q, PointLights(PLACES, I)), sum(alone), rtol=FLOAT64)


def test_shading_times_intensity_is_radiance(sample, facing, rng):
    """B = S I (Eq. 4), channel by channel, whether lights are grey or coloured."""
    q = facing(sample.brdf, PLACES[0])
    S = shading(q, PLACES)
    for I in (rng.uniform(1, 9, (3, 1)), rng.uniform(1, 9, (3, 3))):
        expected = (S * I).sum(axis=1)
        np.testing.assert_allclose(radiance(q, PointLights(PLACES, I)), expected, rtol=FLOAT64)


def test_no_light_is_black(sample, facing):
    """Without lights, and with lights of intensity zero, B = 0."""
    q = facing(sample.brdf, PLACES[0])
    assert not radiance(q, PointLights([], [])).any()
    assert not radiance(q, PointLights(PLACES, [0.0, 0.0, 0.0])).any()


@pytest.mark.parametrize("transport", ["direct", "full"])
def test_rendered_light_doubles(load, transport):
    """Mitsuba's B and its standard error double to the bit when every light does.

    Doubling is exact in float32, and the same seed takes the same paths.
    """
    room = load("box_mixed")
    brighter = render.relight(room, PointLights(room.lights.positions, 2 * room.lights.intensities))
    assert len(brighter.lights) == len(room.lights)
    once, twice = (
        render.observe(r, points=128, spp=16, seed=3, transport=transport)
        for r in (render.relight(room, room.lights), brighter)
    )
    np.testing.assert_array_equal(twice.radiance, 2 * once.radiance)
    np.testing.assert_array_equal(twice.sigma, 2 * once.sigma)
