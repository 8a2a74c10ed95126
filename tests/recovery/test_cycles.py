"""Rooms that another renderer made: 148 000 to 185 000 triangles, some edges on the wrong side."""

from __future__ import annotations

import numpy as np
import pytest
from rooms.loader import geometry, observations, room

from lightloc import Reason, localize

OFF = 0.003  # metres, in rooms 5 to 8 m across


@pytest.mark.parametrize(
    ("name", "lights"), [("arches", [0, 1, 2, 3, 4, 5]), ("plants", [1, 2]), ("library", [0, 3, 4])]
)
def test_lights_are_found(name, lights):
    """The right count to within 3 mm, explained in spite of the wrong edges."""
    vertices, faces, _, seen = room(name)
    q = observations(seen, lights)
    found = localize(q, geometry(vertices, faces), bounds=[vertices.min(0), vertices.max(0)])
    true = seen["light_positions"][lights]
    assert len(found.lights) == len(lights)
    apart = np.linalg.norm(true[:, None] - found.lights.positions, axis=2)
    assert apart.min(axis=1).max() < OFF
    assert found.reason is Reason.CONVERGED
    assert 0 < found.outliers < 0.02 * len(q)
