"""The laws of exact culling: ceilings and bounds are never too low, and nothing is lost.

Fields with and without clusters evaluate the same pairs with the same arithmetic, so D agrees bit
for bit, and so does L except where two observations limit equally.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import drjit as dr
import numpy as np
import pytest
from numpy.typing import NDArray

import render
from lightloc import (
    BRDF,
    Conductor,
    Grid,
    Lambert,
    Mixed,
    Observations,
    Plastic,
    PointLights,
    Sum,
    radiance,
)
from lightloc.backend import types
from lightloc.brdf.parameters import channels_last
from lightloc.brdf.protocol import Bounded, evaluate
from lightloc.fields import field as fields
from lightloc.fields import limiters
from lightloc.fields.clusters import LEAF, ROUNDING, SLACK, Clusters, Volumes, bound, kd_order, row
from lightloc.fields.field import RUN, Field, ever_coarser
from lightloc.fields.ranking import NO_LIMITER
from lightloc.optics.kernel import surfels, unoccluded
from lightloc.search.ground import morton

SIDE = 4.0  # metres
WALL = 400  # observations on each wall of a room
BEND = 0.15  # how far normals lean, so that clusters are cones
LIGHTS = PointLights([[1.0, 1.2, 2.5], [3.1, 2.9, 0.8]], [5.0, 3.0])
VIEWER = np.array([2.2, 1.7, 1.9])
SHAPE = (21, 18, 19)  # odd, and enough cells for a coarser grid
PAIRS = 20_000

ROUGH = Conductor(alpha=0.4, eta=1.2, k=7.0)
SHINY = Conductor(alpha=0.1, specular=[0.9, 0.8, 0.7], eta=[0.2, 0.9, 1.1], k=[3.9, 2.4, 2.1])
COAT = Plastic(alpha=0.3, diffuse=[0.8, 0.5, 0.1], nonlinear=True)
MATERIALS: dict[str, BRDF] = {
    "lambert": Lambert(albedo=0.6),
    "lambert_rgb": Lambert(albedo=[0.6, 0.4, 0.1]),
    "lambert_varied": Lambert(albedo=np.linspace(0.1, 0.9, 6 * WALL)),
    "conductor": ROUGH,
    "conductor_rgb": SHINY,
    "very_rough": Conductor(alpha=1.5),
    "plastic": COAT,
    "mixed": Mixed((Lambert(albedo=0.5), ROUGH, COAT), np.arange(6 * WALL) * 7 % 3),
    "sum": Sum((Lambert(albedo=0.3), SHINY)),
    "sum_of_lambert": Sum((Lambert(albedo=0.3), Lambert(albedo=[0.1, 0.2, 0.3]))),
}


@pytest.fixture(params=MATERIALS.values(), ids=MATERIALS.keys())
def material(request: pytest.FixtureRequest) -> BRDF:
    return request.param


@pytest.fixture(autouse=True)
def seeds_for_small_grids(monkeypatch) -> None:
    """Seeds from a coarser grid, as large grids have them."""
    monkeypatch.setattr(fields, "FEW_PAIRS", 1 << 18)


@pytest.fixture
def room(rng: np.random.Generator) -> Callable[..., Observations]:
    """Observe a cube whose walls are a little uneven, by two lights that nothing occludes."""

    def observe(material: BRDF) -> Observations:
        x = rng.uniform(0, SIDE, (6, WALL, 3))
        n = np.zeros((6, WALL, 3))
        for wall in range(6):
            x[wall, :, wall // 2] = SIDE * (wall % 2)
            n[wall, :, wall // 2] = 1 - 2 * (wall % 2)
        n += rng.uniform(-BEND, BEND, n.shape)
        x, n = x.reshape(-1, 3), n.reshape(-1, 3)
        dark = Observations(
            positions=x,
            normals=n,
            directions=VIEWER - x,
            radiance=np.zeros((len(x), material.channels)),
            material=material,
        )
        return dark.with_radiance(radiance(dark, LIGHTS), 0.0)

    return observe


@dataclass(frozen=True)
class Both:
    """D and L of all pairs, and of what culling leaves of them."""

    D: NDArray[np.float32]
    L: NDArray[np.uint32]
    culled_D: NDArray[np.float32]
    culled_L: NDArray[np.uint32]

    @staticmethod
    def of(q: Observations, where: Grid, geometry=None) -> Both:
        s, B = surfels(q), np.maximum(q.radiance, 0)
        full = Field.over(s, where, geometry, cull=False)
        culled = Field.over(s, where, geometry)
        assert culled.clusters is not None
        assert culled.coarser is not None
        return Both(*full.limits(B), *culled.limits(B))

    def agree(self) -> None:
        """D bit for bit, L except where D says that two limit equally: one in 10 000 at most."""
        np.testing.assert_array_equal(self.culled_D, self.D)
        assert ((self.culled_L == NO_LIMITER) == (self.L == NO_LIMITER)).all()
        assert (self.culled_L != self.L).mean() < 1e-4


def test_ceiling(material, room, above):
    """f (n.l)_+ never exceeds its ceiling, whatever l, the mirror direction included.

    Allowed is `SLACK`, which bounds on clusters have in hand for the roundings of float32.
    """
    q = room(material)
    assert isinstance(material, Bounded)
    cos_w = (q.normals * q.directions).sum(axis=1, keepdims=True)
    top = material.ceiling(cos_w)
    mirror = 2 * cos_w * q.normals - q.directions
    for l in (above(q.normals, 0.0), above(q.normals, 0.7), q.normals, mirror):
        cosine = np.maximum((q.normals * l).sum(axis=1, keepdims=True), 0)
        f = evaluate(material, q.normals, l, q.directions)
        assert (f <= (top.flat + top.cosine * cosine) * (1 + SLACK)).all()
        if top.attained:
            np.testing.assert_allclose(f, top.cosine * cosine, rtol=1e-5, atol=1e-6)


def test_ceiling_is_not_far_too_high(room):
    """Power: seen from the normal, a lobe reaches its ceiling at the normal.

    There F of a conductor with F = 1, both G1 and D are at their peak.
    """
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    for alpha in (0.05, 0.3, 0.9):
        lobe = Conductor(alpha=alpha)
        top = lobe.ceiling(np.ones((3, 1)))
        np.testing.assert_allclose(evaluate(lobe, up, up, up), top.flat, rtol=1e-5)


def test_kd_order(rng):
    """Every point is in one leaf, none holds too many, and leaves are compact."""
    x = rng.uniform(size=(1000, 3))
    order, start = kd_order(x, 16)
    assert sorted(order) == list(range(1000))
    assert start[0] == 0 and start[-1] == 1000
    assert np.diff(start).min() >= 8 and np.diff(start).max() <= 16
    first = start[:-1]
    size = np.maximum.reduceat(x[order], first) - np.minimum.reduceat(x[order], first)
    # 64 leaves of a unit cube: 1/4 along each axis if they were cubes
    assert np.median(size) < 0.3


def shares(q: Observations) -> list[NDArray[np.float64]]:
    """What f (n.l)_+ / B is at most: the cosine's part and the lobe's."""
    top = q.material.ceiling((q.normals * q.directions).sum(axis=1, keepdims=True))
    return [np.broadcast_to(part / q.radiance, q.radiance.shape) for part in (top.cosine, top.flat)]


def bounds(volumes: Volumes, parts, which: NDArray, middle: NDArray, half: NDArray) -> NDArray:
    """The bounds (m, k) of (m,) volumes over m boxes."""
    f = types()
    record = row(volumes.records(*parts), f.UInt32(which), len(volumes), len(which))
    box = [[f.Float(np.ascontiguousarray(c, np.float32)) for c in v.T] for v in (middle, half)]
    return np.array(bound(record, *box, parts[0].shape[1], True)).T


def ranks(q: Observations, i: NDArray, p: NDArray) -> NDArray:
    """S / B (m, k) of observations i (m,) at points p (m, 3)."""
    f = types()
    S = unoccluded(
        surfels(q), f.UInt32(i), f.Array3f(*(f.Float(c.astype(np.float32)) for c in p.T))
    )
    return channels_last(S, len(i)) / q.radiance[i]


def test_bound(material, room, rng):
    """No S / B of a cluster's observations at points of a box exceeds the cluster's bound.

    Boxes are lanes' runs: points along one axis, of all lengths, inside and around the room.
    """
    q = room(material)
    clusters = Clusters.of(q.positions, q.normals, 2 * SIDE)
    parts = [part[clusters.order] for part in shares(q)]
    for volumes in clusters.levels:
        which = rng.integers(0, len(volumes), PAIRS)
        middle = rng.uniform(-0.5, SIDE + 0.5, (PAIRS, 3))
        half = rng.exponential(0.2, (PAIRS, 3)) * [0, 0, 1]
        i = clusters.order[rng.integers(volumes.start[which], volumes.start[which + 1])]
        p = middle + half * rng.uniform(-1, 1, half.shape)
        reached = ranks(q, i, p)
        assert (reached > 0).any()
        assert (reached <= bounds(volumes, parts, which, middle, half)).all()


def test_bound_of_one_is_itself(room, rng):
    """Power: for a cluster of one and a box of one point, the bound is S / B.

    It is wider by `SLACK` and by `ROUNDING` of the span on every side of the box, which changes
    1 / d^2 and the height by at most 4 such steps over d, and more for points near the horizon.
    """
    q = room(MATERIALS["lambert"])
    alone = Volumes.around(np.arange(len(q) + 1), q.positions, q.normals, 2 * SIDE)
    i = rng.integers(0, len(q), PAIRS)
    p = rng.uniform(0, SIDE, (PAIRS, 3))
    d = p - q.positions[i]
    far = np.linalg.norm(d, axis=1)
    cosine = (d * q.normals[i]).sum(axis=1) / far
    clear = (far > 0.3) & (cosine > 0.1)
    assert clear.sum() > PAIRS / 4
    reached = ranks(q, i, p)[clear]
    limit = bounds(alone, shares(q), i, p, 0 * p)[clear]
    step = ROUNDING * 2 * SIDE
    np.testing.assert_allclose(limit, reached, rtol=SLACK + 4 * step / 0.3 / 0.1)


def test_culling_loses_nothing(material, room):
    """D and L are those of all pairs, for every BRDF."""
    Both.of(room(material), Grid([0, 0, 0], [SIDE] * 3, SHAPE)).agree()


@pytest.mark.parametrize("noise", [0.05, 0.3])
def test_culling_under_noise(noise, room, rng):
    """The same where B is noisy: clusters hold observations of every brightness."""
    q = room(MATERIALS["lambert"])
    noisy = q.radiance * (1 + noise * rng.normal(size=q.radiance.shape))
    q = q.with_radiance(np.maximum(noisy, 0), 0.0)
    Both.of(q, Grid([0, 0, 0], [SIDE] * 3, SHAPE)).agree()


@pytest.mark.parametrize("name", ["lambert", "conductor"])
def test_culling_with_dark_observations(name, room):
    """Where B = 0, D is 0, and the one of the dark ones limits whose S is largest."""
    q = room(MATERIALS[name])
    B = q.radiance.copy()
    B[::97] = 0
    both = Both.of(q.with_radiance(B, 0.0), Grid([0, 0, 0], [SIDE] * 3, SHAPE))
    both.agree()
    assert (both.D == 0).any()
    assert (both.L[both.D == 0] % 97 == 0).all()


def test_culling_outside(room):
    """A floor alone, and a grid to both sides of it: below, nothing limits in either."""
    q = room(MATERIALS["lambert"])
    i = np.flatnonzero(q.positions[:, 2] == 0)
    floor = Observations(
        positions=q.positions[i],
        normals=q.normals[i] * [0, 0, 1],
        directions=q.directions[i],
        radiance=q.radiance[i],
        material=q.material,
    )
    both = Both.of(floor, Grid([-1, -1, -1], [SIDE, SIDE, 1], SHAPE))
    both.agree()
    below = np.isinf(both.D).reshape(SHAPE)
    assert below[..., :9].all()
    assert not below[..., 10:].any()


def test_culling_in_the_plane(room):
    """A 2D room on a grid one cell deep."""
    q = room(MATERIALS["lambert"])
    i = np.flatnonzero((q.positions[:, 2] > 0) & (q.positions[:, 2] < SIDE))
    x, n, w = (v[i] * [1, 1, 0] for v in (q.positions, q.normals, q.directions))
    flat = Observations(
        positions=x, normals=n, directions=w, radiance=q.radiance[i], material=q.material
    )
    Both.of(flat, Grid([0, 0, 0], [SIDE, SIDE, 0], (129, 65, 1))).agree()


@pytest.mark.parametrize("name", ["box_occluder", "furnished"])
def test_culling_with_occluders(name, load):
    """Where things occlude, meshes have facets of their own, and many B are 0."""
    scene = load(name)
    q = render.observe(scene, points=1024, seed=5, transport="direct")
    low, high = scene.bounds
    Both.of(q, Grid(low, high, SHAPE), scene.geometry).agree()


def test_a_bound_too_low_is_noticed(room, monkeypatch):
    """Negative control: bounds at a fifth of their value lose limiters."""
    q = room(MATERIALS["lambert"])
    grid = Grid([0, 0, 0], [SIDE] * 3, SHAPE)

    def low(*args):
        return [value / 5 for value in bound(*args)]

    monkeypatch.setattr(limiters, "bound", low)
    both = Both.of(q, grid)
    assert (both.culled_L != both.L).any()
    assert (both.culled_D >= both.D).all()


def test_most_is_culled(room, monkeypatch):
    """Power: in a diffuse room most pairs are never evaluated.

    A third is here, where a cluster is as wide as a fifth of the room; the benchmarks say how
    the share falls as grids and samples become finer.
    """
    q = room(MATERIALS["lambert"])
    visits = dr.zeros(types().UInt32, 1)
    dr.make_opaque(visits)
    rank = limiters.Ranking.rank

    def counted(self, lanes):
        inner = rank(self, lanes)

        def count(j):
            dr.scatter_reduce(dr.ReduceOp.Add, visits, types().UInt32(1), types().UInt32(0))
            return inner(j)

        return count

    monkeypatch.setattr(limiters.Ranking, "rank", counted)
    grid = Grid([0, 0, 0], [SIDE] * 3, (64, 64, 64))
    Field.over(surfels(q), grid).limits(q.radiance)
    pairs = sum(int(np.prod(g.shape)) for g in ever_coarser(grid, len(q))) * len(q)
    assert 0 < RUN * int(np.array(visits)[0]) < 0.5 * pairs


def test_coarser_grids_end(monkeypatch):
    """A grid along one axis alone ends too."""
    monkeypatch.setattr(fields, "FEW_PAIRS", 1e6)
    shapes = [g.shape for g in ever_coarser(Grid([0] * 3, [1, 0, 0], (9000, 1, 1)), 1000)]
    assert shapes == [(9000, 1, 1), (1125, 1, 1), (141, 1, 1)]


def test_bound_on_slanted_triangles(rng):
    """The same for walls that stand askew, in threes of corners: the centres of such clusters'
    boxes lie before their walls or behind them, by up to a third of their size."""
    m = 200
    corners = rng.uniform(0, SIDE, (m, 3, 3))
    share = rng.dirichlet(np.ones(3), (m, LEAF))
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    q = Observations(
        positions=(share @ corners).reshape(-1, 3),
        normals=np.repeat(n, LEAF, axis=0),
        directions=np.repeat(n, LEAF, axis=0),
        radiance=rng.uniform(0.5, 1.5, (m * LEAF, 1)),
        material=MATERIALS["lambert"],
    )
    volumes = Volumes.around(np.arange(m + 1) * LEAF, q.positions, q.normals, 2 * SIDE)
    which = rng.integers(0, m, PAIRS)
    p = rng.uniform(-0.5, SIDE + 0.5, (PAIRS, 3))
    reached = ranks(q, which * LEAF + rng.integers(0, LEAF, PAIRS), p)
    assert (reached > 0).any()
    assert (reached <= bounds(volumes, shares(q), which, p, 0 * p)).all()


def test_morton_order(rng):
    """Octant by octant, and in each of these octant by octant again."""
    x = rng.uniform(size=(2000, 3))
    x[:2] = [[0.0] * 3, [1.0] * 3]
    x = x[morton(x)]
    octant, inner = ((np.floor(m * x * (1 - 1e-3)) % 2) @ [1, 2, 4] for m in (2, 4))
    clear = (np.abs(x * 4 - np.rint(x * 4)) > 0.01).all(axis=1)  # a cell is a thousandth
    assert (np.diff((8 * octant + inner)[clear]) >= 0).all()
