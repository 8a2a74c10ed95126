"""The data set of section 6.1 is what the paper says it is, and the same on every call."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from lightloc import Lambert, PointLights
from lightloc.plane.outline import Outline
from validation.rooms.plane import (
    CLEARANCE,
    COUNTS,
    DARK,
    DISC_RADII,
    INTENSITIES,
    PER_COUNT,
    data_set,
    named_outlines,
    rooms,
    rooms_of,
    rooms_with_discs,
)
from validation.studies import columns

NOISY = 0.05  # k of section 6.1


@pytest.fixture(scope="module")
def everything():
    return data_set()


def apart(room) -> float:
    """The least distance between two lights, metres."""
    p = room.lights.positions
    d = np.linalg.norm(p[:, None] - p, axis=2)
    return d[~np.eye(len(p), dtype=bool)].min()


def test_four_hundred_rooms(everything):
    """100 square rooms of side 1 each with 2, 3, 4 and 5 lights, no two of them alike."""
    assert [len(room.lights) for room in everything] == np.repeat(COUNTS, PER_COUNT).tolist()
    assert len({room.name for room in everything}) == len({room.seed for room in everything}) == 400
    first = [tuple(room.lights.positions[0]) for room in everything]
    assert len(set(first)) == 400
    for room in everything:
        assert room.outline.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
        assert room.outline.walls.length == 4
        assert room.geometry is None


def test_lights_keep_clear(everything):
    """No light is nearer than 5 % of the side to another or to a wall, and some nearly are."""
    to_wall = [np.minimum(p, 1 - p)[:, :2].min() for p in (r.lights.positions for r in everything)]
    between = [apart(room) for room in everything]
    assert CLEARANCE <= min(to_wall) < 1.1 * CLEARANCE
    assert CLEARANCE <= min(between) < 1.3 * CLEARANCE
    assert not any(room.lights.positions[:, 2].any() for room in everything)


def test_lights_are_uniform(everything):
    """Places and intensities are uniform in their ranges: Kolmogorov-Smirnov distance below the
    1 per mille limit, 1.95 / sqrt(n).

    That lights keep apart spoils it by a per cent of the area each, and not the marginals.
    """
    p = np.concatenate([room.lights.positions for room in everything])
    I = np.concatenate([room.lights.intensities for room in everything])[:, 0]
    n = len(I)
    low, high = INTENSITIES
    for values in (
        (p[:, 0] - CLEARANCE) / (1 - 2 * CLEARANCE),
        (p[:, 1] - CLEARANCE) / (1 - 2 * CLEARANCE),
        (I - low) / (high - low),
    ):
        assert values.min() >= 0 and values.max() <= 1
        assert np.abs(np.sort(values) - (np.arange(n) + 0.5) / n).max() < 1.95 / np.sqrt(n)


def test_same_seed_same_rooms(everything):
    """A room depends on the seed, on the number of lights and on its own number alone."""
    again = rooms(3, count=5)
    for a, b in zip(again, everything[100:], strict=False):
        assert a.name == b.name
        np.testing.assert_array_equal(a.lights.positions, b.lights.positions)
        np.testing.assert_array_equal(a.lights.intensities, b.lights.intensities)
        one, other = a.observe(noise=NOISY, seed=4), b.observe(noise=NOISY, seed=4)
        np.testing.assert_array_equal(one.radiance, other.radiance)
    other = rooms(3, count=1, seed=2019)[0]
    assert not np.array_equal(other.lights.positions, again[0].lights.positions)


def test_observed_exactly(everything):
    """Without noise B is Eq. 4 with f = 1, computed here once more in float64.

    To 1e-5: positions are rounded to float32, by 6e-8, over cosines of 0.05 or more.
    """
    room = everything[0]
    q = room.observe()
    assert len(q) == 400
    assert not q.sigma.any()
    np.testing.assert_array_equal(q.directions, q.normals)
    assert isinstance(q.material, Lambert)
    to_light = room.lights.positions[:, None] - q.positions
    d = np.linalg.norm(to_light, axis=2)
    B = (room.lights.intensities * (to_light * q.normals).sum(axis=2) / d**3).sum(axis=0)
    np.testing.assert_allclose(q.radiance[:, 0], B, rtol=1e-5)


def test_noise(everything):
    """B is replaced by a Gaussian of mean B and standard deviation k sqrt(B).

    Over 40 000 draws; four standard errors of mean, deviation and correlation of neighbours.
    """
    z = []
    for number, room in enumerate(everything[::4]):
        clean, noisy = room.observe(), room.observe(noise=NOISY, seed=number)
        B = clean.radiance
        z.append(((noisy.radiance - B) / (NOISY * np.sqrt(B)))[:, 0])
        floored = np.maximum(noisy.radiance, DARK * noisy.radiance.mean())
        np.testing.assert_allclose(noisy.sigma, NOISY * np.sqrt(floored))
        assert (noisy.sigma > 0).all()
    each = np.array(z)
    z = each.ravel()
    assert abs(z.mean()) < 4 / np.sqrt(z.size)
    assert abs(z.std() - 1) < 4 / np.sqrt(2 * z.size)
    assert abs((each[:, 1:] * each[:, :-1]).mean()) < 4 / np.sqrt(z.size)
    assert abs((each[1:] * each[:-1]).mean()) < 4 / np.sqrt(z.size)  # rooms have their own


def test_seeds_of_noise(everything):
    """Another seed is another draw of the noise; the rooms are the same."""
    room = everything[0]
    a, b = (room.observe(noise=NOISY, seed=seed).radiance for seed in (0, 1))
    assert (a != b).all()


def test_noise_in_shadow():
    """Where B is 0 it stays 0, and its standard error does not."""
    room = rooms_with_discs(8, 2, count=1)[0]
    clean, noisy = room.observe(), room.observe(noise=NOISY)
    dark = clean.radiance == 0
    assert dark.any()
    assert not noisy.radiance[dark].any()
    assert (noisy.sigma[dark] >= 0.9 * NOISY * np.sqrt(DARK * clean.radiance.mean())).all()


@pytest.mark.parametrize("discs", [2, 4, 8])
def test_rooms_with_discs(discs):
    """Discs of the stated sizes, 5 % of the side from each other, the walls and the lights."""
    for room in rooms_with_discs(discs, 3, count=5):
        outline = room.outline
        assert len(outline.occluders) == discs
        radii = np.array([disc.radii[0] for disc in outline.occluders])
        assert (radii >= DISC_RADII[0]).all() and (radii <= DISC_RADII[1]).all()
        centres = np.array([disc.centres[0] for disc in outline.occluders])
        gap = np.linalg.norm(centres[:, None] - centres, axis=2) - radii - radii[:, None]
        assert (gap[~np.eye(discs, dtype=bool)] >= CLEARANCE).all()
        assert (np.minimum(centres, 1 - centres) - radii[:, None] >= CLEARANCE).all()
        assert outline.inside(room.lights.positions).all()
        assert (outline.clearance(room.lights.positions) >= CLEARANCE).all()
        assert apart(room) >= CLEARANCE
        assert room.geometry is outline


@pytest.mark.parametrize(("name", "outline"), named_outlines().items())
def test_other_makes(name, outline):
    """Each fits the unit square and takes five lights; only what is convex and empty is free."""
    low, high = outline.bounds
    assert (low >= 0).all() and (high <= 1 + 1e-9).all()
    room = rooms_of(outline, 5, count=1, name=name)[0]
    assert room.name == f"{name}-5-000"
    assert outline.inside(room.lights.positions).all()
    assert (room.geometry is None) == (name in ("square", "circle", "stadium"))
    loop, s, length = room.surface.along(room.observe(100).positions)
    assert len(loop) == 100 and (s < length).all()


def test_rooms_travel():
    """A room can be sent to another process, and observes the same there."""
    room = rooms_with_discs(2, 2, count=1)[0]
    before = room.observe()  # what is worked out once travels too
    after = pickle.loads(pickle.dumps(room)).observe()
    np.testing.assert_array_equal(before.radiance, after.radiance)


def test_a_full_room(refuses):
    """A room with no place left for its lights says so."""
    with refuses("no free place for 40 lights"):
        rooms_of(Outline.polygon([[0, 0], [1, 0], [1, 0.13], [0, 0.13]]), 40, count=1)


def test_error_is_the_mean_of_squares():
    """Section 6.1's measure of B: of no lights, the mean square of B; of the true ones, nothing."""
    room, q = columns.observed("noiseless-3-000")
    none = PointLights(np.zeros((0, 3)), np.zeros((0, 1)))
    assert columns.error(q, none) == pytest.approx(np.square(q.radiance).mean())
    assert columns.error(q, room.lights) < 1e-9 * columns.error(q, none)
