"""What chance gains, in the room at hand; and what is alike among neighbours, which is no noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from lightloc import Lambert, Observations, Options
from lightloc.fit.pattern import correlation, neighbours
from lightloc.search.ground import Ground

N, DRAWN = 300, 400
BOX = np.array([[-2, -2, 0.1], [2, 2, 2]])


@pytest.fixture(scope="module")
def ground() -> Ground:
    x = np.random.default_rng(0).uniform(-2, 2, (N, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (N, 1))
    q = Observations(
        positions=x,
        normals=up,
        directions=up,
        radiance=np.ones(N),
        sigma=0.02,
        material=Lambert(albedo=0.5),
    )
    return Ground.of(q, None, BOX, Options(cells=1000), 0)


def gains(ground: Ground, z: np.ndarray) -> np.ndarray:
    """(m,) the largest gain of a light of no intensity yet, of each column of (n, m) residuals."""
    S = ground.dictionary.atoms[0].astype(float)
    lit = np.maximum(S @ z, 0)
    return (lit**2 / (S**2).sum(axis=1, keepdims=True)).max(axis=0)


@pytest.mark.parametrize(("asked", "near"), [(0.05, 0.03), (0.3, 0.1)])
def test_as_many_false_alarms_as_are_asked_for(asked, near, ground):
    """Of noise that the simulation has not seen; Gumbel's law through 200 draws is near enough."""
    z = np.random.default_rng(5).normal(size=(N, DRAWN))
    assert abs((gains(ground, z) > ground.chance.gain(asked)).mean() - asked) < near


def test_a_light_far_above_chance_is_no_chance(ground):
    """Negative control: one of five standard errors, in the mean over all points, gains more."""
    S = ground.dictionary.atoms[0].astype(float)
    z = np.random.default_rng(5).normal(size=(N, DRAWN)) + 5 * S[[500]].T / S[500].mean()
    assert (gains(ground, z) > ground.chance.gain(0.001)).all()


def grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) points on a square grid of a floor, and their (n, 3) normals."""
    x = np.stack([*np.divmod(np.arange(side**2), side), np.zeros(side**2)], axis=1)
    return x.astype(float), np.tile([0.0, 0.0, 1.0], (side**2, 1))


def test_a_film_makes_no_pattern_and_a_models_error_does():
    """Pixels that a filter has mixed share noise with those that touch, hardly with those beyond.

    The filter is Mitsuba's own, a Gaussian of half a pixel.
    """
    pairs = neighbours(*grid(60))
    noise = np.random.default_rng(0).normal(size=(60, 60))

    def alike(width: float) -> float:
        z = gaussian_filter(noise, width, mode="wrap")
        return correlation(z.reshape(-1, 1) / z.std(), pairs)

    assert alike(0.5) < 4
    assert alike(2.0) > 50


def test_the_pattern_of_noise_is_a_standard_deviation():
    """Over many draws it has mean 0 and deviation 1, of one channel as of three."""
    pairs, rng = neighbours(*grid(20)), np.random.default_rng(0)
    for channels in (1, 3):
        drawn = [correlation(rng.normal(size=(400, channels)), pairs) for _ in range(200)]
        assert abs(np.mean(drawn)) < 4 / np.sqrt(200)
        assert 0.8 < np.std(drawn) < 1.2


def test_what_faces_another_way_is_no_neighbour():
    x, up = grid(20)
    half = x[:, 0] < 10
    pairs = neighbours(x, np.where(half[:, None], up, -up))
    assert len(pairs) and (half[pairs[:, 0]] == half[pairs[:, 1]]).all()
