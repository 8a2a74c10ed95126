"""What must not matter: where the room stands, how it is turned, its unit of length, any order."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import render
from lightloc import (
    Observations,
    Options,
    Outline,
    PointLights,
    localize,
    radiance,
    shading,
)
from lightloc.fit import POLISH_FALL, Criterion
from lightloc.plane import Loop
from lightloc.search.ground import Ground
from validation.rooms.plane import rooms, rooms_with_discs

LIGHT = np.array([0.4, -0.3, 1.1])
LIGHTS = PointLights([LIGHT, [-1.2, 0.8, 0.4], [1.6, 1.5, -0.7]], [5.0, 2.0, 7.0])
SHIFT = np.array([1.3, -2.2, 0.7])  # metres; of the room's own size, so that float32 stays fine


def moved(q: Observations, turn: np.ndarray, shift: np.ndarray, scale: float = 1.0) -> Observations:
    """The observations of a room that was scaled, turned and shifted."""
    return replace(
        q,
        positions=scale * q.positions @ turn.T + shift,
        normals=q.normals @ turn.T,
        facets=q.facets @ turn.T,
        directions=q.directions @ turn.T,
    )


def scaled(outline: Outline, scale: float) -> Outline:
    """A room so many times as large."""
    walls, *pillars = (Loop(scale * loop.vertices, loop.bulges) for loop in outline.loops)
    return Outline(walls, tuple(pillars))


def test_rigid_motion(sample, facing, rounding):
    """Turning and shifting room and lights together leaves every B as it was.

    Tolerance: the float32 error of S at both places (the fixture ``rounding``).
    """
    q, turn = facing(sample.brdf, LIGHT), Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    there, p = moved(q, turn, SHIFT), turn @ LIGHT + SHIFT
    here, after = shading(q, [LIGHT])[:, 0], shading(there, [p])[:, 0]
    allowed = rounding(q, LIGHT, sample.alpha) + rounding(there, p, sample.alpha)
    assert (np.abs(after / here - 1) <= allowed).all()


def test_a_motion_of_the_room_alone_is_seen(sample, facing, rounding):
    """Negative control: the light left 1 mm behind changes B beyond the tolerance."""
    q = facing(sample.brdf, LIGHT)
    allowed = 2 * rounding(q, LIGHT, sample.alpha)
    left = moved(q, np.eye(3), np.array([1e-3, 0, 0]))
    change = np.abs(shading(left, [LIGHT])[:, 0] / shading(q, [LIGHT])[:, 0] - 1)
    assert (change > allowed).mean() > 0.8


@pytest.mark.parametrize("scale", [0.01, 4.0, 7.3])
def test_scale(sample, facing, rounding, scale):
    """A room s times as large with lights s^2 times as strong looks the same."""
    q = facing(sample.brdf, LIGHT)
    large = moved(q, np.eye(3), np.zeros(3), scale)
    one = PointLights([LIGHT], [5.0])
    other = PointLights([scale * LIGHT], [5.0 * scale**2])
    allowed = 2 * rounding(q, LIGHT, sample.alpha)
    assert (np.abs(radiance(large, other) / radiance(q, one) - 1) <= allowed).all()


def test_scale_of_a_rendered_room(load):
    """Mitsuba's integrating sphere at twice the radius is four times as dark, indirect light too.

    The same seed takes the same paths but for Mitsuba's ray offset, 8.9e-5 (1 + max |x|), which
    does not scale: it moves a bounce by 1e-4 of the radius, hence B by 1e-4 times a slope of a
    few. The limit of 1e-3 is a tenth of the noise, so nothing hides in that.
    """
    once, twice = (
        render.observe(load("sphere", radius=r), points=256, spp=64, seed=5, transport="full")
        for r in (1.0, 2.0)
    )
    np.testing.assert_allclose(twice.positions, 2 * once.positions, atol=1e-6)
    np.testing.assert_allclose(4 * twice.radiance, once.radiance, rtol=1e-3)
    assert np.median(once.sigma / once.radiance) > 1e-2


def test_order_of_lights(sample, facing):
    """The order of the lights changes no B beyond the rounding of a float64 sum."""
    q = facing(sample.brdf, LIGHT)
    order = [2, 0, 1]
    S = shading(q, LIGHTS.positions)
    np.testing.assert_array_equal(shading(q, LIGHTS.positions[order]), S[:, order])
    shuffled = PointLights(LIGHTS.positions[order], LIGHTS.intensities[order])
    np.testing.assert_allclose(radiance(q, shuffled), radiance(q, LIGHTS), rtol=1e-15)


def test_order_of_observations(sample, facing, rng):
    """Each observation's S is its own: reordering the rows reorders S to the bit."""
    q, order = facing(sample.brdf, LIGHT), rng.permutation(96)
    S = shading(q, LIGHTS.positions)
    np.testing.assert_array_equal(shading(q.at(order), LIGHTS.positions), S[order])


