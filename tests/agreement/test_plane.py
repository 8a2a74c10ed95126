"""2D rooms, two ways: lightloc's Eq. 4 over an `Outline`, and Mitsuba over the prism on it.

The two codes share the outline's numbers and nothing else: normals, cosines, distances, shadow
rays and BRDFs are evaluated twice.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import Observations, PointLights, radiance
from lightloc.backend import types
from lightloc.optics.kernel import surfels
from lightloc.plane.outline import Outline
from render.plane import HEIGHT, REFLECTANCE, observe_plane, prism
from validation.rooms.plane import (
    SAMPLES,
    PlaneRoom,
    named_outlines,
    rooms,
    rooms_of,
    rooms_with_discs,
)

TO_UNIT_F = np.pi / REFLECTANCE  # of the prism's f = reflectance / pi
ROUNDINGS = 4  # of a position, by half an eps each, on its way through either code
OUT_OF_ROUNDING = 1e-5  # metres: what a ray must clear an edge by, to be no matter of rounding
PAIRS = 100_000

MAKES = {
    **{f"square-{k}": rooms(k, count=4)[-1] for k in (2, 3, 4, 5)},
    **{name: rooms_of(o, 3, count=1, name=name)[0] for name, o in named_outlines().items()},
    **{f"square+{k}": rooms_with_discs(k, 5, count=2)[-1] for k in (2, 4, 8)},
}
OCCLUDED = [name for name, room in MAKES.items() if room.geometry]

every_make = pytest.mark.parametrize("name", MAKES)


def curvature(outline: Outline, positions: NDArray) -> NDArray[np.float64]:
    """The largest of an arc of the loop that each of (n, 3) positions lies on, m^-1: (n, 1)."""
    sharpest = np.array([(1 / loop.radii).max() for loop in outline.loops])
    return sharpest[outline.along(positions)[0]][:, None]


def rounding(q: Observations, room: PlaneRoom, eps: float) -> NDArray[np.float64]:
    """The absolute error of B in float32, (n, 1): what rounding may change each light's part by.

    A position that is off by e turns l by e / d, changes d^-2 by 2 e / d, and turns the normal
    of an arc of radius r by e / r; a turn by t changes the cosine by t / cos, relative. With
    e = eps reach / 2 for each of `ROUNDINGS`, and as many of B itself, which the 2 stands for.
    """
    to_light = room.lights.positions[None] - q.positions[:, None]
    d = np.linalg.norm(to_light, axis=2)
    cosine = (to_light * q.normals[:, None]).sum(axis=2) / d
    reach = np.abs(room.outline.bounds).max()
    turn = reach / d + reach * curvature(room.outline, q.positions)
    relative = ROUNDINGS / 2 * eps * (2 + 2 * reach / d + turn / np.maximum(cosine, eps))
    part = room.lights.intensities[:, 0] * np.maximum(cosine, 0) / d**2
    return (relative * part).sum(axis=1, keepdims=True)


def as_rendered(room: PlaneRoom) -> NDArray[np.float64]:
    """Mitsuba's B at the points where the room is observed, for f = 1."""
    q = observe_plane(prism(room.outline, room.lights), room.outline, SAMPLES)
    return q.radiance * TO_UNIT_F


@every_make
def test_radiance(name, eps):
    """B of a 2D room is what Mitsuba renders, at every point, to the rounding of float32.

    No point of these rooms lies within rounding of a shadow's edge, so shadows agree too.
    """
    room = MAKES[name]
    q = room.observe()
    assert q.radiance.max() > 10
    assert (np.abs(as_rendered(room) - q.radiance) <= rounding(q, room, eps)).all()


@pytest.mark.parametrize("name", ["square-3", "circle", "curved", "square+4"])
def test_rendered_points_serve_as_well(name, eps):
    """Eq. 4 at the positions, normals and albedos that Mitsuba reports gives Mitsuba's B."""
    room = MAKES[name]
    q = observe_plane(prism(room.outline, room.lights), room.outline, SAMPLES)
    B = radiance(q, room.lights, room.geometry)
    assert (np.abs(B - q.radiance) * TO_UNIT_F <= rounding(q, room, eps)).all()


