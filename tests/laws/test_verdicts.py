"""What the data can't decide is said: each verdict where it holds, and not where it does not."""

from __future__ import annotations

import numpy as np
import pytest

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
from lightloc.answer.verdicts import clusters, too_few, uncertain
from lightloc.fit import Bound, Problem
from validation.rooms.plane import rooms


def kinds(found) -> set[Kind]:
    return {verdict.kind for verdict in found.verdicts}


def walls(n: int, rng: np.random.Generator) -> Observations:
    """Points on four walls of a 3D room, all at one height: a ring in the plane z = 0."""
    x, normals = Outline.polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]]).sample(n)
    return Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros(n),
        material=Lambert(albedo=0.5),
    )


BOX = [[-1, -1, -0.8], [1, 1, 0.8]]


def test_mirror(rng):
    """Seen from one plane alone, a light above it may as well be below."""
    q = walls(300, rng)
    lit = q.with_radiance(radiance(q, PointLights([[0.3, 0.2, 0.4]], [3.0])), 0.0)
    found = localize(lit, bounds=BOX)
    assert Kind.MIRROR in kinds(found)
    assert found.reason is Reason.UNDECIDED
    assert abs(found.lights.positions[0, 2]) == pytest.approx(0.4, abs=1e-3)
    (said,) = (v for v in found.verdicts if v.kind is Kind.MIRROR)
    assert said.lights == (0,)


def test_no_mirror_where_points_leave_the_plane(rng):
    """Negative control: points at other heights decide."""
    q = walls(300, rng)
    x = q.positions + np.array([0, 0, 1]) * rng.uniform(-0.8, 0.8, (300, 1))
    q = Observations(
        positions=x,
        normals=q.normals,
        directions=q.normals,
        radiance=np.zeros(300),
        material=q.material,
    )
    lit = q.with_radiance(radiance(q, PointLights([[0.3, 0.2, 0.4]], [3.0])), 0.0)
    found = localize(lit, bounds=BOX)
    assert found.reason is Reason.CONVERGED
    assert Kind.MIRROR not in kinds(found)


def test_too_few():
    """Two points can't decide a light of three unknowns."""
    room = rooms(2, count=1)[0]
    whole = room.observe(400)
    q = Observations(
        positions=whole.positions[[50, 150]],
        normals=whole.normals[[50, 150]],
        directions=whole.directions[[50, 150]],
        radiance=whole.radiance[[50, 150]],
        material=Lambert(albedo=np.pi),
    )
    found = localize(q, bounds=whole.bounds)
    assert Kind.TOO_FEW in kinds(found)
    assert found.reason is Reason.UNDECIDED


def test_hidden():
    """Behind an occluder that itself is not observed lies space that nothing sees."""
    square = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    room = square.with_occluders(Outline.disc([0.5, 0.3], 0.2))
    x, n = square.sample(400)
    near = x[:, 1] < 0.01  # only the wall below is observed: the disc hides what is above it
    q = Observations(
        positions=x[near],
        normals=n[near],
        directions=n[near],
        radiance=np.zeros(near.sum()),
        material=Lambert(albedo=np.pi),
    )
    bounds = square.bounds
    lit = q.with_radiance(radiance(q, PointLights([[0.15, 0.4, 0]], [2.0]), room), 0.0)
    assert Kind.HIDDEN in kinds(localize(lit, room, bounds=bounds))
    empty = q.with_radiance(radiance(q, PointLights([[0.15, 0.4, 0]], [2.0])), 0.0)
    assert Kind.HIDDEN not in kinds(localize(empty, square, bounds=bounds))


def test_inside_of_solids_is_not_hidden():
    """Where every wall is observed, the disc's inside reaches none, and nobody can be there."""
    room = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).with_occluders(
        Outline.disc([0.5, 0.5], 0.2)
    )
    x, n = room.sample(400)
    q = Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(400), material=Lambert(albedo=np.pi)
    )
    lit = q.with_radiance(radiance(q, PointLights([[0.15, 0.4, 0]], [2.0]), room), 0.0)
    assert Kind.HIDDEN not in kinds(localize(lit, room))


def test_a_cluster():
    """Two lights nearer than the resolution are found as one, said to be maybe two."""
    room = rooms(2, count=1)[0]
    dark = room.observe(400)
    lights = PointLights([[0.5, 0.5, 0], [0.53, 0.52, 0]], [2.0, 2.0])
    B = radiance(dark, lights)
    sigma = 0.05 * np.sqrt(B)
    noisy = np.maximum(B + sigma * np.random.default_rng(1).normal(size=B.shape), 0)
    found = localize(dark.with_radiance(noisy, 0.05 * np.sqrt(np.maximum(noisy, 0.01))))
    assert len(found.lights) == 1
    assert Kind.CLUSTER in kinds(found)
    assert found.resolution[0] > 0.036  # their distance
    assert found.lights.intensities[0, 0] == pytest.approx(4.0, rel=0.05)


