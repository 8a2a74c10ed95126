"""Lights that are given: places at which only intensities are asked, and a guess to begin with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import render
from lightloc import (
    Kind,
    Lambert,
    Observations,
    Options,
    PointLights,
    Reason,
    localize,
    radiance,
    shading,
)


def floor(n: int, rng: np.random.Generator) -> Observations:
    """A dark floor."""
    x = rng.uniform(-2, 2, (n, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return Observations(
        positions=x, normals=up, directions=up, radiance=np.zeros(n), material=Lambert(albedo=0.5)
    )


def lit(lights: PointLights, sigma: float, rng: np.random.Generator) -> Observations:
    q = floor(400, rng)
    B = radiance(q, lights)
    return q.with_radiance(B + sigma * rng.normal(size=B.shape), sigma)


@pytest.fixture(scope="module")
def occluder(load: Callable[..., render.Room]) -> render.Room:
    return load("box_occluder")


REGION = [[-2, -2, 0.1], [2, 2, 2]]
LIGHTS = PointLights([[0.5, -0.3, 1.2], [-1.0, 0.8, 1.5]], [10.0, 6.0])


def test_errors_are_those_of_linear_least_squares(rng):
    """The covariance of intensities with known places is (S' S / sigma^2)^-1."""
    sigma = 0.01
    q = lit(LIGHTS, sigma, rng)
    found = localize(q, fixed=LIGHTS.positions, bounds=REGION)
    S = shading(q, LIGHTS.positions)[:, :, 0] / sigma
    assert np.allclose(found.covariance, np.linalg.inv(S.T @ S), rtol=1e-3)
    best = np.linalg.lstsq(S, q.radiance[:, 0] / sigma)[0]
    assert np.allclose(found.lights.intensities[:, 0], best, atol=0.5 * found.intensity_error.min())
    assert not found.position_error.any()
    assert found.reason is Reason.CONVERGED


def test_intensities_are_within_their_errors(rng):
    """Over rooms, the squares of errors in stated standard errors are 1 in the mean."""
    z = []
    for _ in range(40):
        found = localize(lit(LIGHTS, 0.02, rng), fixed=LIGHTS.positions, bounds=REGION)
        z.append((found.lights.intensities - LIGHTS.intensities) / found.intensity_error)
    assert abs(np.square(z).mean() - 1) < 4 * np.sqrt(2 / 80)


def test_a_lamp_that_is_off_is_dark(rng):
    """It stays in the answer, with an intensity near 0 and an error, and nothing is undecided."""
    places = np.vstack([LIGHTS.positions, [[1.5, 1.5, 1.0]]])
    found = localize(lit(LIGHTS, 0.01, rng), fixed=places, bounds=REGION)
    assert len(found.lights) == 3 and found.reason is Reason.CONVERGED
    assert [v.lights for v in found.verdicts if v.kind is Kind.UNLIT] == [(2,)]
    dark = found.lights.intensities[2, 0]
    assert 0 <= dark < 4 * found.intensity_error[2, 0] < 0.1
    assert np.array_equal(found.lights.positions[2], places[2])


def test_a_lamp_that_was_forgotten_is_missed(rng):
    """The model does not explain what is seen then: it says where a light is missing."""
    found = localize(lit(LIGHTS, 0.01, rng), fixed=LIGHTS.positions[:1], bounds=REGION)
    assert found.reason is Reason.MISFIT
    (said,) = (v.sentence for v in found.verdicts if v.kind is Kind.UNEXPLAINED)
    where = np.array(said.split("(")[1].split(")")[0].split(","), float)
    assert np.linalg.norm(where - LIGHTS.positions[1]) < 0.4
    off = np.abs(found.lights.intensities - 10.0) / found.intensity_error
    assert off.max() < 10  # errors as large as what is left


def test_what_no_further_light_explains_asks_for_none(rng):
    """Radiance that alternates from point to point: no place is told where a lamp would be."""
    q = lit(LIGHTS, 0.01, rng)
    wild = q.with_radiance(q.radiance * (1 + 0.5 * rng.choice([-1.0, 1.0], q.radiance.shape)), 0.01)
    found = localize(wild, fixed=LIGHTS.positions, bounds=REGION)
    assert found.reason is Reason.MISFIT
    (said,) = (v.sentence for v in found.verdicts if v.kind is Kind.UNEXPLAINED)
    assert "further light" not in said and "chi-square" in said


def test_a_faint_lamp_that_was_forgotten_is_missed_where_chi_square_says_nothing(rng):
    """It lights few observations, so that chi-square is near 1; the certificate finds it."""
    faint = PointLights([*LIGHTS.positions.tolist(), [1.9, -1.9, 0.2]], [10.0, 6.0, 0.02])
    found = localize(lit(faint, 0.01, rng), fixed=LIGHTS.positions, bounds=REGION)
    assert found.chi2 < 1.2
    assert found.reason is Reason.MISFIT
    assert found.verdicts[0].sentence.startswith("A further light would explain more, best at (1.")


@pytest.mark.parametrize("noise", [0.01, None])
def test_behind_occluders_with_all_light_and_unknown_noise(occluder, noise):
    """Gathered, from a room that Mitsuba renders: as with free places, and surer."""
    q = render.observe(occluder, points=1500, spp=256, seed=2, noise=0.01)
    if noise is None:
        q = q.with_radiance(q.radiance, None)
    truth = occluder.lights
    found = localize(q, occluder.geometry, fixed=truth.positions)
    z = (found.lights.intensities - truth.intensities) / found.intensity_error
    assert np.abs(z).max() < 4
    free = localize(q, occluder.geometry)
    assert (found.intensity_error < free.intensity_error).all()


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2], [2, 1, 0], [1, 2, 0]])
def test_among_metal_walls_where_indirect_light_is_rendered(load, order):
    """Whichever lamp is named first, each keeps what was rendered for it."""
    room = load("box_conductor", alpha=0.3)
    q = render.observe(room, points=600, spp=256, seed=2, noise=0.01)
    truth = room.lights.brightest_first()
    found = localize(q, room.geometry, fixed=room.lights.positions[order], indirect=128)
    assert np.array_equal(found.lights.positions, truth.positions)
    z = (found.lights.intensities - truth.intensities) / found.intensity_error
    assert np.abs(z).max() < 4 and found.reason is Reason.CONVERGED
    assert found.way.name == "RENDERED" and not found.position_error.any()