@pytest.mark.parametrize("name", ["square-2", "curved", "square+2"])
def test_wrong_rooms_are_seen(name, eps):
    """Negative control: a light 0.1 mm off, one 0.1 per mille too bright, f a part in 1e4 off."""
    room = MAKES[name]
    q = room.observe()
    allowed = rounding(q, room, eps)
    p, I = room.lights.positions, room.lights.intensities
    first = np.eye(len(p))[:, :1]
    for lights in (PointLights(p + 1e-4 * first * [1, 0, 0], I), PointLights(p, I + 1e-4 * first)):
        wrong = PlaneRoom(room.name, room.outline, lights, room.seed).observe()
        apart = np.abs(as_rendered(room) - wrong.radiance)
        assert (apart > allowed).mean() > 0.1
    assert (np.abs(as_rendered(room) * 1.0001 - q.radiance) > allowed).mean() > 0.5


@pytest.mark.parametrize("name", OCCLUDED)
def test_shadows_are_needed(name, eps):
    """Negative control: without visibility B does not agree."""
    room = MAKES[name]
    q = room.observe()
    bright = radiance(q, room.lights)
    assert (np.abs(as_rendered(room) - bright) > rounding(q, room, eps)).any()


def test_a_dropped_occluder_is_seen(eps):
    """Negative control: one disc of four left out is seen on the walls that it shades."""
    room = MAKES["square+4"]
    q = room.observe()
    fewer = Outline(room.outline.walls, room.outline.occluders[1:])
    B = radiance(q, room.lights, fewer)
    assert (np.abs(B - q.radiance) > rounding(q, room, eps)).any()


@pytest.fixture
def pairs(rng) -> Callable[[PlaneRoom], tuple[NDArray, NDArray]]:
    """Where shadow rays start on the outline, and points in the free space above them."""

    def draw(room: PlaneRoom) -> tuple[NDArray, NDArray]:
        q = room.observe(PAIRS // 100)
        i = rng.integers(0, len(q), PAIRS)
        x = np.array(surfels(q).origin, np.float64).T[i]
        p = rng.uniform(*room.outline.bounds, (PAIRS, 3))
        above = (q.normals[i] * (p - q.positions[i])).sum(axis=1) > 0
        keep = above & room.outline.inside(p)
        return x[keep], p[keep]

    return draw


def on_device(v: NDArray):
    f = types()
    return f.Array3f(*(f.Float(column.astype(np.float32)) for column in v.T))


def visible(geometry, x: NDArray, p: NDArray) -> NDArray[np.bool_]:
    return np.broadcast_to(np.array(geometry.visible(on_device(x), on_device(p))), len(x))


@every_make
def test_visibility(name, pairs):
    """V(x, p) is Mitsuba's ray test, but for rays that pass an edge within rounding.

    Those are the pairs whose V changes when p moves by `OUT_OF_ROUNDING`.
    """
    room = MAKES[name]
    x, p = pairs(room)
    assert len(p) > PAIRS / 10
    mine = visible(room.outline, x, p)
    theirs = visible(prism(room.outline, room.lights).geometry, x, p)
    grazing = np.zeros(len(p), bool)
    for step in OUT_OF_ROUNDING * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]):
        grazing |= visible(room.outline, x, p + step) != mine
    assert grazing.mean() < 1e-3
    np.testing.assert_array_equal(mine[~grazing], theirs[~grazing])
    assert (name in OCCLUDED) == (not mine.all())


@every_make
def test_first_hits(name, pairs, eps):
    """The first surface along a ray is where Mitsuba finds it, in the plane and out of it.

    A surface hit at a grazing angle a moves the hit by rounding / sin a, and a curved one by at
    most sqrt(2 r rounding); hits further off than that are other surfaces. Mitsuba's rays slip
    between the facets of a curved wall's mesh once in some 30 000.
    """
    room = MAKES[name]
    x, p = pairs(room)
    d = p - x
    d[::2, 2] = 0.1 * np.linalg.norm(d[::2], axis=1)  # these climb to the prism's top at the most
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    hit, y = room.outline.intersect(on_device(x), on_device(d))
    solid = prism(room.outline, room.lights)  # must outlive the rays, which are cast last
    there, z = solid.geometry.intersect(on_device(x), on_device(d))
    y, z = np.array(y, float).T, np.array(z, float).T
    assert np.array(hit).all()
    same = np.array(there) & (np.abs(y[:, 2]) < HEIGHT / 2)
    apart = np.linalg.norm(y - z, axis=1)[same]
    reach = np.abs(room.outline.bounds).max()
    assert same.mean() > 0.999
    assert np.median(apart) < ROUNDINGS * eps * reach
    assert (apart > np.sqrt(2 * ROUNDINGS * eps) * reach).mean() < 1e-4
