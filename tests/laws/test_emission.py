"""Lamps taken for points, and shadows taken from a geometry that is not so: told by kind.

Radiance is computed here in NumPy. Negative controls: where the model is right nothing is said, and
no standard error changes.
"""

from __future__ import annotations

import lightloc  # isort: skip  # before drjit: it chooses the LLVM library

import drjit as dr
import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import Kind, Lambert, Observations, PointLights, Reason, localize, radiance
from lightloc.diagnosis.covered import joined
from lightloc.diagnosis.lamps import Lamps, model_of, stepped
from lightloc.fit import Problem

ALBEDO = 0.6
SIZE = np.array([4.0, 3.0, 2.5])
LAMP = np.array([1.2, 1.1, 2.0])
DOWN = np.array([0.0, 0.0, -1.0])
TILTED = np.array([0.36, 0.0, -0.93]) / np.hypot(0.36, 0.93)
INSIDE = np.array([[0.0, 0.0, 0.05], SIZE])
STEP = 1e-6


def floor(n: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Points on a floor, and their normals."""
    return rng.random((n, 3)) * SIZE * [1, 1, 0], np.tile([0.0, 0.0, 1.0], (n, 1))


def walls(n: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Points on all sides of a room, and their normals."""
    x, normals = rng.random((n, 3)) * SIZE, np.zeros((n, 3))
    axis, side = rng.integers(0, 3, n), rng.integers(0, 2, n)
    x[np.arange(n), axis] = side * SIZE[axis]
    normals[np.arange(n), axis] = 1.0 - 2.0 * side
    return x, normals


def emitted(
    x: NDArray, normals: NDArray, p: NDArray, exponent: float, axis: NDArray = DOWN
) -> NDArray:
    """(n,) B of a lamp of 20 W/sr at p that shines as cos^m; of a point where m is 0."""
    d = p - x
    r = np.linalg.norm(d, axis=1)
    cosine = np.maximum(-(d @ axis) / r, 0)
    shape = cosine**exponent if exponent else np.ones(len(x))
    return 20 * ALBEDO / np.pi * shape * np.maximum((d * normals).sum(axis=1), 0) / r**3


def observed(
    x: NDArray, normals: NDArray, B: NDArray, noise: float, rng: np.random.Generator
) -> Observations:
    """B with so much noise of its mean square."""
    sigma = noise * np.sqrt(np.square(B).mean())
    return Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=B + sigma * rng.normal(size=B.shape),
        sigma=sigma,
        material=Lambert(albedo=ALBEDO),
    )


def test_derivatives_of_lamps(rng):
    """All of them, by central differences of float64 kernels."""
    x, normals = walls(200, rng)
    q = observed(x, normals, emitted(x, normals, LAMP, 1), 0.01, rng)
    problem = Problem.of(q, q.known_sigma, None, INSIDE, double=True)
    axes = np.array([[0.1, 0.2, -0.97], [0.5, 0.1, -0.8]])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    places, amounts = np.array([[1, 1, 1.5], [2, 2, 2.0]]), np.array([[10.0], [20.0]])
    lamps = Lamps(places, amounts, axes, np.array([2.0, 4.0]))
    _, J = model_of(problem, lamps)
    for u in range(J.shape[2]):
        step = STEP * np.eye(J.shape[2])[u]
        ahead, behind = (model_of(problem, stepped(problem, lamps, s))[0] for s in (step, -step))
        slope = (behind - ahead)[:, 0] / (2 * STEP)
        assert np.abs(slope - J[0, :, u]).max() < 1e-6 * np.abs(J[0, :, u]).max()


def test_joined_covers_both(rng):
    """In no direction less than either; the first itself where it is larger (the control)."""
    a, b = (m @ m.T for m in rng.normal(size=(2, 4, 4)))
    both = joined(a, b)
    for one in (a, b):
        assert np.linalg.eigvalsh(both - one).min() > -1e-9 * np.trace(both)
    assert np.allclose(joined(a + b, b), a + b)
    assert not np.allclose(both, a)