def test_a_lamp_that_is_off_is_dark_among_metal_walls_too(load):
    """Named first, it takes nothing of the others' interreflected light."""
    room = load("box_conductor", alpha=0.3)
    q = render.observe(room, points=600, spp=256, seed=2, noise=0.01)
    places = np.vstack([[[3.0, 2.0, 2.0]], room.lights.positions])
    found = localize(q, room.geometry, fixed=places, indirect=64)
    off = np.flatnonzero((found.lights.positions == places[0]).all(axis=1))
    assert found.lights.intensities[off, 0] < 4 * found.intensity_error[off, 0] < 4.0


@pytest.mark.parametrize("noise", ["given", "scaled", "estimate"])
def test_as_many_lamps_as_observations_are_too_many(rng, noise):
    """Two values leave nothing that tells their noise."""
    few = lit(LIGHTS, 0.01, rng).at([0, 1])
    found = localize(few, fixed=LIGHTS.positions, options=Options(noise=noise), bounds=REGION)
    assert found.reason not in (Reason.CONVERGED, Reason.EXTENDED)
    assert any(v.kind is Kind.TOO_FEW for v in found.verdicts)


def test_a_lamp_far_above_an_open_floor_needs_no_wider_bounds(rng):
    """Its place is known: no border says anything of it."""
    high = PointLights([[0.0, 0.0, 30.0], [0.5, 0.5, 1.0]], [2000.0, 5.0])
    found = localize(lit(high, 0.01, rng), fixed=high.positions)
    z = (found.lights.intensities - high.intensities) / found.intensity_error
    assert np.abs(z).max() < 4 and found.reason is Reason.CONVERGED