@pytest.mark.parametrize(
    ("discs", "scale"), [(0, 2.0**-6), (0, 2.0**7), (2, 2.0**7), (2, 2.0**-20), (2, 1000.0)]
)
def test_an_answer_has_no_unit_of_length(discs, scale):
    """The lights of a room s times as large are found s times as far apart, and as sure.

    What a search compares with a length is a share of the room's, so that the answers have the
    same reason and verdicts. They agree as far as a polish goes: it ends where chi-square, 1 per
    residual, falls by less than `POLISH_FALL` of itself: so many standard errors squared.
    """
    room = rooms_with_discs(discs, 3, count=1)[0] if discs else rooms(3, count=1)[0]
    q = room.observe(noise=0.03)
    geometry = scaled(room.outline, scale) if discs else None
    here, there = localize(q, room.geometry), localize(moved(q, np.eye(3), 0, scale), geometry)
    said = [[(v.kind, v.lights) for v in found.verdicts] for found in (here, there)]
    assert said[0] == said[1]
    assert there.reason is here.reason
    still = np.sqrt(POLISH_FALL[0] * len(q))
    off = np.abs(there.lights.positions / scale - here.lights.positions)
    assert (off <= still * here.position_error).all()
    brighter = np.abs(there.lights.intensities / scale**2 - here.lights.intensities)
    assert (brighter <= still * here.intensity_error).all()
    np.testing.assert_allclose(there.position_error / scale, here.position_error, rtol=1e-3)
    np.testing.assert_allclose(there.resolution / scale, here.resolution, rtol=1e-3)


EXTREMES = (2.0**-20, 2.0**-7, 1e-3, 100.0, 1000.0, 2.0**20)


@pytest.mark.slow
@pytest.mark.parametrize("scale", EXTREMES)
def test_exact_answers_have_no_unit_of_length(scale):
    """From a millionth to a million times the size, shadows included: the same to 1e-12.

    A search in exact data ends in 64 bits, whose rounding is 1e-16. What comes before it computes
    in float32, whose squares would leave its range at either end if they were of lengths.
    """
    room = rooms_with_discs(2, 3, count=1)[0]
    q = room.observe()
    here = localize(q, room.outline)
    there = localize(moved(q, np.eye(3), 0, scale), scaled(room.outline, scale))
    assert there.reason is here.reason and len(there.lights) == len(here.lights)
    np.testing.assert_allclose(there.lights.positions / scale, here.lights.positions, atol=1e-12)
    np.testing.assert_allclose(
        there.lights.intensities / scale**2, here.lights.intensities, rtol=1e-12
    )


@pytest.mark.parametrize("scale", EXTREMES)
def test_shadows_have_no_unit_of_length(scale):
    """V is the same but where rays pass an edge by what the offset of their origin moves them.

    In a room of at least one unit that is Mitsuba's, 9e-5 (1 + max|x|), and 9e-5 (diagonal +
    max|x|) in a smaller one. With a fixed length the smallest rooms had no light at all.
    """
    room = rooms_with_discs(2, 3, count=1)[0]
    q = room.observe()
    p = np.random.default_rng(0).uniform(*room.outline.bounds, (200, 3)) * [1, 1, 0]
    p = p[room.outline.inside(p)]
    here = shading(q, p, room.outline)[:, :, 0]
    there = shading(moved(q, np.eye(3), 0, scale), scale * p, scaled(room.outline, scale))[:, :, 0]
    assert ((here > 0) != (there > 0)).mean() < 1e-3
    assert 0.1 < (here > 0).mean() < 0.9


def test_a_search_sees_soft_shadows_by_a_share_of_the_room():
    """The edges that a search widens are as wide in a hall, beside its walls, as in a chamber."""
    room, o = rooms_with_discs(2, 3, count=1)[0], Options()
    q, blurs = room.observe(noise=0.03), []
    for seen, geometry in (
        (q, room.outline),
        (moved(q, np.eye(3), 0, 128.0), scaled(room.outline, 128.0)),
    ):
        ground = Ground.of(seen, geometry, seen.bounds, o, 0)
        blurs.append(ground.view(ground.whole, o, Criterion.of(o)).through(0.02, 0.005).blur)
    assert 0 < 128 * blurs[0] == blurs[1]