@pytest.mark.slow
@pytest.mark.parametrize(("room", "exponent"), [(walls, 1), (walls, 15), (floor, 4)])
def test_a_lamp_is_told(room, exponent, rng):
    """One lamp in place of the points that only adapt to it, within five standard errors of where
    it is, and named first. It is tilted: over a floor alone, one that shines straight down looks
    like a point whose radiance was raised to a power."""
    x, normals = room(600, rng)
    q = observed(x, normals, emitted(x, normals, LAMP, exponent, TILTED), 0.01, rng)
    found = localize(q, bounds=INSIDE)
    assert found.reason is Reason.UNDECIDED
    assert found.verdicts[0].kind is Kind.EMISSION
    (p,), (error,) = found.lights.positions, found.position_error
    assert (np.abs(p - LAMP) < 5 * error).all()
    assert np.linalg.norm(p - LAMP) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("room", [walls, floor])
def test_a_point_is_none(room, rng):
    """The control: nothing is said of emission, and the errors are the Cramér-Rao bound's."""
    x, normals = room(900, rng)
    q = observed(x, normals, emitted(x, normals, LAMP, 0), 0.01, rng)
    found = localize(q, bounds=INSIDE)
    assert found.reason is Reason.CONVERGED
    assert not {Kind.EMISSION, Kind.ASSUMED} & {v.kind for v in found.verdicts}
    bound = lightloc.cramer_rao(q, found.lights)
    assert np.allclose(found.position_error, bound.position, rtol=1e-3)


@pytest.mark.slow
def test_what_is_assumed_is_covered(rng):
    """A lamp straight above a small target, seen through much noise: a point explains as well. The
    errors reach to where the lamp is, and a verdict says what that hangs on."""
    x, normals = floor(400, rng)
    x = (x / SIZE - [0.5, 0.5, 0]) * [0.8, 0.8, 0] + [2, 1.5, 0]
    lamp = np.array([2.1, 1.4, 2.0])
    q = observed(x, normals, emitted(x, normals, lamp, 1), 0.02, rng)
    found = localize(q, bounds=INSIDE)
    assert found.reason is Reason.UNDECIDED
    assert found.verdicts[0].kind is Kind.ASSUMED
    assert "assumed, not seen" in found.verdicts[0].sentence
    (p,), (error,) = found.lights.positions, found.position_error
    assert (np.abs(p - lamp) < 4 * error).all()
    alone = lightloc.cramer_rao(q, found.lights).position[0]
    assert (np.abs(p - lamp) > 4 * alone).any()  # the control: without that they would not


class Ball:
    """A ball that occludes; nothing else does."""

    def __init__(self, centre: tuple[float, float, float], radius: float) -> None:
        self.centre, self.radius = centre, radius
        self.bounds = np.array([[0.0, 0, 0], SIZE])

    def visible(self, x, p, active=True):
        way, to = p - x, type(x)(*self.centre) - x
        off = to - dr.clip(dr.dot(to, way) / dr.squared_norm(way), 0, 1) * way
        return (dr.squared_norm(off) > self.radius**2) & active

    def intersect(self, x, d, active=True):
        return (d.x > 2) & active, x


BALL = Ball((1.5, 1.6, 0.8), 0.4)


def shadowed(rng: np.random.Generator) -> Observations:
    """A point in a room with the ball."""
    x, normals = walls(1000, rng)
    dark = observed(x, normals, np.ones(len(x)), 1.0, rng)
    B = radiance(dark, PointLights(LAMP[None], [20.0]), BALL)[:, 0]
    return observed(x, normals, B, 0.01, rng)


@pytest.mark.slow
def test_a_missing_occluder_is_told(rng):
    """The light is where it is, and alone; what is missing is the geometry's."""
    found = localize(shadowed(rng), bounds=INSIDE)
    assert found.reason is Reason.UNDECIDED
    assert found.verdicts[0].kind is Kind.GEOMETRY
    (p,), (error,) = found.lights.positions, found.position_error
    assert (np.abs(p - LAMP) < 5 * error).all()


@pytest.mark.slow
def test_an_occluder_that_is_there_is_none(rng):
    """The control."""
    found = localize(shadowed(rng), BALL, bounds=INSIDE)
    assert found.reason is Reason.CONVERGED
    assert Kind.GEOMETRY not in {v.kind for v in found.verdicts}
