"""Where lights are looked for: closed rooms stay closed, open scenes reach out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import render
from lightloc import (
    Kind,
    Lambert,
    Observations,
    Options,
    Outline,
    PointLights,
    Reason,
    localize,
    radiance,
)
from lightloc.search import Region
from lightloc.search.region import left
from validation.rooms.plane import rooms, rooms_with_discs


def patch(x, normal, lights):
    """Observed points of one direction, exact."""
    n = np.tile(np.asarray(normal, float), (len(x), 1))
    dark = Observations(
        positions=x,
        normals=n,
        directions=n,
        radiance=np.zeros(len(x)),
        material=Lambert(albedo=0.5),
    )
    return dark.with_radiance(radiance(dark, lights), 0.0)


def square(rng, axis, at, n=400):
    """Points of a square of side 2 across an axis."""
    x = rng.uniform(-1, 1, (n, 3))
    x[:, axis] = at
    return x


@pytest.mark.parametrize("name", ["box_two", "box_occluder", "sphere", "furnished"])
def test_a_closed_room_is_its_own_region(name, load):
    """No side is open: the region is the observations' box, to the bit."""
    room = load(name)
    q = render.observe(room, points=1024, seed=0, transport="direct")
    region = Region.of(q, room.geometry, None)
    np.testing.assert_array_equal(region.bounds, q.bounds)
    assert not region.open.any()


def test_a_closed_room_of_arrays():
    """Walls that face inwards close a room of which no geometry is known; discs open none."""
    for room in (rooms(3, count=1)[0], rooms_with_discs(2, 3, count=1)[0]):
        q = room.observe()
        region = Region.of(q, room.geometry, None)
        np.testing.assert_array_equal(region.bounds, q.bounds)
        assert not region.open.any()
    circle = Outline.circle([0, 0], 2.0)
    x, n = circle.sample(300)
    q = Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(300), material=Lambert(albedo=0.5)
    )
    assert not Region.of(q, None, None).open.any()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_wall_alone(axis, sign, rng):
    """A wall seen alone: the region reaches out on the side that it faces, by its extent, and the
    light is found there, wherever the wall is and looks to."""
    normal = sign * np.eye(3)[axis]
    light = PointLights([0.3 * np.roll([0, 1, -1.0], axis) + 1.2 * normal], [10.0])
    q = patch(square(rng, axis, 0.0), normal, light)
    region = Region.of(q, None, None)
    reach = float(np.ptp(q.bounds, axis=0).max())
    out = int(sign > 0)
    assert region.bounds[out, axis] == pytest.approx(sign * reach)
    assert region.bounds[1 - out, axis] == 0
    found = localize(q)
    assert found.reason is Reason.CONVERGED
    np.testing.assert_allclose(found.lights.positions, light.positions, atol=1e-3)


@pytest.mark.parametrize("where", [[0.2, -0.1, 5.5], [2.5, 0.3, 0.8], [-4.0, 3.0, 2.0]])
def test_lights_beyond_are_gone_after(where, rng):
    """A light higher than the first region, or beside it, makes the region wider."""
    light = PointLights([where], [30.0])
    q = patch(square(rng, 2, 0.0), [0, 0, 1], light)
    first = Region.of(q, None, None).bounds
    assert ((light.positions < first[0]) | (light.positions > first[1])).any()
    found = localize(q)
    assert found.reason is Reason.CONVERGED
    np.testing.assert_allclose(found.lights.positions, light.positions, atol=2e-3)


def test_a_light_at_the_border_is_said(rng):
    """In bounds that are too low the answer is no certain one, and says where to look; in those
    that hold the light it says nothing."""
    light = PointLights([[0.2, -0.1, 1.5]], [10.0])
    q = patch(square(rng, 2, 0.0), [0, 0, 1], light)
    low = localize(q.with_radiance(q.radiance, 0.05 * q.radiance), bounds=[[-1, -1, 0], [1, 1, 1]])
    (verdict,) = [v for v in low.verdicts if v.kind is Kind.BORDER]
    assert "+z" in verdict.sentence
    assert verdict.lights
    assert low.reason is not Reason.CONVERGED
    high = localize(q, bounds=[[-1, -1, 0], [1, 1, 2]])
    assert Kind.BORDER not in {v.kind for v in high.verdicts}


@pytest.mark.parametrize("noise", ["given", "scaled", "estimate"])
def test_answers_are_compared_whatever_errors_each_took(noise, rng):
    """A light in the wrong place leaves more than one in the right place, though each answer took
    what it leaves for noise."""
    light = PointLights([[0.2, -0.1, 1.5]], [0.01])
    q = patch(square(rng, 2, 0.0), [0, 0, 1], light)
    sigma = 0.01 * q.radiance
    q = q.with_radiance(q.radiance + sigma * rng.normal(size=sigma.shape), sigma)
    one = Options(noise=noise, most_lights=1)
    there, low = (localize(q, bounds=[[-1, -1, 0], [1, 1, z]], options=one) for z in (2.0, 0.8))
    sizes = [float(np.square(found.residual * found.sigma).mean()) for found in (there, low)]
    assert sizes[1] > 10 * sizes[0]
    assert left(low) > 3 * left(there)


def test_no_region_grows_without_end(rng):
    """A scene lit by no point light at all: at most so many widenings, and no certainty."""
    q = patch(square(rng, 2, 0.0), [0, 0, 1], PointLights([[0, 0, 1]], [1.0]))
    even = replace(q, radiance=np.full((400, 1), 0.3), sigma=np.full((400, 1), 0.003))
    found = localize(even)
    assert found.reason is not Reason.DARK
    assert np.abs(found.lights.positions).max(initial=0) < 2 * 2.0**6


def test_the_floor_of_a_closed_room():
    """Between a scene's walls and beyond them: the geometry says which side is open."""
    room = render.load("box_two")
    q = render.observe(room, points=1500, seed=0, transport="direct", shapes=["floor"])
    region = Region.of(q, room.geometry, None)
    top = room.bounds[1, 2]
    assert region.bounds[1, 2] == pytest.approx(top)  # up to the ceiling, and no further
    assert not region.open.any()
    found = localize(q, room.geometry)
    assert found.reason is Reason.CONVERGED
    np.testing.assert_allclose(
        found.lights.brightest_first().positions,
        room.lights.brightest_first().positions,
        atol=1e-3,
    )
