"""The judge matches lights by least total distance, and then counts and measures."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from lightloc import PointLights
from validation import compare

NONE = PointLights([], np.zeros((0, 1)))
THREE = PointLights([[0, 0, 2], [3, 0, 2], [0, 3, 1]], [10.0, 20.0, 5.0])


def pairs(result) -> set[tuple[int, int]]:
    return {(pair.true, pair.found) for pair in result.pairs}


def row(*x: float) -> PointLights:
    """Lights of 1 W/sr on the x axis."""
    return PointLights([[value, 0, 0] for value in x], np.ones(len(x)))


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_order_does_not_matter(order):
    """Lights in any order are each matched with themselves, without error."""
    found = PointLights(THREE.positions[list(order)], THREE.intensities[list(order)])
    result = compare(found, THREE, diagonal=5.0)
    assert pairs(result) == {(true, j) for j, true in enumerate(order)}
    assert result.worst_position_percent == result.worst_intensity_percent == 0
    assert (result.precision, result.recall, result.count_right) == (1, 1, True)


def test_errors_are_percentages_of_diagonal_and_intensity():
    """A shift of 3-4-0 cm in a room of 10 m is 0.5 %; 12 instead of 10 W/sr is 20 %."""
    true = PointLights([[1, 1, 1]], [10.0])
    for factor in (1.2, 0.8):
        result = compare(PointLights([[1.03, 1.04, 1]], [10 * factor]), true, diagonal=10.0)
        assert result.pairs[0].distance == pytest.approx(0.05)
        assert result.worst_position_percent == pytest.approx(0.5)
        assert result.worst_intensity_percent == pytest.approx(20)


def test_radius_is_the_limit():
    """At the radius a light still matches; beyond it one is missed and the other a ghost."""
    near, far = row(0.5), row(0.5001)
    assert pairs(compare(near, row(0), diagonal=10.0)) == {(0, 0)}
    for result in (
        compare(far, row(0), diagonal=10.0),
        compare(near, row(0), diagonal=10.0, radius=0.4),
    ):
        assert (result.pairs, result.missed, result.ghosts) == ((), (0,), (0,))
        assert (result.precision, result.recall) == (0, 0)
        assert result.worst_position_percent is result.worst_intensity_percent is None
        assert result.count_right  # and yet it must fail: the count alone is not enough


def test_ghosts_and_missed_are_named():
    """Two of three lights and a ghost: precision 2/3, recall 2/3, and which is which."""
    found = PointLights([[3, 0, 2], [9, 9, 9], [0, 0, 2]], [20.0, 1.0, 10.0])
    result = compare(found, THREE, diagonal=5.0)
    assert pairs(result) == {(0, 2), (1, 0)}
    assert (result.missed, result.ghosts) == ((2,), (1,))
    assert result.precision == result.recall == pytest.approx(2 / 3)
    assert "light 3 was missed" in str(result)
    assert "found light 2 is no true light" in str(result)


def test_two_found_lights_share_no_true_one():
    """A light found twice is one match and one ghost, the farther one."""
    result = compare(row(0.1, 0.05), row(0), diagonal=10.0)
    assert (pairs(result), result.ghosts, result.precision) == ({(0, 1)}, (0,), 0.5)
    assert result.recall == 1


def test_nothing_found_or_nothing_true():
    """Empty sets are judged too: nothing found misses all, nothing true makes all ghosts."""
    result = compare(NONE, THREE, diagonal=5.0)
    assert (result.missed, result.recall, result.precision) == ((0, 1, 2), 0, 1)
    result = compare(THREE, NONE)
    assert (result.ghosts, result.recall, result.precision) == ((0, 1, 2), 1, 0)
    result = compare(NONE, NONE)
    assert result.count_right
    assert not result.pairs + result.missed + result.ghosts
    assert (result.recall, result.precision) == (1, 1)


def test_grey_and_colour_are_compared_channel_by_channel():
    """A grey light against a coloured one has an error per channel, and the worst counts."""
    grey = PointLights([[0, 0, 0]], [2.0])
    colour = PointLights([[0, 0, 0]], [[2.0, 1.0, 4.0]])
    errors = compare(grey, colour, diagonal=1.0).pairs[0].intensity_percent
    assert errors == pytest.approx((0, 100, 50))
    errors = compare(colour, grey, diagonal=1.0).pairs[0].intensity_percent
    assert errors == pytest.approx((0, 50, 100))


def test_dark_channel_counts_in_units_of_the_brightest():
    """A true channel of zero divides nothing by zero: its error is a share of the brightest."""
    true = PointLights([[0, 0, 0]], [[4.0, 0.0, 0.0]])
    found = PointLights([[0, 0, 0]], [[4.0, 1.0, 0.0]])
    assert compare(found, true, diagonal=1.0).worst_intensity_percent == pytest.approx(25)
    dark = PointLights([[0, 0, 0]], [0.0])
    assert compare(dark, dark, diagonal=1.0).worst_intensity_percent == 0


def test_matching_is_optimal_and_not_greedy():
    """The nearest pair first (true 2 with found 1) would leave the other two 2.9 m apart."""
    result = compare(row(1.0, 2.9), row(0.0, 1.2), diagonal=10.0, radius=5.0)
    assert pairs(result) == {(0, 0), (1, 1)}
    greedy = 0.2 + 2.9
    assert sum(pair.distance for pair in result.pairs) == pytest.approx(2.7)
    assert greedy > 2.7


def test_more_pairs_win_over_shorter_ones():
    """Two pairs near the radius are better than one perfect pair and a light left over."""
    result = compare(row(0.0, 0.9), row(0.9, 1.8), diagonal=10.0, radius=1.0)
    assert pairs(result) == {(0, 0), (1, 1)}


def best_by_hand(distance: np.ndarray, radius: float) -> tuple[int, float]:
    """(number of pairs, total distance) of the best matching, by trying every one."""
    if distance.shape[0] > distance.shape[1]:
        distance = distance.T
    best = (0, 0.0)
    for columns in itertools.permutations(range(distance.shape[1]), distance.shape[0]):
        chosen = distance[range(distance.shape[0]), columns]
        chosen = chosen[chosen <= radius]
        best = min(best, (-len(chosen), float(chosen.sum())))
    return -best[0], best[1]


def test_brute_force_agrees(rng):
    """In 300 random sets no matching has more pairs, nor as many of less total distance."""
    for _ in range(300):
        n, m = rng.integers(1, 6, 2)
        true = PointLights(rng.random((n, 3)), rng.random(n))
        found = PointLights(rng.random((m, 3)), rng.random(m))
        radius = rng.uniform(0.2, 0.8)
        result = compare(found, true, diagonal=1.0, radius=radius)
        distance = np.linalg.norm(true.positions[:, None] - found.positions, axis=2)
        count, total = best_by_hand(distance, radius)
        assert len(result.pairs) == count
        assert sum(pair.distance for pair in result.pairs) == pytest.approx(total)
        for pair in result.pairs:
            assert pair.distance == pytest.approx(distance[pair.true, pair.found])
        assert len(result.pairs) + len(result.missed) == n
        assert len(result.pairs) + len(result.ghosts) == m