def test_in_two_dimensions_and_in_colour(rng):
    x = np.linspace(0, 1, 80)
    wall = np.stack([x, 0 * x, 0 * x], axis=1)
    up = np.tile([0.0, 1.0, 0.0], (80, 1))
    q = Observations(
        positions=wall,
        normals=up,
        directions=up,
        radiance=np.zeros((80, 3)),
        material=Lambert(albedo=[0.2, 0.5, 0.8]),
    )
    lights = PointLights([[0.3, 0.4, 0.0]], [[1.0, 2.0, 3.0]])
    found = localize(q.with_radiance(radiance(q, lights), 1e-4), fixed=lights.positions)
    assert np.allclose(found.lights.intensities, lights.intensities, rtol=1e-3)


def test_a_start_is_refined(occluder):
    """From about where the lights are to where the search finds them."""
    q = render.observe(occluder, points=800, seed=3, transport="direct", noise=0.01)
    near = PointLights(occluder.lights.positions + 0.05, occluder.lights.intensities * 1.2)
    found, free = (localize(q, occluder.geometry, start=begun) for begun in (near, None))
    assert found.reason is free.reason is Reason.CONVERGED
    assert np.abs(found.lights.positions - free.lights.positions).max() < free.position_error.max()
    assert found.history[0].action == "start"
    assert not any(step.action == "add" for step in found.history)


def test_a_start_that_is_wrong_is_searched_on_from(occluder):
    """One light in the middle of the room, where there are three elsewhere."""
    q = render.observe(occluder, points=800, seed=3, transport="direct", noise=0.01)
    wrong = PointLights(occluder.bounds.mean(axis=0, keepdims=True), [30.0])
    found = localize(q, occluder.geometry, start=wrong)
    assert len(found.lights) == 3 and found.reason is Reason.CONVERGED
    assert [step.action for step in found.history[:2]] == ["start", "add"]


def test_an_earlier_answer_with_an_unseen_channel_is_a_start(rng):
    """Its intensities are unknown there, and begin dark."""
    unseen = PointLights(LIGHTS.positions, [[10.0], [np.nan]])
    found = localize(lit(LIGHTS, 0.01, rng), start=unseen, bounds=REGION)
    assert len(found.lights) == 2 and np.isfinite(found.lights.intensities).all()


def test_what_cannot_be_meant_is_refused(rng, refuses):
    q = lit(LIGHTS, 0.01, rng)
    colours = PointLights([[0.0, 0, 1]], [[1.0, 2.0, 3.0]])
    with refuses("start and fixed are given"):
        localize(q, start=LIGHTS, fixed=LIGHTS.positions)
    with refuses("start has 3 channels, the observations have 1"):
        localize(q, start=colours)
    with refuses("fixed[0][2] is nan"):
        localize(q, fixed=[[0.0, 0.0, np.nan]])
    with refuses("fixed has"):
        localize(q, fixed=[0.0, 0.0, 1.0])
    with refuses("fixed has no positions"):
        localize(q, fixed=np.zeros((0, 3)))
    with refuses("fixed and free=('albedo',) are given"):
        localize(q, fixed=LIGHTS.positions, options=Options(free=("albedo",)))
    with refuses("observations are a list"):
        localize([1.0, 2.0], start=LIGHTS)
    with refuses("start is a list"):
        localize(q, start=[[0.0, 0.0, 1.0]])
    with refuses("start is in cm, the observations are in m"):
        localize(replace(q, unit="m"), start=replace(LIGHTS, unit="cm"))
    for given in ({"start": LIGHTS}, {"fixed": LIGHTS.positions}, {"seconds": 3.0}):
        with refuses("method 'paper' takes neither"):
            localize(q, method="paper", **given)
    with refuses("start has 2 lights; most_lights is 1"):
        localize(q, start=LIGHTS, options=Options(most_lights=1))
