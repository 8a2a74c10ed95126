"""Standard errors of rendered values, borrowed from points that are alike, never from oneself.

Rationale: a path tracer's noise is skewed, so that a mean is low where its own error is; a fit
weighted by that believes what is low. Expected: the mean over the others of the same kind.
"""

from __future__ import annotations

import numpy as np
import pytest

from render.transport import POOL, _shared


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
