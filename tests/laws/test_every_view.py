"""Which way interreflected light is treated, what is rendered again, and errors that are shared."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import render
from lightloc import (
    Conductor,
    Kind,
    Lambert,
    Observations,
    Options,
    Plastic,
    PointLights,
    Reason,
    Way,
    localize,
    shading,
)
from lightloc.fit.problem import Problem
from lightloc.interreflection.all_light import Split
from lightloc.interreflection.choice import COVERED, GLOSSY, chosen, coverage
from lightloc.interreflection.footnote_1 import removed
from lightloc.interreflection.gloss import glossiness
from lightloc.interreflection.rendered import Paths, Rendered
from lightloc.interreflection.shared import with_shared

POINTS, SPP = 600, 64
LIGHTS = PointLights([[0.4, -0.3, 0.9], [-1.0, 0.9, 0.2]], [5.0, 3.0])


@pytest.fixture(scope="module")
def box(load):
    """A diffuse box with two lights, observed everywhere in all light."""
    room = load("box_two")
    return room, render.observe(room, points=POINTS, spp=SPP, seed=3)


def of_one_side(room: render.Room, q: Observations) -> Observations:
    """What lies in the half of the room with the smaller x, as one camera might see it."""
    return q.at(q.positions[:, 0] < room.bounds[:, 0].mean())


def bare(room: render.Room) -> SimpleNamespace:
    """The room's geometry without its materials: it can't render."""
    return SimpleNamespace(visible=room.geometry.visible, intersect=room.geometry.intersect)


def test_coverage_is_a_share_of_solid_angle(box, rng):
    """Of a sphere's wall every point gets as much light from every other, area for area: points on
    a share of it cover that share, to within the chance of 256 x 64 rays and a reach at the rim.
    """
    x = rng.normal(size=(2000, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    material = Lambert(albedo=0.5)
    ball = Observations(
        positions=x, normals=-x, directions=-x, radiance=np.ones(len(x)), material=material
    )

    class Ball:
        def visible(self, x, p, active=True):
            return active

        def intersect(self, x, d, active=True):
            along = x[0] * d[0] + x[1] * d[1] + x[2] * d[2]
            return along < 0, x - 2 * along * d

    assert coverage(ball, Ball()) > 0.999
    for top in (0.2, 0.5):
        cap = ball.at(x[:, 2] > 1 - 2 * top)
        assert top - 0.02 < coverage(cap, Ball()) < top + 0.15


@pytest.mark.slow
def test_only_diffuse_is_not_glossy(rng):
    """Lambert sends all alike; a coat sends some by direction; metal sends nearly all so."""
    up = np.tile([0.0, 0.0, 1.0], (300, 1))
    x = rng.uniform(-1, 1, (300, 3)) * [1, 1, 0]

    def share(material) -> float:
        return glossiness(
            Observations(
                positions=x, normals=up, directions=up, radiance=np.ones(300), material=material
            )
        )

    assert share(Lambert(albedo=rng.uniform(0.1, 0.9, 300))) < 1e-6
    assert GLOSSY < share(Plastic(alpha=0.3, diffuse=0.5)) < share(Conductor(alpha=0.3)) < 1


def test_a_room_seen_everywhere_is_gathered(box):
    room, q = box
    assert coverage(q, room.geometry) > COVERED
    choice = chosen(q, room.geometry, False)
    assert (choice.way, choice.doubtful) == (Way.GATHERED, False)
    assert "largely diffuse" in choice.why


@pytest.mark.slow
def test_half_a_room_is_rendered_or_doubted(box):
    """Half of it observed: rendered where that is possible, else a verdict says what is missing."""
    room, q = box
    half = of_one_side(room, q)
    assert coverage(half, room.geometry) < COVERED
    found = localize(half, room.geometry, bounds=room.bounds)
    assert found.way is Way.RENDERED
    assert found.why.startswith("The observations cover ")
    assert found.why in str(found)
    assert len(found.lights) == len(room.lights)
    doubted = localize(half, bare(room), bounds=room.bounds)
    assert doubted.way is Way.GATHERED
    assert doubted.reason is not Reason.CONVERGED
    assert any(verdict.kind is Kind.INDIRECT for verdict in doubted.verdicts)


def test_what_is_not_observed_is_unsure(box):
    """Light from the half that is not observed is guessed, and all of it counts as error."""
    room, q = box
    low = q.positions[:, 0] < room.bounds[:, 0].mean()
    whole, half = (removed(some, room.geometry).direct for some in (q, q.at(low)))
    assert half.sigma.mean() > 1.2 * whole.sigma[low].mean()
    assert removed(q, room.geometry).shared.shape == (3, POINTS, 1)


def counted(room: render.Room, q: Observations) -> tuple[Paths, list[np.ndarray]]:
    """Paths of a geometry that keeps where it was asked to render."""
    asked: list[np.ndarray] = []

    class Counting:
        def interreflection(self, positions, observations, samples, seed):
            asked.append(np.array(positions))
            return room.geometry.interreflection(positions, observations, samples, seed)

    return Paths(Counting(), q, 8, 0), asked


def test_a_light_at_rest_keeps_what_was_rendered(box):
    """Only lights that moved are rendered again; H of the others is the same to the bit."""
    room, q = box
    source, asked = counted(room, q)
    p = room.lights.positions
    before = Rendered.at(source, p)
    assert len(asked) == len(p)
    moved = p + np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
    after = before.moved(moved, np.array([False, True]))
    assert len(asked) == len(p) + 1
    np.testing.assert_array_equal(asked[-1], moved[1:])
    np.testing.assert_array_equal(after.around[:, 0], before.around[:, 0])
    assert (after.around[:, 1] != before.around[:, 1]).any()
    again = Rendered.at(source, moved)  # the same paths, whichever way it came there
    np.testing.assert_array_equal(again.around, after.around)
    assert after.moved(p, np.zeros(2, bool)) is after


def test_lights_have_paths_of_their_own(box):
    """Two lights at one place are rendered with independent errors."""
    room, q = box
    source, _ = counted(room, q)
    H = Rendered.at(source, np.repeat(room.lights.positions[:1], 2, axis=0)).around
    assert np.median(np.abs(H[:, 0] / H[:, 1] - 1)) > 0.05


def test_intensities_scale_what_was_rendered(box):
    """Twice the light is twice of it, with nothing rendered anew."""
    room, q = box
    source, asked = counted(room, q)
    H = Rendered.at(source, room.lights.positions)
    S = shading(q, room.lights.positions, room.geometry)
    split = Split(q, S, H.around, H.error, 5.0)
    bright = replace(split, q=q.with_radiance(2 * q.radiance, 2 * q.sigma, True))
    np.testing.assert_allclose(bright.intensities(), 2 * split.intensities(), rtol=1e-9)
    assert len(asked) == len(room.lights)


def test_an_error_like_a_light_is_in_its_intensity(rng):
    """A shared error of a tenth of one light's own shape makes that intensity a tenth unsure, and
    nothing else; one that no light resembles changes little.
    """
    x = rng.uniform(-2, 2, (400, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (400, 1))
    q = Observations(
        positions=x, normals=up, directions=up, radiance=np.zeros(400), material=Lambert(albedo=0.5)
    )
    S = shading(q, LIGHTS.positions)
    B = (S * LIGHTS.intensities).sum(axis=1)
    q = q.with_radiance(B, 0.01 * B.max())
    found = localize(q, bounds=[[-2, -2, 0.1], [2, 2, 2]])
    problem = Problem.of(q, q.sigma, None, np.array([[-2, -2, 0.1], [2, 2, 2]]))
    S = shading(q, found.lights.positions)
    more = with_shared(found, problem, 0.1 * S[None, :, 0] * found.lights.intensities[0], Options())
    added = np.diag(more.covariance - found.covariance)
    expected = np.zeros(8)
    expected[6] = (0.1 * found.lights.intensities[0, 0]) ** 2
    np.testing.assert_allclose(added, expected, rtol=1e-4, atol=1e-4 * expected[6])
    noise = with_shared(found, problem, q.sigma * rng.choice([-1, 1], (1, 400, 1)), Options())
    assert (noise.position_error < 4.5 * found.position_error).all()
