"""Indirect light gathered by rays: the error that it states is what another seed changes."""

from __future__ import annotations

import numpy as np

import render
from lightloc.interreflection import footnote_1
from lightloc.interreflection.footnote_1 import GROUPS, indirect

POINTS = 600


def test_the_error_of_gathering_is_what_another_seed_changes(load):
    """Rays of two seeds differ, and by no more than the errors that both state.

    Each error is measured over groups that share the strata of the hemisphere among them: all
    rays together are spread more evenly, so that it is too large rather than too small. A root
    of a mean square over so many points is known to 1 / sqrt(2 n).
    """
    room = load("box_three")
    seen = render.observe(room, points=POINTS, spp=64, seed=2)
    (one, error), (other, too) = (indirect(seen, room.geometry, seed) for seed in (1, 2))
    changed = np.sqrt(np.square(one - other).mean())
    stated = np.sqrt((np.square(error) + np.square(too)).mean())
    assert 0 < changed < (1 + 4 / np.sqrt(2 * POINTS)) * stated
    again, _ = indirect(seen, room.geometry, 1)
    np.testing.assert_array_equal(again, one)


def test_the_error_of_gathering_is_that_of_a_mean_of_groups(load, monkeypatch):
    """Groups that scatter by 1 have a mean that scatters by 1 / sqrt(8), and the error says so.

    A mean of n variances of eight values each is known to sqrt(2 / (7 n)).
    """
    room = load("box_three")
    seen = render.observe(room, points=POINTS, spp=2, seed=2)
    rng = np.random.default_rng(6)

    def gathered(columns, channels, s, cache, geometry, first, count, seed):
        return 5 + rng.normal(size=(count * GROUPS, 1))

    monkeypatch.setattr(footnote_1, "_gather", gathered)
    mean, error = indirect(seen, room.geometry)
    known = 4 * np.sqrt(2 / (GROUPS - 1) / POINTS)
    assert abs(GROUPS * np.square(error).mean() - 1) < known
    assert abs(GROUPS * mean.var() - 1) < 4 * np.sqrt(2 / POINTS)
