"""Mitsuba's derivatives of point lights against lightloc's, and Adam on top of them.

What Mitsuba does with a light's position is pinned here: if a later version gives more than this
one, the rival that is built on it must be looked at again.
"""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import render
import validation
from lightloc import PointLights, shading_gradient
from render.descent import Adam, Lamps, optimize
from render.transport import probe

POINTS = 512
AGREE = 1e-4  # of the sum of absolute terms: a few float32 roundings of each (measured: 2e-6)
LIMIT = 1.0  # percent of the diagonal: what counts as solved
FEW = Adam(starts=4, steps=300, points=POINTS)


def observe(room: render.Room, noise: float = 0.0, seed: int = 1):
    return render.observe(room, points=POINTS, seed=seed, transport="direct", noise=noise)


def test_the_radiance_of_the_lamps_is_what_is_observed(load):
    """Put where the room's lights are, the lamps give the B(q) that is observed there."""
    room = load("box_occluder")
    q, lamps = observe(room), Lamps.of(room, len(room.lights))
    lamps.put(*lit(room.lights))
    B = np.array(lamps.radiance(probe(lamps.room.scene, q.positions, q.directions)), float).T
    np.testing.assert_allclose(B[:, :1], q.radiance, rtol=AGREE, atol=AGREE * q.radiance.mean())


def lit(lights: PointLights) -> tuple[list, list]:
    """Lights as `Lamps.put` takes them."""
    intensities = np.broadcast_to(lights.intensities, (len(lights), 3))
    return (
        [mi.Point3f(p.tolist()) for p in lights.positions],
        [mi.Color3f(I.tolist()) for I in intensities],
    )


@pytest.mark.parametrize("name", ["box_occluder", "box_conductor", "box_plastic"])
def test_derivatives_are_lightlocs(name, load, rng):
    """d/dp of a random sum over B, by reverse mode through Mitsuba's emitter and BSDF, is that of
    `shading_gradient`, forward mode through lightloc's own BRDFs; occluders and gloss included.
    """
    room = load(name)
    q, weight = observe(room), rng.normal(size=POINTS)
    lamps = Lamps.of(room, 1)
    (p,), (I,) = lit(PointLights(room.lights.positions[:1], room.lights.intensities[:1]))
    dr.enable_grad(p)
    lamps.put([p], [I])
    si = probe(lamps.room.scene, q.positions, q.directions)
    dr.backward(dr.sum(lamps.radiance(si).x * mi.Float(weight.astype(np.float32))))
    _, gradient = shading_gradient(q, room.lights.positions[:1], room.geometry)
    terms = weight[:, None] * gradient[:, 0, 0] * room.lights.intensities[0, 0]
    off = np.abs(np.array(dr.grad(p), float).ravel() - terms.sum(axis=0))
    assert (off <= AGREE * np.abs(terms).sum(axis=0)).all()
    assert (np.abs(terms.sum(axis=0)) > AGREE * np.abs(terms).sum(axis=0)).any()  # not all zero


def by_integrator(room: render.Room, kind: str) -> np.ndarray:
    """d(mean of a small picture)/d(position of the first light), as an integrator gives it."""
    more = {} if kind.startswith("direct") else {"max_depth": 2}
    integrator = mi.load_dict({"type": kind, **more})
    lamps = Lamps.of(room, 1)
    (p,), (I,) = lit(PointLights(room.lights.positions[:1], room.lights.intensities[:1]))
    dr.enable_grad(p)
    lamps.put([p], [I])
    picture = mi.render(lamps.room.scene, lamps.parameters, integrator=integrator, spp=1, seed=0)
    dr.backward(dr.mean(picture.array))
    return np.array(dr.grad(p), float).ravel()


def test_what_mitsuba_says_of_a_position(load):
    """Flagged as non-differentiable; an optimizer built from the scene's parameters drops it."""
    parameters = mi.traverse(load("box_one").scene)
    key = "light_1.position"
    assert parameters.flags(key) & mi.ParamFlags.NonDifferentiable.value
    parameters.keep([key, "light_1.intensity.value"])
    assert list(mi.ad.Adam(lr=1.0, params=parameters).keys()) == ["light_1.intensity.value"]


def test_which_integrators_give_the_derivative(load):
    """`direct` and `path` give one and the same, the projective one zero, and `prb` refuses."""
    room = load("box_one")
    direct, path = (by_integrator(room, kind) for kind in ("direct", "path"))
    assert np.abs(direct).max() > 0
    # One light, one sample a pixel: both shade the same points up to where the sampler's numbers
    # place them in a pixel.
    np.testing.assert_allclose(path, direct, rtol=0.05, atol=0.05 * np.abs(direct).max())
    assert not by_integrator(room, "direct_projective").any()
    with pytest.raises(RuntimeError):
        by_integrator(room, "prb")


@pytest.mark.slow
def test_two_lights_are_found(load):
    """With noise, from a few starts, the count known: the best start ends at the lights."""
    room = load("box_two")
    there = optimize(room, observe(room, noise=0.01), 2, options=FEW)
    verdict = validation.compare(there.lights, room.lights, room.diagonal)
    assert verdict.worst_position_percent < LIMIT, verdict
    assert not verdict.missed, verdict
    best = np.argmin(there.losses)
    assert there.losses[best] < 2  # the noise's own is 1
    assert np.array_equal(there.positions[best], there.lights.positions)


@pytest.mark.slow
def test_a_light_too_few_leaves_a_residual(load):
    """Negative control: with one light for two, the loss stays far above the noise's 1."""
    room = load("box_two")
    q = observe(room, noise=0.01)
    assert optimize(room, q, 1, options=FEW).losses.min() > 10


def test_the_rooms_own_lights_are_not_looked_at(load):
    """The same data in a room that is lit otherwise: the same descent, bit for bit."""
    room = load("box_one")
    q, short = observe(room), replace(FEW, steps=20)
    other = render.relight(room, PointLights([[1.0, 1.0, 1.0], [2.0, 2.0, 1.0]], [1.0, 99.0]))
    first, second = (optimize(r, q, 2, options=short) for r in (room, other))
    assert np.array_equal(first.positions, second.positions)
    assert np.array_equal(first.losses, second.losses)


@pytest.mark.long
def test_colours(load):
    """Three channels: coloured lights are found with their colours."""
    room = load("box_colored")
    q = observe(room)
    there = optimize(room, q, len(room.lights), options=replace(FEW, starts=16))
    assert there.lights.channels == 3
    verdict = validation.compare(there.lights, room.lights, room.diagonal)
    assert not verdict.missed, verdict
    assert verdict.worst_position_percent < LIMIT, verdict


def test_refuses(load, refuses):
    room = load("box_one")
    q = observe(room)
    with refuses("optimize"):
        optimize(room, q, 0)
    with refuses("optimize"):
        optimize(room, q.with_radiance(q.radiance, 0.0, interreflected=True), 1)
