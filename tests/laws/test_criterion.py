"""The criterion: what noise leaves is enough, a few wild values do not matter, many do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Lambert, Observations, Options, PointLights
from lightloc.fit.criterion import ESTIMATED, FEW, LUCK, Criterion, Likelihood
from lightloc.fit.errors import SHARP, Errors, rounded
from lightloc.fit.law import MOST_OUTLIERS
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


@pytest.fixture(scope="module")
def fit(problem):
    def of(z: np.ndarray, lights: int = 1) -> Fit:
        z = z.reshape(-1, 1)
        places = PointLights(np.zeros((lights, 3)), np.ones(lights))
        return Fit(places, z, robust(z, CRITERION.likelihood.scale), problem)

    return of


def noise(seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=N)


def test_noise_is_explained(problem, fit):
    assert CRITERION.is_explained(problem, fit(noise()))
    assert CRITERION.is_likely(problem, fit(noise()))


@pytest.mark.parametrize(
    ("share", "explained"), [(0.5 * FEW, True), (0.75 * MOST_OUTLIERS, True), (0.25, False)]
)
def test_wild_values_here_and_there_do_not_matter_very_many_do(share, explained, problem, fit):
    z = noise()
    z[: round(share * N)] = WILD
    assert CRITERION.is_explained(problem, fit(z)) is explained


@pytest.mark.parametrize(("share", "likely"), [(0.9 * FEW, True), (1.5 * FEW, False)])
def test_few_wild_values_let_a_search_end(share, likely, problem, fit):
    z = noise()
    z[: round(share * N)] = WILD
    assert CRITERION.is_likely(problem, fit(z)) is likely


@pytest.mark.parametrize(("share", "explained"), [(0.5 * FEW, True), (2.5 * FEW, False)])
def test_wild_values_side_by_side_must_be_few(share, explained, problem, fit):
    z = noise()
    z[np.argsort(where(problem)[:, 0])[: round(share * N)]] = WILD
    assert CRITERION.is_explained(problem, fit(z)) is explained


@pytest.mark.parametrize(("size", "explained"), [(0.02, True), (0.3, False)])
def test_a_pattern_is_no_noise_however_small(size, explained, problem, fit):
    """Chi-square is 1 all the same: what neighbours have in common can't be noise."""
    x = where(problem)
    z = noise() * np.sqrt(1 - size**2) + size * np.sqrt(2) * np.sin(9 * x[:, 0] + 4 * x[:, 1])
    assert CRITERION.is_clean(problem, fit(z))
    assert CRITERION.is_explained(problem, fit(z)) is explained
    assert replace(CRITERION, shared=0.1).is_explained(problem, fit(z))


def where(problem) -> np.ndarray:
    return np.array([np.array(x) for x in problem.surfels.x]).T


def test_what_alone_is_lit_is_not_among_the_few(problem, fit):
    """Where the lights make everything dark, a few that are bright are what was to be explained."""
    z = noise()
    z[: round(0.5 * FEW * N)] = WILD
    dark = replace(problem, radiance=z.reshape(-1, 1))
    assert CRITERION.is_outshone(dark, fit(z))
    assert not CRITERION.is_explained(dark, fit(z))
    assert not CRITERION.is_outshone(problem, fit(z))


def test_what_is_systematic_does_not_hide_among_the_few(problem, fit):
    """A misfit below the loss's scale is never left out: 20 % more noise than there should be."""
    assert not CRITERION.is_explained(problem, fit(1.2 * noise()))


def test_estimated_errors_are_allowed_more(problem, fit):
    z = np.sqrt(ESTIMATED) * noise()
    assert not CRITERION.is_explained(problem, fit(z))
    assert CRITERION.after_removal().is_explained(problem, fit(z))


def test_a_light_must_gain_its_price_on_more_than_a_handful(problem, fit):
    """Four parameters cost 20; a gain on five observations alone is an outlier's, not a light's."""
    z, spread, handful = noise(), noise(), noise()
    spread[:400] += 0.5 * np.sign(spread[:400])
    handful[:4] = 4.9
    errors = Errors(1.0, CRITERION.likelihood.scale)
    assert CRITERION.is_worth(problem, fit(spread), fit(noise(), 2), errors)
    assert not CRITERION.is_worth(problem, fit(handful), fit(z, 2), errors)


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


def test_a_likelihood_is_a_value(problem, fit):
    """Another likelihood, with no room for wild values, decides otherwise."""
    strict = replace(CRITERION, likelihood=Likelihood(few=0.0))
    z = noise()
    z[np.argsort(where(problem)[:, 0])[: round(0.5 * FEW * N)]] = WILD
    assert CRITERION.is_explained(problem, fit(z))
    assert not strict.is_explained(problem, fit(z))


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
            # none is wild, so that none is left out
            z = np.sqrt(cost / N) * np.sign(noise())[:, None]
            assert ask(problem, Fit(black, z, cost, problem)) is said


@pytest.mark.parametrize("step", [0.3, 1.0, 2.5, np.sqrt(12)])
def test_the_density_of_what_is_rounded(step):
    """The share of a hundred thousand draws that are read as each value, to five of its errors."""
    rng, n = np.random.default_rng(0), 100_000
    rest = np.sqrt(max(1 - step**2 / 12, (SHARP * step) ** 2))
    true = 0.3 * step
    read = np.round((true + rest * rng.normal(size=n)) / step)
    values = np.arange(-30, 31)
    z = step * values - true
    predicted = step / np.sqrt(2 * np.pi) * np.exp(-rounded(z, np.full(len(z), step)))
    counted = np.array([(read == value).mean() for value in values])
    assert (np.abs(counted - predicted) < 5 * np.sqrt(predicted / n) + 1e-6).all()
    assert predicted.sum() == pytest.approx(1, abs=1e-3)


def test_rounding_is_no_pattern_and_what_is_beyond_it_is(problem, fit):
    """Neighbours share what rounding leaves of them: a slope in steps of 3 standard errors."""
    x = np.linspace(0, 1, 40)
    on = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    up = np.tile([0.0, 0.0, 1.0], (len(on), 1))
    q = Observations(
        positions=np.column_stack([on, 0 * on[:, 0]]),
        normals=up,
        directions=up,
        radiance=np.full(len(on), 2 * WILD),
        material=Lambert(albedo=0.5),
    )
    step = 3.0
    slope = 5 * on[:, :1]
    z = step * np.round(slope / step) - slope
    plain = Problem.of(q, np.ones((len(on), 1)), None, q.bounds)
    known = replace(plain, step=step)

    def judged(z: np.ndarray, problem: Problem) -> bool:
        one = Fit(PointLights(np.zeros((1, 3)), [1.0]), z, robust(z, 5.0), problem)
        return CRITERION.is_explained(problem, one)

    assert judged(z, known)
    assert not judged(z, plain)
    assert not judged(z + 1.5 * np.sin(6 * on[:, :1]), known)
