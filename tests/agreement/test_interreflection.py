"""Rendered interreflection: against the closed form, and against what `observe` sees.

In an integrating sphere of radius R and albedo rho a light of intensity 1 anywhere inside brings
H = rho / pi * rho / (1 - rho) / R^2 to every point of the wall by way of all others.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import render
from lightloc import (
    Irradiance,
    Lambert,
    Observations,
    PointLights,
    Reason,
    Way,
    localize,
    radiance,
    shading,
)
from render.interreflection import interreflected
from validation import compare

POINTS, SPP = 1024, 256
ALBEDO = 0.6
PLACES = np.array([[0.45, -0.3, 0.35], [-0.3, 0.4, -0.2], [0.1, 0.5, 0.3]])
MEAN, LEAST, MOST = 0.2, 0.9, 1.1  # limits of z-scores, as for observations (test_sphere)


def bare(room: render.Room) -> SimpleNamespace:
    """The room's geometry without its materials: it can't render."""
    return SimpleNamespace(visible=room.geometry.visible, intersect=room.geometry.intersect)


def within(z: np.ndarray) -> bool:
    return bool(abs(z.mean()) < MEAN and LEAST < z.std() < MOST)


@pytest.mark.parametrize("radius", [1.0, 2.5])
def test_closed_form(radius, load):
    """In a sphere H is the same for every light and everywhere, to within its standard error."""
    room = load("sphere", radius=radius, albedo=ALBEDO)
    q = render.observe(room, points=POINTS, seed=0, transport="direct")
    H, error = interreflected(room, q, spp=SPP)(radius * PLACES)
    assert H.shape == error.shape == (POINTS, len(PLACES), 1)
    expected = ALBEDO / np.pi * ALBEDO / (1 - ALBEDO) / radius**2
    for i in range(len(PLACES)):
        assert within(((H - expected) / error)[:, i])
    assert not within((H - 1.05 * expected) / error)  # negative control


@pytest.mark.parametrize("depth", [3, 4, 6])
def test_paths_that_end(depth, load):
    """Those of n parts have rho + ... + rho^(n - 2) of rho / (1 - rho), also at a light meter."""
    room = load("sphere", radius=1.0, albedo=ALBEDO)
    q = replace(render.observe(room, points=POINTS, transport="direct"), max_depth=depth)
    sums = [sum(ALBEDO**k for k in range(1, last)) for last in (depth - 1, depth)]
    H, error = interreflected(room, q, spp=SPP)(PLACES[:1])
    assert within((H - ALBEDO / np.pi * sums[0]) / error)
    assert not within((H - ALBEDO / np.pi * sums[1]) / error)
    meters = readings(q, max_depth=depth)
    H, error = room.geometry.interreflection(PLACES[:1], meters, SPP)
    assert within((H - sums[0]) / error)


@pytest.mark.parametrize("name", ["box_colored", "box_conductor", "box_mixed"])
def test_total_radiance(name, load):
    """S and H of the true lights make up what is seen, with errors that are not shared.

    The same seed as the observations' own must not give their errors again: z would be narrower.
    """
    room = load(name)
    q = render.observe(room, points=POINTS, spp=SPP, seed=5)
    H, error = interreflected(room, q, spp=SPP, seed=5)(room.lights.positions)
    assert H.shape == (POINTS, len(room.lights), q.channels)
    S = shading(q, room.lights.positions, room.geometry)
    I = room.lights.intensities
    left = q.radiance - ((S + H) * I).sum(axis=1)
    z = left / np.sqrt(q.sigma**2 + np.square(error * I).sum(axis=1))
    assert within(z)
    bright = q.radiance - ((S + 1.2 * H) * I).sum(axis=1)  # negative control
    assert not within(bright / np.sqrt(q.sigma**2 + np.square(error * I).sum(axis=1)))


def test_own_lights_do_not_count(load):
    """The room's lights are not used: another room's function is the same, bit for bit."""
    room = load("box_two")
    other = render.relight(room, PointLights([[1.0, 1.0, 1.0]], [50.0]))
    q = render.observe(room, points=64, seed=0, transport="direct")
    one, two = (interreflected(r, q, spp=16)(room.lights.positions)[0] for r in (room, other))
    assert (one == two).all()


def test_same_paths(load):
    """A light that moves a little changes H a little: its paths stay, in every call.

    Moved by 1 mm of 2 m, H changes by some 1e-3; independent paths would by 30 % at 16 samples.
    """
    room = load("box_two")
    q = render.observe(room, points=256, seed=0, transport="direct")
    H = interreflected(room, q, spp=16)
    p = room.lights.positions
    here, there = H(p)[0], H(p + 1e-3)[0]
    assert np.median(np.abs(there / here - 1)) < 0.01
    assert (H(p)[0] == here).all()
    assert (H(p[:1])[0] == here[:, :1]).all()
    elsewhere = interreflected(room, q, spp=16, seed=1)(p)[0]
    assert np.median(np.abs(elsewhere / here - 1)) > 0.05  # negative control: other paths


def test_a_light_that_is_moved_is_as_one_put_there(load):
    """The geometry moves one light about in a scene that it builds once; H does not know of it."""
    room = load("box_two")
    q = render.observe(room, points=128, seed=0, transport="direct")
    p = room.lights.positions
    both, _ = room.geometry.interreflection(p, q, 16, 2)
    anew, _ = render.load("box_two").geometry.interreflection(p[:1], q, 16, 2)
    assert (both[:, :1] == anew).all()
    assert (both[:, 1:] != anew).any()  # negative control: the light was moved
    assert (room.geometry.interreflection(p, q, 16, 2)[0] == both).all()


def test_a_geometry_renders_what_a_function_gives(load):
    """``indirect=N`` is the geometry's own rendering: the answer of `render.interreflected`, but
    for its paths: answers whose errors have nothing in common differ by sqrt(2) of one of them.
    """
    room = load("box_two")
    q = render.observe(room, points=512, spp=64, seed=0)
    own = localize(q, room.geometry, indirect=32, seed=3)
    given = localize(q, room.geometry, indirect=interreflected(room, q, spp=32, seed=3), seed=3)
    assert own.way is given.way is Way.RENDERED
    apart = np.abs(own.lights.positions - given.lights.positions) / own.position_error
    assert apart.max() < 3.3 * np.sqrt(2)
    np.testing.assert_allclose(own.intensity_error, given.intensity_error, rtol=0.1)
    again = localize(q, room.geometry, indirect=32, seed=3)
    assert (again.lights.positions == own.lights.positions).all()
    assert not own.why
    for found in (localize(q, room.geometry), localize(q, room.geometry, indirect="gathered")):
        assert found.way is Way.GATHERED
    with pytest.raises(ValueError, match="indirect is 'rendered'; expected a number of paths"):
        localize(q, room.geometry, indirect="rendered")


def test_an_unknown_sigma_beside_rendered_light(load):
    """What is estimated is the noise of B, without the rendering's own, which is known."""
    room = load("box_two")
    q = render.observe(room, points=1500, spp=256, seed=0, noise=0.1)
    found = localize(q.with_radiance(q.radiance, None), room.geometry, indirect=64)
    assert found.reason in (Reason.CONVERGED, Reason.UNDECIDED)
    bright = q.radiance > np.median(q.radiance)
    ratio = np.median(found.sigma[bright] / q.sigma[bright])
    assert 0.9 < ratio < 1.2  # of path tracing's and the rendering's own, which is about a tenth
    known = localize(q, room.geometry, indirect=64)
    assert abs(found.intensity_error / known.intensity_error - 1).max() < 0.2


