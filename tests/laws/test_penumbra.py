"""Shadows with soft edges: what they are near, how they change, and what they tend to."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Lambert, Observations, Outline, shading, shading_gradient
from lightloc.optics.penumbra import IN_SPACE, IN_THE_PLANE

ROOM = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).with_occluders(
    Outline.disc([0.45, 0.5], 0.12)
)
PLANE = np.array([0, 1])


@pytest.fixture
def q() -> Observations:
    x, n = ROOM.sample(200)
    return Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(200), material=Lambert(albedo=np.pi)
    )


@pytest.mark.parametrize(("cloud", "axes"), [(IN_THE_PLANE, 2), (IN_SPACE, 3)])
def test_clouds_are_round(cloud, axes):
    """Mean 0 and covariance 1 along the axes that they span: what Stein's identity asks for.

    The points are few: off the diagonal the covariance is below a quarter.
    """
    np.testing.assert_allclose(cloud.mean(axis=0), 0, atol=1e-12)
    spread = cloud.T @ cloud / len(cloud)
    np.testing.assert_allclose(np.diag(spread), [1, 1, 1][:axes] + [0] * (3 - axes), atol=1e-12)
    assert np.abs(spread - np.diag(np.diag(spread))).max() < 0.25


def test_far_from_edges_nothing_changes(q):
    """Where all of the cloud agrees, value and gradient are those of the true shadow."""
    p = np.array([[0.2, 0.3, 0.0]])
    hard, slope = shading_gradient(q, p, ROOM, axes=PLANE)
    soft, soft_slope = shading_gradient(q, p, ROOM, blur=1e-4, axes=PLANE)
    same = np.abs(hard - soft)[:, 0, 0] < 1e-6
    assert same.mean() > 0.9
    np.testing.assert_allclose(soft_slope[same], slope[same], rtol=1e-4, atol=1e-3)


def test_value_is_the_mean_over_the_cloud(q):
    """S at p times the share of the cloud that sees q."""
    p, blur = np.array([0.7, 0.62, 0.0]), 0.05
    soft, _ = shading_gradient(q, p[None], ROOM, blur=blur, axes=PLANE)
    lit = shading(q, p + blur * IN_THE_PLANE, ROOM)[:, :, 0] > 0
    above = shading(q, p + blur * IN_THE_PLANE)[:, :, 0] > 0  # whether any light comes from there
    share = (lit | ~above).mean(axis=1)
    plain = shading(q, p[None])[:, 0, 0]
    seen = above.all(axis=1)
    np.testing.assert_allclose(soft[seen, 0, 0], (plain * share)[seen], rtol=1e-5, atol=1e-6)


def test_slope_is_that_of_visibility(q):
    """In the penumbra, what the slope adds goes with the change of V over half a blur.

    The cloud has 13 points, so that V takes steps of a thirteenth: the two correlate, by more than
    0.8, and on average are equal within a fifth. S without its shadow would add nothing.
    """
    blur, said, changes = 0.04, [], []
    for p in np.random.default_rng(3).uniform(0.1, 0.9, (40, 3)) * [1, 1, 0]:
        if ROOM.clearance(p[None])[0] < 0.05 or not ROOM.inside(p[None])[0]:
            continue
        S, slope = shading_gradient(q, p[None], ROOM, blur=blur, axes=PLANE)
        free, free_slope = shading_gradient(q, p[None], None, axes=PLANE)
        penumbra = ((0.1 * free < S) & (0.9 * free > S))[:, 0, 0]
        S, slope, free, free_slope = (a[penumbra] for a in (S, slope, free, free_slope))
        V = S[:, 0, 0] / free[:, 0, 0]
        for axis in (0, 1):
            step = np.eye(3)[axis] * blur / 2
            up, down = (
                shading_gradient(q, (p + way * step)[None], ROOM, blur=blur, axes=PLANE)[0][
                    penumbra
                ]
                / np.maximum(shading(q, (p + way * step)[None])[penumbra], 1e-9)
                for way in (1, -1)
            )
            changes.append((up - down)[:, 0, 0] / blur)
            added = slope[:, 0, 0, axis] - V * free_slope[:, 0, 0, axis]
            said.append(added / free[:, 0, 0])
    change, slope = np.concatenate(changes), np.concatenate(said)
    assert len(change) > 500
    assert np.corrcoef(change, slope)[0, 1] > 0.8
    assert (change @ slope) / (change @ change) == pytest.approx(1, abs=0.2)


def test_without_occluders_blur_does_nothing(q):
    """No geometry, no shadow: exactly the same numbers."""
    p = np.array([[0.2, 0.3, 0.0]])
    for a, b in zip(
        shading_gradient(q, p, None, axes=PLANE),
        shading_gradient(q, p, None, blur=0.1, axes=PLANE),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)