def test_uncertain():
    """The noise decides whether a light is known: ten times as much, and the answer says so."""
    room = rooms(3, count=1)[0]
    reasons = []
    for k in (0.002, 0.2):
        found = localize(room.observe(400, noise=k))
        reasons.append((found.reason, Kind.UNCERTAIN in kinds(found)))
    assert reasons == [(Reason.CONVERGED, False), (Reason.UNDECIDED, True)]


def test_unexplained():
    """Walls painted otherwise than one thinks: the residual test says that the model is wrong."""
    room = rooms(2, count=1)[0]
    q = room.observe(400, noise=0.01)
    paint = 1 + 0.1 * np.sin(np.arange(400) / 9)[:, None]
    found = localize(q.with_radiance(q.radiance * paint, q.sigma))
    assert found.reason is Reason.NO_GAIN
    assert Kind.UNEXPLAINED in kinds(found)
    assert found.chi2 > 2
    assert "Do not lean on these errors" in str(found)
    assert "Do not lean" not in str(localize(q))


def test_the_most_lights():
    """A limit that is reached is named, with what is left."""
    room = rooms(3, count=1)[0]
    found = localize(room.observe(400), options=Options(most_lights=2))
    assert found.reason is Reason.MOST_LIGHTS
    assert len(found.lights) == 2
    assert found.certificate > 10


SIZE = 4.0  # metres: what is a share of a length must not be taken for metres
O = Options()


def empty(lit: int, channels: int = 1) -> Problem:
    """A room 4 m wide, of so many lit observations and forty that are dark."""
    n = lit + 40
    x = np.random.default_rng(0).uniform(0, SIZE, (n, 3))
    x[:2] = np.array([[0.0], [SIZE]])
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    B = np.zeros((n, channels))
    B.ravel()[: lit * channels] = 1.0
    q = Observations(positions=x, normals=up, directions=up, radiance=B, material=Lambert(0.5))
    return Problem.of(q, np.ones_like(B), None, q.bounds)


@pytest.mark.parametrize("channels", [1, 3])
def test_as_many_lit_observations_as_unknowns_are_too_few(channels):
    """Three coordinates and an intensity a channel for each of three lights, and one more."""
    lights = PointLights(np.ones((3, 3)), np.ones((3, channels)))
    unknowns = 3 * (3 + channels)
    lit = unknowns // channels  # observations; each counts once a channel
    assert [v.kind for v in too_few(empty(lit, channels), lights)] == [Kind.TOO_FEW]
    assert not too_few(empty(lit + 1, channels), lights)


@pytest.mark.parametrize(("share", "said"), [(0.98, False), (1.02, True)])
def test_a_light_is_uncertain_from_its_limits_on(share, said):
    """A 95 % interval of its place, of the room's size, or of its brightness: either is enough."""
    lights = PointLights([[1.0, 1, 1]], [2.0])
    wide = share * O.sure_position * SIZE / 1.96
    loud = share * O.sure_intensity * 2.0 / 1.96
    for place, bright in ((wide, 0.0), (0.0, loud)):
        errors = Bound(place * np.array([[0.6, 0, 0.8]]), np.array([[bright]]), np.zeros((4, 4)))
        assert bool(uncertain(empty(9), lights, errors, O)) is said


@pytest.mark.parametrize(("share", "said"), [(0.98, False), (1.02, True)])
def test_a_light_may_be_several_from_a_share_of_the_room_on(share, said):
    """Not from so many metres on."""
    apart = np.array([share * O.cluster * SIZE])
    assert bool(clusters(empty(9), apart, (), O)) is said


def test_a_lit_scene_is_never_called_dark():
    """A region without height, the floor's own box: no light in it lights the floor, and the answer
    says so.

    The controls: nothing is lit, and darkness explains it; with the default region the light is
    found.
    """
    rng = np.random.default_rng(0)
    floor = rng.uniform(-2, 2, (300, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (300, 1))
    dark = Observations(
        positions=floor,
        normals=up,
        directions=up,
        radiance=np.zeros(300),
        material=Lambert(albedo=0.5),
    )
    B = radiance(dark, PointLights([[0.5, -0.3, 1.2]], [10.0]))
    flat = [[-2, -2, 0], [2, 2, 0]]
    found = localize(dark.with_radiance(B, 0.01 * B), bounds=flat)
    assert found.reason is Reason.NO_GAIN and not len(found.lights)
    assert {Kind.UNEXPLAINED, Kind.HIDDEN} <= kinds(found)
    assert localize(dark.with_radiance(0 * B, 0.01 * B)).reason is Reason.DARK
    assert localize(dark.with_radiance(B, 0.01 * B)).reason is Reason.CONVERGED
