"""Lights that are wide: the algebra of their shape, and what is found where points are not."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Kind, Lambert, Observations, PointLights, Reason, localize, radiance
from lightloc.fit.criterion import Likelihood
from lightloc.fit.noise import working_sigma
from lightloc.fit.problem import Problem
from lightloc.given.options import Options
from lightloc.search.wide import Unknowns, gathered, joined
from validation.rooms.plane import rooms

SIDE = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
LONG = 0.05  # a segment; two points at its standard deviation look like it
SPREAD = 2 * LONG / np.sqrt(12)


def unknowns(d: int) -> tuple[Unknowns, np.ndarray, np.ndarray]:
    """A point and a wide light in d dimensions, with the covariance of its shape."""
    rng = np.random.default_rng(d)
    u = Unknowns(1, 1, np.arange(d), 1, np.full(3, 0.5))
    T = np.tril(rng.normal(size=(d, d)))
    x = np.concatenate([rng.normal(size=2 * d), [2.0, 3.0], T[np.tril_indices(d)]])
    return u, x, T @ T.T / d


@pytest.mark.parametrize("d", [1, 2, 3])
def test_the_points_have_the_shape(d):
    """Their sum is the intensity, their mean the centroid, their covariance T T^T / d."""
    u, x, C = unknowns(d)
    points, lights = u.expanded(x), u.centroids(x)
    assert len(points) == 1 + 2 * d
    np.testing.assert_allclose(points.positions[0], lights.positions[0])
    np.testing.assert_allclose(points.intensities[1:].sum(axis=0), lights.intensities[1])
    around = points.positions[1:]
    np.testing.assert_allclose(around.mean(axis=0), lights.positions[1])
    off = around - lights.positions[1]
    np.testing.assert_allclose((off.T @ off / len(off))[:d, :d], C, atol=1e-12)
    assert u.width(x)[0] == 0
    assert u.width(x)[1] == pytest.approx(2 * np.sqrt(np.linalg.eigvalsh(C)[-1]))


def seen(room, points: PointLights, noise: float, seed: int = 0) -> Observations:
    """A square room in the light of these points, with noise that is a share of the mean."""
    q = room.observe(400)
    B = radiance(q, points)
    sigma = np.broadcast_to(noise * np.sqrt(np.maximum(B, 0.01) * B.mean()), B.shape)
    noisy = B + sigma * np.random.default_rng(seed).normal(size=B.shape)
    return q.with_radiance(np.maximum(noisy, 0), sigma)


def segment(p, I: float, way) -> PointLights:
    along = (np.arange(16) + 0.5) / 16 - 0.5
    return PointLights(np.asarray(p) + LONG * along[:, None] * np.asarray(way), np.full(16, I / 16))


def test_a_segment_is_one_light_with_a_width():
    """Where it is, how bright and how wide: within four standard errors; and it is no point."""
    room = rooms(2, count=1)[0]
    bar = segment([0.3, 0.25, 0], 3.0, [0.6, 0.8, 0])
    point = PointLights([[0.7, 0.8, 0]], [2.0])
    both = PointLights(
        np.concatenate([bar.positions, point.positions]),
        np.concatenate([bar.intensities, point.intensities]),
    )
    found = localize(seen(room, both, 0.003))
    assert found.reason is Reason.EXTENDED
    assert [v.lights for v in found.verdicts if v.kind is Kind.EXTENDED] == [(0,)]
    assert found.width[0] == pytest.approx(SPREAD, rel=0.15)
    assert found.width[1] == 0
    off = found.lights.positions - [[0.3, 0.25, 0], [0.7, 0.8, 0]]
    assert (np.abs(off[:, :2]) < 4 * found.position_error[:, :2]).all()
    brighter = found.lights.intensities - [[3.0], [2.0]]
    assert (np.abs(brighter) < 4 * found.intensity_error).all()
    assert found.chi2 == pytest.approx(1.0, abs=5 * np.sqrt(2 / 400))
    assert found.position_error.shape == (2, 3)
    np.testing.assert_allclose(
        np.sqrt(np.diag(found.covariance)),
        np.concatenate([found.position_error[:, :2].ravel(), found.intensity_error.ravel()]),
    )


def test_two_points_stay_two():
    """Negative control: further apart than a cluster, or seen without noise, they are told."""
    room = rooms(2, count=1)[0]
    for apart, noise in ((0.07, 0.01), (0.04, 0.0)):
        pair = PointLights([[0.3, 0.25, 0], [0.3 + apart, 0.25, 0]], [2.0, 1.5])
        found = localize(seen(room, pair, noise))
        assert len(found.lights) == 2
        assert not found.width.any()
        assert found.reason is not Reason.EXTENDED


def test_a_disc_in_a_box(rng):
    """A disc of any direction in 3D: its shape is found with its two long axes alike."""
    x = rng.uniform(size=(2000, 3))
    axis, side = rng.integers(0, 3, 2000), rng.integers(0, 2, 2000)
    x[np.arange(2000), axis] = side
    normals = np.zeros_like(x)
    normals[np.arange(2000), axis] = 1.0 - 2.0 * side
    walls = Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros(2000),
        material=Lambert(albedo=0.5),
    )
    angle, ring = rng.uniform(0, 2 * np.pi, 400), 0.04 * np.sqrt(rng.uniform(size=400))
    disc = np.stack([ring * np.cos(angle), ring * np.sin(angle), 0 * ring], axis=1)
    center = np.array([0.3, 0.4, 0.25])
    B = radiance(walls, PointLights(center + disc, np.full(400, 5 / 400)))
    q = walls.with_radiance(B, 1e-3 * B)
    problem = Problem.of(q, working_sigma(q, Options()), None, q.bounds)
    pair = PointLights(center + np.array([[0.02, 0, 0], [-0.02, 0, 0]]), [2.5, 2.5])
    assert gathered(problem, pair, Options().cluster) == [[0, 1]]
    wide = joined(problem, pair, [[0, 1]], Likelihood())
    assert np.linalg.norm(wide.fit.lights.positions[0] - center) < 0.003  # its own sample's mean
    assert wide.fit.lights.intensities[0, 0] == pytest.approx(5.0, rel=1e-3)
    assert wide.width[0] == pytest.approx(0.04, rel=0.1)  # a disc's standard deviation is r / 2
    assert len(wide.points) == 6


def test_lights_at_one_place_and_dark_ones():
    """What a polish may leave: two lights in the same corner, and one that sends nothing."""
    room = rooms(2, count=1)[0]
    q = seen(room, PointLights([[0.3, 0.25, 0]], [3.0]), 0.01)
    problem = Problem.of(q, q.sigma, None, q.bounds)
    alike = PointLights([[0.3, 0.25, 0], [0.3, 0.25, 0], [0.31, 0.25, 0]], [1.5, 1.5, 0.0])
    assert gathered(problem, alike, Options().cluster) == [[0, 1]]
    wide = joined(problem, alike, [[2], [0, 1]], Likelihood())
    assert wide.fit.cost < 1.3 * problem.rows
    assert np.isfinite(wide.fit.lights.positions).all()


def test_rounding_makes_no_light_negative():
    """Least squares may round what sends nothing to just below: that is 0, and no refusal."""
    model, x, _ = unknowns(2)
    first = model.lights * len(model.axes)
    x[first] = -1.11e-16
    assert model.centroids(x).intensities[0, 0] == 0
    assert model.expanded(x).intensities.min() >= 0


def test_wide_lights_stay_in_the_region():
    """A bar along the wall: its centroid does not leave the room."""
    room = rooms(2, count=1)[0]
    q = seen(room, segment([0.5, 0.99, 0], 3.0, [1, 0, 0]), 0.01)
    problem = Problem.of(q, q.sigma, None, np.array([[0, 0, 0], [1, 0.985, 0]]))
    pair = PointLights([[0.48, 0.985, 0], [0.52, 0.985, 0]], [1.5, 1.5])
    wide = joined(problem, pair, [[0, 1]], Likelihood())
    assert wide.fit.lights.positions[0, 1] <= 0.985


def test_brightest_first_takes_the_errors_along():
    """Lights, widths and the covariance's rows change places together."""
    room = rooms(2, count=1)[0]
    bar = segment([0.3, 0.25, 0], 1.0, [1, 0, 0])
    q = seen(room, bar, 0.01)
    problem = Problem.of(q, q.sigma, None, q.bounds)
    three = PointLights([[0.7, 0.8, 0], [0.29, 0.25, 0], [0.31, 0.25, 0]], [0.1, 0.5, 0.5])
    wide = joined(problem, three, [[0], [1, 2]], Likelihood())
    first = wide.brightest_first()
    assert wide.width[0] == 0 < wide.width[1] == first.width[0]
    np.testing.assert_array_equal(first.errors.position, wide.errors.position[::-1])
    error = np.sqrt(np.diag(first.errors.covariance))
    np.testing.assert_allclose(error[:4], first.errors.position[:, :2].ravel())
    np.testing.assert_allclose(error[4:], first.errors.intensity.ravel())


def test_a_wide_light_beside_an_ambient_term():
    """The ambient term is what the light at its width leaves, not a point at its centroid."""
    room = rooms(2, count=1)[0]
    q = seen(room, segment([0.3, 0.25, 0], 3.0, [1, 0, 0]), 0.0)
    q = q.with_radiance(q.radiance + 0.5, 0.01 * np.sqrt(q.radiance * q.radiance.mean()))
    found = localize(q, options=Options(ambient=True))
    assert found.reason is Reason.EXTENDED
    assert found.ambient[0] == pytest.approx(0.5 / np.pi, abs=1e-4)  # f = 1
