"""The integrating sphere: direct and indirect light together against a closed form.

In a sphere of radius R and albedo rho every point of the wall sends the same light to every other,
so with lights I_i anywhere inside, at distances d_i and angles theta_i,

    B = rho / pi (sum I_i cos(theta_i) / d_i^2 + rho / (1 - rho) sum I_i / R^2).

Rationale: it checks the emitters' units, the cosine, the albedo, the path sampling and the standard
errors at once. Set-up: 2 048 points, 256 samples each. Expected: z-scores of mean 0 and standard
deviation 1 (measured: mean -0.04 to 0.04, deviation 0.98 to 1.02 over twelve seeds and light sets;
the standard error of a mean is 0.02).
"""

from __future__ import annotations

import numpy as np
import pytest

import render
from lightloc import Lambert, Observations, PointLights
from validation.judge.sphere import closed_form as judged_by

POINTS, SPP = 2048, 256
MEAN, LEAST, MOST = 0.1, 0.9, 1.1  # limits of the z-scores
ALBEDO = 0.6
# In radii; the first is the brightest and nearest the wall, so that the controls have a grip.
PLACES = np.array(
    [[0.45, -0.3, 0.35], [-0.3, 0.4, -0.2], [0.1, 0.5, 0.3], [-0.4, -0.3, 0.2], [0.2, 0.1, -0.5]]
)
INTENSITIES = np.array([20.0, 7.0, 5.0, 4.0, 3.0])


def direct_light(x: np.ndarray, lights: PointLights, radius: float) -> np.ndarray:
    """Irradiance of the lights at wall points x, W m^-2, (n,)."""
    to_light = lights.positions - x[:, None]
    d = np.linalg.norm(to_light, axis=2)
    cosine = np.einsum("nka,na->nk", to_light, -x / radius) / d
    return (lights.intensities[:, 0] * cosine / d**2).sum(axis=1)


def closed_form(x: np.ndarray, lights: PointLights, radius: float, albedo: float) -> np.ndarray:
    """B at wall points x, (n,)."""
    around = albedo / (1 - albedo) * lights.intensities.sum() / radius**2
    return albedo / np.pi * (direct_light(x, lights, radius) + around)


@pytest.fixture(scope="module")
def seen(load):
    """Observe the sphere of a radius with the first k lights, once each."""
    made = {}

    def observe(k: int, radius: float = 1.0):
        if (k, radius) not in made:
            lights = PointLights(radius * PLACES[:k], INTENSITIES[:k])
            room = render.relight(load("sphere", radius=radius, albedo=ALBEDO), lights)
            made[k, radius] = (
                lights,
                render.observe(room, points=POINTS, spp=SPP, seed=11, transport="full"),
            )
        return made[k, radius]

    return observe


def z_scores(q, lights: PointLights, radius: float = 1.0, albedo: float = ALBEDO) -> np.ndarray:
    return (q.radiance[:, 0] - closed_form(q.positions, lights, radius, albedo)) / q.sigma[:, 0]


def within(z: np.ndarray) -> bool:
    return bool(abs(z.mean()) < MEAN and LEAST < z.std() < MOST)


@pytest.mark.parametrize(("k", "radius"), [(1, 1.0), (2, 1.0), (5, 1.0), (2, 2.5)])
def test_z_scores(k, radius, seen):
    """Mitsuba's B agrees with the closed form within the standard errors that it carries."""
    lights, q = seen(k, radius)
    z = z_scores(q, lights, radius)
    assert abs(z.mean()) < MEAN
    assert LEAST < z.std() < MOST


@pytest.mark.parametrize("k", [1, 2, 5])
def test_direct_part_is_exact(k, seen, load):
    """Without interreflection B is rho / pi times the lights' irradiance, to rounding."""
    lights, _ = seen(k)
    room = render.relight(load("sphere", albedo=ALBEDO), lights)
    q = render.observe(room, points=POINTS, seed=3, transport="direct")
    expected = ALBEDO / np.pi * direct_light(q.positions, lights, 1.0)
    np.testing.assert_allclose(q.radiance[:, 0], expected, rtol=1e-5)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_wrong_lights_are_seen(k, seen):
    """Negative control: one light moved by 10 cm, or 10 % too bright, fails the test."""
    lights, q = seen(k)
    one = np.eye(k)[:, :1]
    inward = -PLACES[0] / np.linalg.norm(PLACES[0])
    moved = PointLights(lights.positions + 0.1 * one * inward, lights.intensities)
    brighter = PointLights(lights.positions, lights.intensities * (1 + 0.1 * one))
    assert not within(z_scores(q, moved))
    assert not within(z_scores(q, brighter))


def test_wrong_walls_are_seen(seen):
    """Negative control: an albedo off by 1 %, or interreflection left out, fails the test."""
    lights, q = seen(2)
    assert not within(z_scores(q, lights, albedo=1.01 * ALBEDO))
    bare = ALBEDO / np.pi * direct_light(q.positions, lights, 1.0)
    assert ((q.radiance[:, 0] - bare) / q.sigma[:, 0]).mean() > 10


def test_the_judges_closed_form_is_the_same(rng):
    """`validation` has the formula too, and the direct part of it, for lights of one channel."""
    x = rng.normal(size=(50, 3))
    x *= 2.5 / np.linalg.norm(x, axis=1, keepdims=True)
    q = Observations(
        positions=x,
        normals=-x,
        directions=-x,
        radiance=np.zeros(50),
        material=Lambert(albedo=ALBEDO),
    )
    lights = PointLights(2.5 * PLACES, INTENSITIES)
    B, direct = judged_by(q, lights)
    np.testing.assert_allclose(B[:, 0], closed_form(x, lights, 2.5, ALBEDO), rtol=1e-12)
    expected = ALBEDO / np.pi * direct_light(x, lights, 2.5)
    np.testing.assert_allclose(direct[:, 0], expected, rtol=1e-12)
