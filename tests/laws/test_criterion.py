"""The criterion: what noise leaves is enough, a few wild values do not matter, many do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Lambert, Observations, Options, PointLights
from lightloc.fit.criterion import ESTIMATED, FEW, LUCK, Criterion, Likelihood
from lightloc.fit.loss import robust
from lightloc.fit.problem import Fit, Problem

N = 4000
WILD = 50.0  # standard errors
CRITERION = Criterion.of(Options())


@pytest.fixture(scope="module")
def problem() -> Problem:
    up = np.tile([0.0, 0.0, 1.0], (N, 1))
    x = np.random.default_rng(0).uniform(0, 1, (N, 3))
    B = np.full(N, 2 * WILD)  # lit everywhere, so that no wild value outshines the rest
    q = Observations(
        positions=x, normals=up, directions=up, radiance=B, material=Lambert(albedo=0.5)
    )
    return Problem.of(q, np.ones((N, 1)), None, q.bounds)


def fit(z: np.ndarray, lights: int = 1) -> Fit:
    z = z.reshape(-1, 1)
    places = PointLights(np.zeros((lights, 3)), np.ones(lights))
    return Fit(places, z, robust(z, CRITERION.likelihood.scale))


def noise(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=N)


def test_noise_is_explained(problem):
    assert CRITERION.is_explained(problem, fit(noise()))
    assert CRITERION.is_likely(problem, fit(noise()))


@pytest.mark.parametrize(("share", "explained"), [(0.5 * FEW, True), (2.5 * FEW, False)])
def test_few_wild_values_do_not_matter_many_do(share, explained, problem):
    z = noise()
    z[: round(share * N)] = WILD
    assert CRITERION.is_explained(problem, fit(z)) is explained


def test_what_alone_is_lit_is_not_among_the_few(problem):
    """Where the lights make everything dark, a few that are bright are what was to be explained."""
    z = noise()
    z[: round(0.5 * FEW * N)] = WILD
    dark = replace(problem, radiance=z.reshape(-1, 1))
    assert CRITERION.is_outshone(dark, fit(z))
    assert not CRITERION.is_explained(dark, fit(z))
    assert not CRITERION.is_outshone(problem, fit(z))


def test_what_is_systematic_does_not_hide_among_the_few(problem):
    """A misfit below the loss's scale is never left out: 20 % more noise than there should be."""
    assert not CRITERION.is_explained(problem, fit(1.2 * noise()))


def test_estimated_errors_are_allowed_more(problem):
    z = np.sqrt(ESTIMATED) * noise()
    assert not CRITERION.is_explained(problem, fit(z))
    assert CRITERION.after_removal().is_explained(problem, fit(z))


def test_a_light_must_gain_its_price_on_more_than_a_handful(problem):
    """Four parameters cost 20; a gain on five observations alone is an outlier's, not a light's."""
    z, spread, handful = noise(), noise(), noise()
    spread[:400] += 0.5 * np.sign(spread[:400])
    handful[:4] = 4.9
    assert CRITERION.is_worth(problem, fit(spread), fit(noise(), 2), 1.0)
    assert not CRITERION.is_worth(problem, fit(handful), fit(z, 2), 1.0)


@pytest.mark.parametrize("share", [0.5 * FEW, 1.5 * FEW])
def test_the_few_have_no_say_about_a_further_light(share):
    """The largest of the wild values count nothing, however many there are; no others are lost."""
    z = noise()
    wild = round(share * N)
    z[:wild] = WILD * (1 + np.arange(wild))
    trust = CRITERION.likelihood.trust(z.reshape(-1, 1)).ravel()
    gone = min(wild, round(FEW * N))
    assert (trust[wild - gone : wild] == 0).all()
    assert (trust[: wild - gone] > 0).all()
    assert (trust[wild:] > 0.5).all()


def test_a_likelihood_is_a_value(problem):
    """Another likelihood, with no room for wild values, decides otherwise."""
    strict = Criterion(Likelihood(few=0.0), CRITERION.significant, CRITERION.unlikely)
    z = noise()
    z[: round(0.5 * FEW * N)] = WILD
    assert CRITERION.is_explained(problem, fit(z))
    assert not strict.is_explained(problem, fit(z))


@pytest.mark.parametrize("channels", [1, 3])
def test_a_light_has_a_price_for_each_of_its_unknowns(channels, problem):
    """Three coordinates and an intensity a channel; in the plane one coordinate less."""
    colours = np.ones((N, channels))
    flat = np.array([[0.0, 0, 0], [1, 1, 0]])
    for bounds, axes in ((problem.bounds, 3), (flat, 2)):
        posed = Problem(problem.surfels, colours, colours, None, bounds)
        assert CRITERION.price(posed) == CRITERION.significant * (axes + channels)


def test_what_noise_explains_ends_at_deviations_of_chi_square(problem):
    """Chi-square of n residuals has mean n and deviation sqrt(2 n); so many of these are noise."""
    deviation, black = np.sqrt(2 * N), PointLights([[0.0, 0, 0]], [0.0])
    for ask, most in (
        (CRITERION.is_explained, CRITERION.unlikely),
        (CRITERION.is_clean, CRITERION.unlikely),
        (CRITERION.is_likely, LUCK),
    ):
        for step, said in ((-0.1, True), (0.1, False)):
            cost = N + (most + step) * deviation
            z = np.full((N, 1), np.sqrt(cost / N))  # none is wild, so that none is left out
            assert ask(problem, Fit(black, z, cost)) is said