def test_rendered_for_what_is_left(load):
    """Where saturated points are left out, a function is asked for the others alone."""
    room = load("box_two")
    q = render.observe(room, points=512, spp=64, seed=0)
    bright = q.radiance[:, 0] > np.quantile(q.radiance, 0.98)
    H = interreflected(room, q, spp=32)
    found = localize(replace(q, saturated=bright), room.geometry, indirect=H)
    for more in ({"geometry": bare(room)}, {"geometry": room.geometry, "indirect": "gathered"}):
        with pytest.raises(ValueError, match="footnote 1 would gather from points that are satu"):
            localize(replace(q, saturated=bright), **more)
    assert np.isnan(found.residual[bright]).all()
    assert np.isfinite(found.residual[~bright]).all()


def test_grey_material(load):
    """Grey observations get one channel."""
    room = load("box_one")
    q = render.observe(room, points=16, seed=0, transport="direct")
    assert isinstance(q.material, Lambert)
    assert interreflected(room, q, spp=2)(room.lights.positions)[0].shape == (16, 1, 1)


def test_refuses(load, refuses):
    """A standard error needs two samples; positions are (k, 3); a meter sees no surface."""
    room = load("box_one")
    q = render.observe(room, points=16, seed=0, transport="direct")
    with refuses("interreflected: spp is 1; expected"):
        interreflected(room, q, spp=1)
    with refuses("positions"):
        interreflected(room, q, spp=2)([[0.0, 1.0]])
    with refuses("samples of interreflected light is 1; expected"):
        room.geometry.interreflection(room.lights.positions, q, 1)
    both = replace(q, interreflected=True)
    with refuses("indirect is 2.5; expected"):
        localize(both, room.geometry, indirect=2.5)
    with refuses("method 'paper' renders"):
        localize(q, room.geometry, method="paper", indirect=16)
    with refuses("this geometry can't render"):
        localize(both, bare(room), indirect=16)
    with refuses("interreflected irradiance can't be gathered from other readings"):
        localize(replace(both, material=Irradiance()), bare(room))


