"""The search finds every light: many, close, behind occluders, in colour, among outliers."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Kind, Lambert, Observations, PointLights, Reason, localize, radiance
from lightloc.answer.verdicts import WRONG
from lightloc.fit.information import jacobian
from lightloc.fit.problem import Problem
from validation.judge import is_solved
from validation.judge.match import compare
from validation.rooms.plane import rooms, rooms_with_discs
from validation.studies import columns
from validation.studies.wrong_models import MODELS


def solved(found: PointLights, true: PointLights, position: float, percent: float) -> bool:
    verdict = compare(found, true, diagonal=1.0, radius=position)
    near = not verdict.missed and not verdict.ghosts
    return near and (verdict.worst_intensity_percent or 0) <= percent


@pytest.mark.parametrize("lights", [2, 3, 4, 5])
def test_exact_rooms(lights):
    """Section 6.1 without noise: within 0.1 % of the side, and the answer says that it is sure."""
    for room in rooms(lights, count=4):
        found = localize(room.observe())
        assert solved(found.lights, room.lights, 0.001, 1.0), room.name
        assert found.reason is Reason.CONVERGED


@pytest.mark.parametrize("lights", [8, 10])
def test_many_lights(lights):
    """Eight and ten lights from 400 samples."""
    for room in rooms(lights, count=2):
        found = localize(room.observe())
        assert solved(found.lights, room.lights, 0.01, 5.0), room.name
        assert found.reason is Reason.CONVERGED


@pytest.mark.parametrize("lights", [2, 3, 4, 5])
def test_noisy_rooms_as_the_oracle(lights):
    """Under noise, whatever Levenberg-Marquardt from the truth solves is solved; and the MSE is
    low (Table 1's Full)."""
    oracle, ours = set(), set()
    for number in range(4):
        room, q = columns.observed(f"noisy-{lights}-{number:03}")
        found = localize(q)
        assert columns.error(q, found.lights) < 1.05 * columns.error(q, room.lights), room.name
        if is_solved(columns.from_the_truth(q, room.lights), room.lights, columns.SOLVED):
            oracle.add(room.name)
        if is_solved(found.lights, room.lights, columns.SOLVED):
            ours.add(room.name)
    assert oracle and oracle <= ours


@pytest.mark.parametrize(("discs", "lights"), [(2, 5), (4, 3), (8, 4)])
def test_occluders(discs, lights):
    """Noise of 1 %, discs in the way: through the edges of shadows."""
    for number, room in enumerate(rooms_with_discs(discs, lights, count=3)):
        q = with_noise(room.observe(), 0.01, number)
        found = localize(q, room.geometry)
        assert solved(found.lights, room.lights, 0.02, 10.0), room.name
        without = localize(q)  # negative control: without the discs the model explains nothing
        assert without.reason is not Reason.CONVERGED, room.name


def with_noise(q: Observations, k: float, seed: int) -> Observations:
    mean = q.radiance.mean()
    jitter = np.random.default_rng(seed).normal(size=q.radiance.shape)
    B = np.maximum(q.radiance + k * np.sqrt(q.radiance * mean) * jitter, 0)
    return q.with_radiance(B, k * np.sqrt(np.maximum(B, 0.01 * mean) * mean))


def test_outliers_are_not_lights():
    """One observation in twenty is wrong: the right lights, no ghosts, and the answer says it."""
    for room in rooms(3, count=3):
        q = room.observe(400, noise=0.01)
        rng = np.random.default_rng(3)
        B, some = q.radiance.copy(), rng.permutation(400)[:20]
        B[some] *= rng.uniform(0.1, 3.0, (20, 1))
        found = localize(q.with_radiance(B, q.sigma))
        assert solved(found.lights, room.lights, 0.02, 5.0), room.name
        assert found.outliers >= 10
        assert 0.02 < found.noise.share < 0.1
        assert found.reason is Reason.CONVERGED


def test_colours():
    """Three channels: positions shared, intensities each its own."""
    room = rooms(3, count=1)[0]
    dark = room.observe()
    colours = np.array([[3.0, 2.0, 1.0], [1.0, 1.5, 4.0], [2.0, 4.0, 2.0]])
    lights = PointLights(room.lights.positions, colours)
    q = Observations(
        positions=dark.positions,
        normals=dark.normals,
        directions=dark.directions,
        radiance=np.zeros((400, 3)),
        material=dark.material,
    )
    found = localize(q.with_radiance(radiance(q, lights), 0.0))
    assert solved(found.lights, lights, 0.001, 1.0)


def test_same_answer_twice():
    """No chance is left: bit for bit."""
    q = rooms(4, count=1)[0].observe(400, noise=0.05)
    a, b = localize(q), localize(q)
    np.testing.assert_array_equal(a.lights.positions, b.lights.positions)
    np.testing.assert_array_equal(a.lights.intensities, b.lights.intensities)


@pytest.mark.parametrize("model", ["albedo_by_wall", "normals_by_wall", "outliers"])
def test_wrong_models_make_no_ghosts(model):
    """Ten percent off in albedo, five degrees in normals: noticed, and no light is invented.

    The first verdict is of the model, and it is never said to explain; but that a few observations
    are wrong is no fault of it.
    """
    for number in range(3):
        rng = np.random.default_rng([2018, number, list(MODELS).index(model)])
        q, lights = MODELS[model](number, rng)
        found = localize(q)
        assert len(found.lights) == len(lights), number
        if model == "outliers":
            assert found.reason is Reason.CONVERGED
        else:
            assert found.reason in (Reason.NO_GAIN, Reason.UNDECIDED)
            assert found.verdicts[0].kind in WRONG | {Kind.UNEXPLAINED}


@pytest.mark.parametrize(("gain", "lights"), [(80.0, 3), (8.0, 2)])
def test_a_light_that_only_all_observations_show(gain, lights):
    """Its gain in chi-square is ``gain`` over all observations, a fifth of that in the sample.

    A light must gain 20: one of 80 shows in all of them alone, one of 8 nowhere (the control).
    """
    rng, n = np.random.default_rng(2), 5120
    x, axis = rng.uniform(-2, 2, (n, 3)), rng.integers(0, 3, n)
    sign, normals = rng.choice([-1.0, 1.0], n), np.zeros((n, 3))
    x[np.arange(n), axis], normals[np.arange(n), axis] = 2 * sign, -sign
    q = Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros(n),
        material=Lambert(albedo=0.5),
    )
    bright = PointLights([[0.4, -0.3, 0.9], [-1.0, 0.9, 0.2]], [5.0, 3.0])
    B = radiance(q, bright)
    sigma = 0.05 * B
    faint = radiance(q, PointLights([[0.5, -1.2, -1.0]], [1.0]))
    beside, z = jacobian(Problem.of(q, sigma, None, q.bounds), bright)[0], (faint / sigma)[:, 0]
    z = z - beside @ np.linalg.lstsq(beside, z)[0]  # what no other light takes up
    B = B + faint * np.sqrt(gain / np.square(z).sum()) + sigma * rng.normal(size=B.shape)
    found = localize(q.with_radiance(B, sigma))
    assert len(found.lights) == lights
