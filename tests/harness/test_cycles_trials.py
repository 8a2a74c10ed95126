"""Trials in rooms that another renderer made: read from files and judged; none without files."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import PointLights, radiance
from validation.studies import cycles

LIGHTS = PointLights([[-0.5, 0.3, 0.4], [0.4, -0.5, -0.2], [0.1, 0.5, -0.5]], [5.0, 3.0, 4.0])


@pytest.fixture
def cube(rng, tmp_path, monkeypatch):
    """A cube of two albedos as a file, seen from its middle in direct light."""
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    square = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4]])
    square = np.concatenate([square, [[1, 3, 7, 5]]])
    faces = np.concatenate([square[:, [0, 1, 2]], square[:, [0, 2, 3]]])
    albedo = np.tile([0.3, 0.6], 6)
    face = rng.integers(0, len(faces), 500)
    share = rng.dirichlet([1.0, 1.0, 1.0], 500)
    x = np.einsum("nv,nvi->ni", share, corner[faces[face]])
    normals = -np.sign(x) * (np.abs(x) > 1 - 1e-9)
    seen = {
        "positions": x,
        "normals": normals,
        "directions": -x / np.linalg.norm(x, axis=1, keepdims=True),
        "albedo": albedo[face],
        "light_positions": LIGHTS.positions,
        "light_intensities": LIGHTS.intensities[:, 0],
        "direct": np.ones((500, 3)),
    }
    q = cycles.observations(seen, [0], "direct")
    p, I = LIGHTS.positions, LIGHTS.intensities
    parts = [PointLights(p[i : i + 1], I[i : i + 1]) for i in range(len(LIGHTS))]
    seen["direct"] = np.stack([radiance(q, part)[:, 0] for part in parts], axis=1)
    seen["total"] = seen["direct"] + 0.1
    arrays = {"vertices": corner, "faces": faces, "face_albedo": albedo, **seen}
    np.savez(tmp_path / "cube.npz", **arrays)
    monkeypatch.setenv(cycles.FOLDERS, str(tmp_path))
    return seen


def test_without_rooms_there_are_no_trials(monkeypatch):
    monkeypatch.delenv(cycles.FOLDERS, raising=False)
    assert cycles.names(3) == []


def test_names(cube):
    """Three lights have four subsets of two or three; of more than are asked for, some."""
    rows = [f"{kind}-cube-{i:03d}" for kind in ("direct", "all") for i in range(4)]
    assert cycles.names(99) == rows
    assert cycles.names(2) == [rows[0], rows[3], rows[4], rows[7]]


def test_columns_add_up(cube):
    """Two lights together are the sum of their columns, of the kind of light that is asked for."""
    q = cycles.observations(cube, [0, 2], "all")
    np.testing.assert_array_equal(q.radiance, cube["total"][:, [0, 2]].sum(axis=1)[:, None])
    assert q.sigma is None
    assert q.interreflected
    assert not cycles.observations(cube, [0, 2], "direct").interreflected


def test_a_trial(cube):
    """Exact direct light of two lights of a cube: both found, to float32's rounding of a file."""
    found = cycles.one("direct-cube-000")
    assert (found.lights, found.found, found.counted, found.due) == (2, 2, True, True)
    assert found.off < 0.01
    assert found.way == "DIRECT"
    assert 0 < found.seconds < 60


def test_a_room_that_renders(cube):
    """Every triangle is there with its albedo: rays meet the walls, and walls light each other."""
    with np.load(cycles.files()["cube"]) as file:
        space = cycles.geometry(file["vertices"], file["faces"], file["face_albedo"])
        dark = cycles.geometry(file["vertices"], file["faces"], 0.5 * file["face_albedo"])
    np.testing.assert_allclose(space.bounds, [[-1, -1, -1], [1, 1, 1]])
    q = cycles.observations(cube, [0], "all")
    H, _ = space.interreflection(LIGHTS.positions[:1], q, 16)
    half, _ = dark.interreflection(LIGHTS.positions[:1], q, 16)
    assert (H > 0).mean() > 0.99
    assert half.sum() < H.sum() / 4  # one bounce and the point's own albedo at least