def readings(q: Observations, **more) -> Observations:
    """Light meters at the points of ``q``, their values still to come."""
    given = {"positions": q.positions, "normals": q.normals, "radiance": np.ones(len(q)), **more}
    return Observations(material=Irradiance(), **given)


def test_irradiance_of_a_sphere(load):
    """A meter in an integrating sphere of albedo rho has rho / (1 - rho) I / R^2 more, anywhere."""
    room = load("sphere", radius=1.0, albedo=ALBEDO)
    q = readings(render.observe(room, points=POINTS, transport="direct"))
    H, error = room.geometry.interreflection(PLACES[:1], q, SPP)
    assert within((H - ALBEDO / (1 - ALBEDO)) / error)
    assert not within((H - 1.05 * ALBEDO / (1 - ALBEDO)) / error)


def test_irradiance_is_what_lambert_reflects(load):
    """Interreflected radiance of a diffuse surface is albedo / pi times its irradiance."""
    room = load("box_two")
    q = render.observe(room, points=300, transport="direct")
    H, error = room.geometry.interreflection(room.lights.positions, q, 256, seed=1)
    E, own = room.geometry.interreflection(room.lights.positions, readings(q), 256, seed=2)
    share = (q.material.albedo / np.pi)[:, None]
    assert within((H - share * E) / np.hypot(error, share * own))


def test_light_meters_find_lights_in_a_closed_room(load):
    """Most of the readings is interreflected; taken for direct, they are not explained."""
    room = load("box_two")
    seen = render.observe(room, points=300, transport="direct")
    q = readings(seen, sigma=None, interreflected=True)
    H, _ = room.geometry.interreflection(room.lights.positions, q, 1024, seed=5)
    straight = radiance(replace(q, interreflected=False), room.lights, room.geometry)
    E = straight + np.einsum("nkc,kc->nc", H, room.lights.intensities)
    assert straight.sum() < 0.5 * E.sum()
    sigma = 0.02 * E
    q = q.with_radiance(E + sigma * np.random.default_rng(3).normal(size=E.shape), sigma)
    found = localize(q, room.geometry, indirect=256)
    assert found.reason is Reason.CONVERGED
    assert found.way is Way.RENDERED
    assert compare(found.lights, room.lights, room.diagonal).worst_position_percent < 1
    taken = localize(replace(q, interreflected=False), room.geometry)
    assert taken.reason is not Reason.CONVERGED
