"""The law of the noise: estimated from what is left of a model, outliers apart."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc.fit.law import MOST_OUTLIERS, law_left, outside
from lightloc.search.chance import DRAWS

N = 2000
LAWS = {
    "exact": lambda M: 1e-9 * M,
    "relative": lambda M: 0.05 * M,
    "faint": lambda M: 5e-4 * M,
    "shot": lambda M: 0.05 * np.sqrt(M),
    "read": lambda M: 0.03 + 0 * M,
    "all": lambda M: np.sqrt(0.02**2 + 1e-3 * M + (0.02 * M) ** 2),
}


def drawn(law: str, share: float, seed: int = 0):
    """A model, its true errors, and what noise and outliers leave of it."""
    rng = np.random.default_rng(seed)
    M = np.exp(rng.normal(size=(N, 1)))
    sigma = LAWS[law](M)
    left = sigma * rng.normal(size=M.shape)
    wild = rng.permutation(N)[: round(share * N)]
    left[wild] = rng.uniform(-1, 3, (len(wild), 1))
    return M, sigma, left, wild


@pytest.mark.parametrize("share", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("law", [law for law in LAWS if law != "exact"])
def test_sigma_is_told_over_most_of_b(law, share):
    """Within 20 % over the central 90 % of B; a scale alone is known to 1 / sqrt(2 n) = 1.6 %."""
    M, sigma, left, _ = drawn(law, share)
    assert off(law_left(left, M).sigma(M) / sigma, M) < 0.2


def off(ratio, M) -> float:
    """How far a ratio is from 1 over the central 90 % of B."""
    low, high = np.quantile(M, [0.05, 0.95])
    return float(np.abs(ratio[(low < M) & (high > M)] - 1).max())


@pytest.mark.parametrize("share", [0.0, 0.01, 0.05, 0.1])
@pytest.mark.parametrize("law", LAWS)
def test_the_share_of_outliers_is_told(law, share):
    """To a factor of 1.5, and which they are where they are far off."""
    M, sigma, left, wild = drawn(law, share)
    found = law_left(left, M)
    if not share:
        assert found.share < 0.005
        return
    assert share / 1.5 < found.share < share * 1.5
    far = np.zeros((N, 1), bool)
    far[wild] = np.abs(left[wild]) > 10 * sigma[wild]
    noise = np.ones((N, 1), bool)
    noise[wild] = False
    told = found.is_noise(left, M)
    assert (told[far] < 0.5).all()
    assert (told[noise] > 0.5).mean() > 0.99


def test_nothing_falls_below_the_arithmetic():
    """Exact values have the errors of float32, and no less."""
    M, _, left, _ = drawn("exact", 0.0)
    assert (law_left(left, M).sigma(M) >= 1e-6 * M).all()
    assert (law_left(0 * left, M).sigma(M) < 2e-6 * M + 2e-7 * M.mean()).all()


@pytest.mark.parametrize("law", ["relative", "read"])
def test_what_is_dark_and_exact_tells_nothing(law):
    """Zeros in shadows, as a renderer leaves them, take nothing off the noise of what is lit."""
    M, sigma, left, _ = drawn(law, 0.0)
    dark = np.zeros((N, 1))
    with_dark = law_left(np.concatenate([left, dark]), np.concatenate([M, dark]))
    assert off(with_dark.sigma(M) / sigma, M) < 0.2


def test_errors_of_the_law_are_honest():
    """Of forty laws, the relative term lies about as far off as its standard error says."""
    found, off_by = [], []
    for seed in range(40):
        M, _, left, _ = drawn("relative", 0.0, seed)
        law = law_left(left, M)
        found.append(law.sigma(np.full((1, 1), 1.0))[0, 0] / 0.05 - 1)
        assert law.error[0, 2] < 0.3 * law.variance[0, 2] + 1e-4
        off_by.append((law.variance[0, 2] - 0.05**2) / law.error[0, 2])
    assert np.std(found) < 0.05
    assert 0.5 < np.std(off_by) < 1.2  # below 1: no term falls below 0, which tells something


def test_channels_have_laws_of_their_own():
    M, _, left, _ = drawn("relative", 0.0)
    law = law_left(np.hstack([left, 10 * left]), np.hstack([M, M]))
    one, ten = law.sigma(np.hstack([M, M])).T
    np.testing.assert_allclose(ten, 10 * one, rtol=1e-3)


def test_what_was_fitted_is_counted():
    """Residuals that p parameters were fitted to are smaller by sqrt(1 - p / n)."""
    M, sigma, left, _ = drawn("relative", 0.0)
    z = left / M
    basis, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(N, N // 2)))
    z = z - basis @ (basis.T @ z)
    assert off(law_left(z * M, M, N // 2).sigma(M) / sigma, M) < 0.2
    assert np.median(law_left(z * M, M).sigma(M) / sigma) < 0.8  # not without


def test_where_most_are_outliers_the_share_says_so():
    z = np.random.default_rng(0).normal(size=N)
    z[: N // 2] *= 100
    assert outside(z)[0] == MOST_OUTLIERS


def test_draws_are_enough():
    """Gumbel's quantile through so many draws is known to 4 % at one in a thousand."""
    rng = np.random.default_rng(0)
    tops = rng.gumbel(9, 2.2, size=(500, DRAWS))
    width = np.sqrt(6) / np.pi * tops.std(axis=1, ddof=1)
    quantile = tops.mean(axis=1) - np.euler_gamma * width - width * np.log(-np.log1p(-1e-3))
    assert quantile.std() / quantile.mean() < 0.05


def test_a_dark_channel_has_errors_too():
    """Where a channel is black its errors are the arithmetic's, beside those of the others."""
    M, _, left, _ = drawn("relative", 0.0)
    law = law_left(np.hstack([left, 0 * left]), np.hstack([M, 0 * M]))
    dark = law.sigma(np.zeros((1, 2)))[0, 1]
    assert 0 < dark < 1e-3 * M.mean()


@pytest.mark.parametrize("law", ["relative", "shot", "read"])
def test_a_law_of_one_term_is_told_with_one(law):
    """Others are there by chance in at most a few of forty; with all of the three terms none
    is left out."""
    one = [
        np.count_nonzero(law_left(*drawn(law, 0.02, seed)[2::-2]).variance) for seed in range(40)
    ]
    assert one.count(1) >= 36
    M, _, left, _ = drawn("all", 0.02)
    assert np.count_nonzero(law_left(left, M).variance) > 1
