"""Directions over a hemisphere, and what comes from all of them: any normal, any colour."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

from lightloc import Conductor, Lambert, Observations
from lightloc.backend import types
from lightloc.optics.ambient import reflected_ambient
from lightloc.optics.directions import cosine_direction
from lightloc.optics.kernel import surfels

STRATA = 64  # an axis
ROUNDINGS = 16  # operations in a row, half an eps each


def directions(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (m, 3) about a normal from the middles of a grid of u and v; u (m,)."""
    f = types()
    grid = (np.arange(STRATA) + 0.5) / STRATA
    u, v = (side.ravel().astype(np.float32) for side in np.meshgrid(grid, grid))
    about = f.Array3f(*(dr.full(f.Float, float(a), len(u)) for a in normal))
    return np.array(cosine_direction(about, f.Float(u), f.Float(v)), float).T, u.astype(float)


def test_directions_about_any_normal(rng, eps):
    """Unit vectors at cosine sqrt(1 - u), evenly around: upwards, downwards, and along the axes.

    Around the normal they cancel, and square to half of what is left beside the cosine's part:
    the sum over v of its cosine, its sine and their products is that of equal angles, 0 or 1/2.
    """
    tilted = rng.normal(size=(20, 3))
    for normal in np.concatenate([np.eye(3), -np.eye(3), tilted]):
        n = (normal / np.linalg.norm(normal)).astype(np.float32).astype(float)
        d, u = directions(n)
        allowed = ROUNDINGS / 2 * eps
        assert np.abs(np.linalg.norm(d, axis=1) - 1).max() < allowed
        assert np.abs(d @ n - np.sqrt(1 - u)).max() < allowed
        around = d - (d @ n)[:, None] * n
        assert np.abs(around.mean(axis=0)).max() < allowed
        plane = (np.eye(3) - np.outer(n, n)) * u.mean() / 2
        np.testing.assert_allclose(around.T @ around / len(d), plane, atol=allowed)


@pytest.mark.parametrize("albedo", [[0.8, 0.5, 0.1], [[0.8, 0.5, 0.1], [0.1, 0.2, 0.3]]])
def test_ambient_light_has_the_colour_of_its_surface(albedo, eps):
    """A diffuse surface reflects its albedo, in each channel: all directions give the same."""
    up = [[0.0, 0.0, 1.0]] * 2
    q = Observations(
        positions=np.zeros((2, 3)),
        normals=up,
        directions=up,
        radiance=np.zeros((2, 3)),
        material=Lambert(albedo=albedo),
    )
    expected = np.broadcast_to(albedo, (2, 3))
    found = reflected_ambient(surfels(q), 3)
    np.testing.assert_allclose(found, expected, rtol=ROUNDINGS * eps)


def test_ambient_light_on_metal_is_tinted(eps):
    """The tint of a metal is a factor on what it reflects, in each channel."""
    up = [[0.0, 0.0, 1.0]]
    common = dict(positions=[[0, 0, 0]], normals=up, directions=[[0.3, 0, 1]])
    tint = np.array([0.9, 0.5, 0.2])
    white, tinted = (
        Observations(radiance=np.zeros((1, 3)), material=Conductor(alpha=0.4, specular=s), **common)
        for s in (1.0, tint)
    )
    expected = tint * reflected_ambient(surfels(white), 3)
    np.testing.assert_allclose(
        reflected_ambient(surfels(tinted), 3), expected, rtol=ROUNDINGS * eps
    )
