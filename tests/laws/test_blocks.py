"""What is computed in blocks, to bound memory, is what it is in one: no row lost, none shifted."""

from __future__ import annotations

import numpy as np
import pytest

import render
from lightloc import Conductor, Lambert, Mixed, Observations, Outline, shading, shading_gradient
from lightloc.interreflection import footnote_1
from lightloc.optics import ambient, transport
from lightloc.optics.kernel import surfels

ROOM = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).with_occluders(
    Outline.disc([0.45, 0.5], 0.12)
)
N = 40
PLACES = np.random.default_rng(3).uniform(0.05, 0.95, (11, 3)) * [1, 1, 0]
ROWS = [1, 4, 10, 11]  # of eleven: with and without a rest


@pytest.fixture
def q() -> Observations:
    """Points of a room with a pillar, each of an albedo of its own."""
    x, n = ROOM.sample(N)
    albedo = np.linspace(0.2, 0.9, N)
    return Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(N), material=Lambert(albedo=albedo)
    )


@pytest.mark.parametrize("rows", ROWS)
def test_positions_in_blocks(rows, q, monkeypatch):
    """S, its gradient and soft shadows at eleven positions, so many of them at once."""

    def everything() -> list[np.ndarray]:
        soft = shading_gradient(q, PLACES, ROOM, blur=0.05, axes=(0, 1))
        return [shading(q, PLACES, ROOM), *shading_gradient(q, PLACES, ROOM), *soft]

    whole = everything()
    monkeypatch.setattr(transport, "LANES", rows * N)
    for one, other in zip(everything(), whole, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("rows", [1, 13, N])
def test_observations_in_blocks(rows, q, monkeypatch):
    """Ambient light of points that all reflect it otherwise, so many of them at once."""
    metal = Conductor(alpha=np.linspace(0.2, 0.8, N))
    material = Mixed((q.material, metal), np.arange(N) % 2)
    q = Observations(
        positions=q.positions,
        normals=q.normals,
        directions=q.normals,
        radiance=np.zeros(N),
        material=material,
    )
    whole = ambient.reflected_ambient(surfels(q), 1)
    assert len(np.unique(whole)) == N
    monkeypatch.setattr(ambient, "LANES", rows * ambient.STRATA**2)
    np.testing.assert_array_equal(ambient.reflected_ambient(surfels(q), 1), whole)


def test_gathering_in_blocks(load, monkeypatch):
    """Indirect light at 100 points of a box, 30 of them at once: the same light.

    Not the same rays, so that it differs by the errors stated, which differ from point to point:
    in a hundred no difference is beyond four of them, nor are two points of a box so alike.
    """
    room = load("box_three")
    seen = render.observe(room, points=100, spp=16, seed=2)
    whole, error = footnote_1.indirect(seen, room.geometry)
    monkeypatch.setattr(footnote_1, "LANES", 30 * footnote_1.STRATA**2)
    parts, too = footnote_1.indirect(seen, room.geometry)
    assert np.abs((parts - whole) / np.hypot(error, too)).max() < 4
    assert np.abs((np.roll(whole, 30) - whole) / np.hypot(error, too)).max() > 40
