"""Standard errors of rendered values, borrowed from points that are alike, never from oneself.

Rationale: a path tracer's noise is skewed, so that a mean is low where its own error is; a fit
weighted by that believes what is low. Expected: the mean over the others of the same kind.
"""

from __future__ import annotations

import numpy as np
import pytest

import render
from render.transport import POOL, _pooled, _shared, probe


@pytest.mark.parametrize(
    ("errors", "kinds", "expected"),
    [
        ([3.0], [0], [3.0]),
        ([3.0, 4.0], [0, 0], [4.0, 3.0]),
        ([3.0, 4.0, 5.0], [0, 0, 0], [20.5**0.5, 17**0.5, 12.5**0.5]),
        ([3.0, 4.0, 5.0], [0, 1, 0], [5.0, 4.0, 3.0]),
    ],
)
def test_few(errors, kinds, expected):
    x = np.arange(3.0 * len(errors)).reshape(-1, 3)
    got = _shared(np.array(errors)[:, None], np.array(kinds), x)
    np.testing.assert_allclose(got[:, 0], expected)


def test_diffuse_surfaces_are_of_one_kind(load):
    """A point that is alone on its paint borrows from others, in proportion to its albedo."""
    room = load("box_two")
    q = render.observe(room, points=200, transport="direct", seed=0)
    paint = q.regions
    some = q.at(np.r_[np.flatnonzero(paint == 0)[:1], np.flatnonzero(paint == 1)[:9]])
    si = probe(room.scene, some.positions, some.directions)
    albedo = np.asarray(some.material.albedo)[:, :1]
    error = np.r_[5.0, np.ones(9)][:, None] * albedo
    got = _pooled(np.repeat(error, 3, axis=1), si, room.diagonal)
    assert got[0, 0] == pytest.approx(albedo[0, 0], rel=1e-5)  # as the others', not its own 5


@pytest.mark.parametrize("apart", [1.0, 0.0], ids=["apart", "at one place"])
def test_many(apart, rng):
    """One large error is in those of its neighbours, and not in its own; nowhere far away."""
    x = apart * rng.random((400, 3))
    error = np.ones((400, 1))
    before = _shared(error, np.zeros(400, int), x)
    error[7] = 100.0
    after = _shared(error, np.zeros(400, int), x)
    assert after[7] == before[7] == 1
    changed = (after != before).sum()
    assert POOL / 4 <= changed <= 8 * POOL or not apart
