"""The certificate: what one more light would explain, and the ambient term beside the lights."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Conductor, Lambert, Observations, Options, PointLights, localize, radiance
from lightloc.fields.grid import Grid
from lightloc.fit.criterion import Criterion, Likelihood
from lightloc.fit.problem import Problem
from lightloc.optics.ambient import reflected_ambient
from lightloc.optics.kernel import surfels
from lightloc.search.certificate import certificate
from lightloc.search.dictionary import Dictionary
from lightloc.search.ground import Ground
from lightloc.search.ladder import Ladder
from validation.rooms.plane import rooms


@pytest.fixture
def room():
    return rooms(3, count=1)[0]


def certified(problem: Problem, lights: PointLights) -> float:
    dictionary = Dictionary.over(problem, Grid.over(problem.bounds, 2304))
    return certificate(problem, problem, dictionary, lights, Likelihood())[0]


def posed(q: Observations, B: np.ndarray, sigma: np.ndarray) -> Problem:
    return Problem.of(q.with_radiance(B, sigma), sigma, None, q.bounds)


def test_a_missing_light_is_seen_at_its_strength(room):
    """With all but one light, the certificate is about |S I / sigma| beside the others' tangent.

    It can be no more than the whole of the light's part, and no less than a quarter of it: what the
    other lights' derivatives take up leaves 0.38 in this room.
    """
    q = room.observe(400)
    sigma = 0.05 * np.sqrt(q.radiance)
    faint = PointLights(room.lights.positions, [3.0, 3.0, 0.05])
    problem = posed(q, radiance(q, faint), sigma)
    part = radiance(q, PointLights(faint.positions[2:], faint.intensities[2:])) / sigma
    rest = PointLights(faint.positions[:2], faint.intensities[:2])
    value = certified(problem, rest)
    assert 0.25 * np.linalg.norm(part) < value < 1.02 * np.linalg.norm(part)


def test_at_the_truth_nothing_is_left(room):
    """Without noise it is 0 but for rounding: 1e-7 of B, over sigma, over 400 observations."""
    q = room.observe(400)
    sigma = 0.05 * np.sqrt(q.radiance)
    assert certified(posed(q, q.radiance, sigma), room.lights) < 1e-2


def test_chance_level(room):
    """Under noise alone it is a maximum of Gaussians: between 2 and 5 in each of 20 trials."""
    q = room.observe(400)
    sigma, rng = 0.05 * np.sqrt(q.radiance), np.random.default_rng(0)
    values = [
        certified(posed(q, q.radiance + sigma * rng.normal(size=(400, 1)), sigma), room.lights)
        for _ in range(20)
    ]
    assert min(values) > 2
    assert max(values) < 5


def test_one_light_too_few_is_seen_by_the_answer(room):
    """Negative control: stopped early, the answer carries a certificate that says so."""
    q = room.observe(400, noise=0.02)
    assert localize(q).certificate < 5
    assert localize(q, options=Options(most_lights=2)).certificate > 30


@pytest.mark.parametrize("count", [0, 1])
def test_darkness_is_enough_unless_a_light_would_gain(room, count):
    """A light that chi-square does not show (40 of 400, two deviations being 57) is looked for."""
    q = room.observe(400)
    one = PointLights(room.lights.positions[:1], room.lights.intensities[:1])
    sigma = np.full_like(q.radiance, float(np.linalg.norm(radiance(q, one)) / np.sqrt(40)))
    noise = sigma * np.random.default_rng(2).normal(size=sigma.shape)
    dim = q.with_radiance(count * radiance(q, one) + noise, sigma)
    ground = Ground.of(dim, None, dim.bounds, Options(), 0)
    view = ground.view(ground.whole, Options(), Criterion.of(Options()))
    assert view.criterion.is_likely(view.tight, view.darkness)
    assert Ladder.on(view).enough is (count == 0)


def test_ambient_reflection(rng):
    """A diffuse surface reflects its albedo; a metal with F = 1 no more than it gets."""
    n = 6
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    w = up + rng.uniform(-0.3, 0.3, (n, 3))
    common = dict(positions=np.zeros((n, 3)), normals=up, directions=w, radiance=np.zeros(n))
    albedo = rng.uniform(0.1, 0.9, n)
    q = Observations(material=Lambert(albedo=albedo), **common)
    np.testing.assert_allclose(reflected_ambient(surfels(q), 1)[:, 0], albedo, rtol=1e-4)
    metal = Observations(material=Conductor(alpha=0.4), **common)
    share = reflected_ambient(surfels(metal), 1)
    assert (share > 0.7).all()  # masking loses a fifth at alpha 0.4
    assert (share < 1.0).all()


def test_ambient_light_is_found_beside_the_lights(room):
    """A constant ambient term comes back with the lights; without the option it does not fit."""
    q = room.observe(400)
    grey = q.with_radiance(q.radiance + np.pi * 0.2, 0.0)  # f = 1: the albedo is pi
    found = localize(grey, options=Options(ambient=True))
    assert found.ambient[0] == pytest.approx(0.2, rel=1e-3)
    assert len(found.lights) == 3
    order = np.argsort(-room.lights.intensities[:, 0])
    np.testing.assert_allclose(found.lights.positions, room.lights.positions[order], atol=1e-4)
    plain = localize(q, options=Options(ambient=True))
    assert plain.ambient[0] == pytest.approx(0.0, abs=1e-4)


def test_ambient_light_costs_certainty(room):
    """What is not known beforehand must be paid for: no standard error shrinks."""
    q = room.observe(400, noise=0.02)
    known, unknown = localize(q), localize(q, options=Options(ambient=True))
    assert (unknown.intensity_error >= 0.999 * known.intensity_error).all()
    assert unknown.intensity_error.max() > 1.01 * known.intensity_error.max()
