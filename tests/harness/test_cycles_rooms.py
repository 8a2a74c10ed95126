"""The rooms seen by Blender Cycles are the rooms made anew, and two renderers agree on them.

Cycles' direct light is Eq. 1 with Cycles' rays for V; here it meets Eq. 1 with Mitsuba's. Both
work in float32. A position x is known to eps |x|, so the direction to a light at distance d turns
by eps |x| / d and cos(theta) / d^2 changes by (1 / cos(theta) + 3) times that; rounding
directions themselves does the same with 1 in place of |x| / d.
"""

from __future__ import annotations

import numpy as np
import pytest
from rooms import NAMES
from rooms.loader import agreement, design, geometry, recording, room

TRIANGLES = 100_000  # at least, in every room
LIGHTS = range(4, 7)
POINTS = range(4000, 6001)
BYTES = 400_000  # of what is kept of a room, at most
APART = 0.3  # from a light to the next one, metres
RANGE = 4  # between the faintest and the brightest light
ROUNDINGS = 8
"""That add up in a position or a direction: measured, all pairs need 3, 99.9 % need less than 1."""

SHARE = 0.99
"""Of all pairs: the others lie on a shadow's edge. lightloc's rays start off the surface by 0.1 to
0.7 mm, which moves edges: up to 0.3 % of the pairs, among thin leaves. With rays from 0.005 mm the
two renderers differ in 2 pairs of 145 600."""


def tolerance(seen, eps: float) -> np.ndarray:
    """By how much two float32 renderers may differ, as a share of B: (n, k)."""
    x = seen["positions"].astype(float)
    to = seen["light_positions"] - x[:, None]
    d = np.linalg.norm(to, axis=2)
    cos = np.abs(np.einsum("nki,ni->nk", to, seen["normals"])) / d
    size = np.linalg.norm(x, axis=1)[:, None]
    return ROUNDINGS * eps * (1 + size / d) * (1 / np.maximum(cos, eps) + 3)


@pytest.fixture(scope="module", params=NAMES)
def both(request):
    """A room's arrays, Eq. 1 without shadows, and what a ray test sees."""
    vertices, faces, albedo, seen = room(request.param)
    return vertices, faces, albedo, seen, *agreement(seen, geometry(vertices, faces))


def test_a_room_is_what_was_asked_for(both):
    """Enough triangles, greys and lights; few enough points; lights apart and not too unlike."""
    vertices, faces, albedo, seen, _, _ = both
    assert len(faces) == len(albedo) >= TRIANGLES
    assert faces.min() >= 0
    assert faces.max() < len(vertices)
    assert len(seen["positions"]) in POINTS
    L, I = seen["light_positions"], seen["light_intensities"]
    assert len(L) == len(I) in LIGHTS
    assert np.linalg.norm(L[:, None] - L, axis=2)[~np.eye(len(L), dtype=bool)].min() > APART
    assert I.max() < RANGE * I.min()
    assert set(np.unique(seen["albedo"])) <= set(np.unique(albedo))


def test_direct_light_is_equation_1(both, eps):
    """Where both see the light, and where both see a shadow, to float32."""
    *_, seen, formula, visible = both
    B = seen["direct"]
    agree = np.abs(B - formula * visible) <= tolerance(seen, eps) * formula
    assert agree.mean() >= SHARE


def test_all_light_is_more(both):
    """Interreflection adds to the light of every lamp."""
    *_, seen, _, _ = both
    direct, total = (seen[key].astype(float).sum(axis=0) for key in ("direct", "total"))
    assert (total > direct).all()
    assert np.isfinite(seen["total"]).all()


def test_wrong_ones_are_seen(both, eps):
    """Negative controls: no shadows, light 0.1 % too bright."""
    *_, seen, formula, visible = both
    B, limit = seen["direct"], tolerance(seen, eps) * formula
    assert (np.abs(B - formula) <= limit).mean() < SHARE
    assert (np.abs(1.001 * B - formula * visible) <= limit).mean() < SHARE


def test_other_triangles_are_refused(monkeypatch, refuses):
    """A room that is not made as it was when rendered is no reference."""
    made = design(NAMES[0])
    made.vertices[0, 0] += 2.0**-14
    monkeypatch.setattr("rooms.loader.design", lambda name: made)
    with refuses(NAMES[0]):
        room(NAMES[0])


def test_small_enough():
    """What is kept of each room stays small."""
    for name in NAMES:
        assert recording(name).stat().st_size < BYTES
