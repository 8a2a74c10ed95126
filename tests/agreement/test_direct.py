"""Direct light, three ways: lightloc's Eq. 4, Mitsuba emitter by emitter, Mitsuba's integrator."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import render
from lightloc import Observations, PointLights, radiance, shading
from render.observe import add_noise
from render.transport import PROBE_SHARE

POINTS = 4096
ROUNDING = 1e-4  # of B: some twenty float32 roundings, each over a cosine of 0.01 at worst


def observe(room: render.Room, noise: float = 0.0) -> Observations:
    return render.observe(room, points=POINTS, seed=1, transport="direct", noise=noise)


def error(q, B) -> np.ndarray:
    """|B - q.radiance| of the worst channel, (n,)."""
    return np.abs(B - q.radiance).max(axis=1)


@pytest.mark.parametrize("name", render.standard_scenes())
def test_standard_scenes(name, load):
    """In every standard scene B(q) as observed is the radiance of its lights by Eq. 4.

    The two codes share nothing but the ray tracer and the scene: BRDFs, cosines, distances and
    textures are evaluated twice.
    """
    room = load(name)
    q = observe(room)
    assert not q.sigma.any()
    apart = error(q, radiance(q, room.lights, room.geometry))
    mean = q.radiance.mean()
    assert (apart <= ROUNDING * (q.radiance.max(axis=1) + 0.01 * mean)).all()


@pytest.mark.parametrize("name", ["box_occluder", "box_mixed"])
def test_wrong_rooms_are_seen(name, load):
    """Negative control: a light 1 cm off, 1 % too bright, or shadows left out all disagree."""
    room = load(name)
    q = observe(room)
    allowed = ROUNDING * (q.radiance.max(axis=1) + 0.01 * q.radiance.mean())
    p, I = room.lights.positions, room.lights.intensities
    first = np.eye(len(p))[:, :1]
    wrong = [
        (PointLights(p + 0.01 * first * [1, 0, 0], I), room.geometry),
        (PointLights(p, I * (1 + 0.01 * first)), room.geometry),
    ]
    if name == "box_occluder":
        wrong.append((room.lights, None))
    for lights, geometry in wrong:
        apart = error(q, radiance(q, lights, geometry))
        assert (apart > allowed).mean() > 0.1


def sampled(room, q, spp: int, seed: int) -> np.ndarray:
    """Mitsuba's own direct integrator along the probes' rays, mean of ``spp`` samples, (n, 3)."""
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})
    x = np.repeat(q.positions + PROBE_SHARE * room.diagonal * q.directions, spp, axis=0)
    w = np.repeat(-q.directions, spp, axis=0)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(x))
    rays = mi.RayDifferential3f(mi.Point3f(x.T), mi.Vector3f(w.T))
    L, _, _ = integrator.sample(room.scene, sampler, rays)
    return np.array(L, float).T.reshape(len(q), spp, 3).mean(axis=1)


@pytest.mark.parametrize("name", ["box_one"])
def test_integrator_with_one_light(name, load):
    """With one light Mitsuba's direct integrator has no noise, and gives B(q) to rounding."""
    room = load(name)
    q = observe(room)
    np.testing.assert_allclose(
        sampled(room, q, 1, 0), np.broadcast_to(q.radiance, (POINTS, 3)), rtol=ROUNDING
    )


@pytest.mark.parametrize("name", ["box_three", "box_plastic"])
def test_integrator_with_many_lights(name, load):
    """With k lights the integrator picks one of them at random: z-scores are standard normal.

    Its standard error is known exactly: each sample is k B_i with probability 1 / k. Limits: four
    standard errors of the mean of the z-scores, and of their standard deviation.
    """
    spp = 64
    room = load(name)
    q = observe(room)
    each = (shading(q, room.lights.positions, room.geometry) * room.lights.intensities)[..., 0]
    k = len(room.lights)
    sigma = np.sqrt((k * (each**2).sum(axis=1) - each.sum(axis=1) ** 2) / spp)
    some = sigma > 0.01 * q.radiance[:, 0]
    assert some.mean() > 0.9
    z = ((sampled(room, q, spp, 4)[:, 0] - q.radiance[:, 0]) / sigma)[some]
    assert abs(z.mean()) < 4 / np.sqrt(len(z))
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * len(z))
    dimmer = z - 0.1 * q.radiance[some, 0] / sigma[some]
    assert abs(dimmer.mean()) > 8 / np.sqrt(len(z))  # negative control: 10 % is seen


@pytest.mark.parametrize("k", [0.01, 0.05])
def test_noise_is_as_large_as_sigma_says(load, k):
    """Noise added on request is normal, with the standard error that the observations carry.

    sigma = k sqrt(B mean(B)), section 6.1; limits: four standard errors of mean and deviation.
    """
    room = load("box_two")
    clean, noisy = (observe(room, noise) for noise in (0.0, k))
    B = clean.radiance
    np.testing.assert_allclose(noisy.sigma, k * np.sqrt(B * B.mean()), rtol=1e-12)
    z = (noisy.radiance - B) / noisy.sigma
    assert abs(z.mean()) < 4 / np.sqrt(POINTS)
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * POINTS)


def test_noise_on_a_radiance_below_zero(load):
    """Where B is below zero already, there is no light whose noise could be added."""
    clean = observe(load("box_two"))
    below = clean.radiance < np.median(clean.radiance)
    q = clean.with_radiance(np.where(below, -clean.radiance, clean.radiance), clean.radiance.mean())
    noisy = add_noise(q, 0.05, seed=1)
    np.testing.assert_array_equal(noisy.radiance[below], q.radiance[below])
    np.testing.assert_array_equal(noisy.sigma[below], q.sigma[below])
    assert (noisy.radiance[~below] != q.radiance[~below]).all()


def test_noise_follows_its_seed(load):
    """The same seed adds the same noise, another seed another: they do not correlate."""
    q = observe(load("box_two"))
    one, again, other = (add_noise(q, 0.05, seed).radiance - q.radiance for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    z, w = (noise[:, 0] / np.sqrt(q.radiance[:, 0]) for noise in (one, other))
    assert abs(np.corrcoef(z, w)[0, 1]) < 4 / np.sqrt(POINTS)
