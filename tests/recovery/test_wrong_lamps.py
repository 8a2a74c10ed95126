"""Lamps that are no isotropic points: never dark; lamps are told, or the best point is.

The lamps are computed here in NumPy, and so is what any single point would leave of B.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from lightloc import Kind, Lambert, Observations, Options, PointLights, Reason, localize, radiance

ALBEDO = 0.6
SIZE = np.array([4.0, 3.0, 2.5])
LAMP = np.array([1.2, 1.1, 2.0])
DOWN = np.array([0.0, 0.0, -1.0])
POINTS = 1200


def box() -> tuple[NDArray, NDArray]:
    """Points on the walls of an empty room, and their normals."""
    rng = np.random.default_rng(5)
    areas = [12, 12, 7.5, 7.5, 10, 10]
    which = rng.choice(6, POINTS, p=np.array(areas) / sum(areas))
    x, normals = rng.random((POINTS, 3)) * SIZE, np.zeros((POINTS, 3))
    for wall, (axis, side) in enumerate([(2, 0), (2, 1), (0, 0), (0, 1), (1, 0), (1, 1)]):
        mine = which == wall
        x[mine, axis] = side * SIZE[axis]
        normals[mine, axis] = 1 - 2 * side
    return x, normals


X, NORMALS = box()


def shading(p: NDArray) -> NDArray:
    """S (n,) of a point at p."""
    d = p - X
    r2 = (d * d).sum(axis=1)
    return ALBEDO / np.pi * np.maximum((d * NORMALS).sum(axis=1), 0) / r2**1.5


def cosine(axis: NDArray = DOWN) -> NDArray:
    """(n,) of the angle between the lamp's axis and the way to each point."""
    l = X - LAMP
    return l @ axis / np.linalg.norm(l, axis=1)


WRONG = {
    "downlight": (20 * shading(LAMP) * np.maximum(cosine(), 0), 0.01),
    "downlight and much noise": (20 * shading(LAMP) * np.maximum(cosine(), 0), 0.2),
    "spotlight": (20 * shading(LAMP) * (cosine() > np.cos(0.5)), 0.01),
    "spotlight at a wall": (20 * shading(LAMP) * (cosine(np.array([1.0, 0, 0])) > 0.88), 0.01),
    "spot on a fiftieth": (20 * shading(LAMP) * (cosine() > np.cos(0.22)), 0.01),
}
"""B, and its error as a share of its root mean square."""


def seen(B: NDArray, noise: float, rng: np.random.Generator, cut: bool = True) -> Observations:
    """B with errors; cut off at 0, as a camera does, so that what is dark is brighter."""
    sigma = noise * np.sqrt(np.square(B).mean())
    B = B + sigma * rng.normal(size=B.shape)
    return Observations(
        positions=X,
        normals=NORMALS,
        directions=NORMALS,
        radiance=np.maximum(B, 0) if cut else B,
        sigma=sigma,
        material=Lambert(albedo=ALBEDO),
    )


def cost(B: NDArray, model: NDArray) -> float:
    """Cauchy's loss at five times the size of (n,) radiances: nearly the squares of what is
    left."""
    return float(np.log1p(np.square((B - model) / np.sqrt(np.square(B).mean())) / 25).sum())


def single(B: NDArray) -> float:
    """The least that any point of a grid leaves, with the best of many intensities."""
    axes = [np.linspace(0.1, side - 0.1, 8) for side in SIZE]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    every = []
    for p in places:
        S = shading(p)
        best = (S @ B) / (S @ S)
        every += [cost(B, share * best * S) for share in (0.9, 1.0, 1.1)]
    return min(every)


@pytest.mark.parametrize("cut", [True, False])
@pytest.mark.parametrize("name", WRONG)
def test_lit_is_not_dark(name, cut, rng):
    """The answer has a light, and is not sure of it; three quarters of B are explained, or two
    thirds of what the best single point does; darkness explains nothing (the control). A downlight
    is told as what it is, within its errors (2.9 of them here, as is the least that any place, axis
    and exponent leave); no lamp of that kind has a spotlight's edge."""
    q = seen(*WRONG[name], rng, cut)
    B = q.radiance[:, 0]
    found = localize(q)
    if name.startswith("downlight"):
        assert found.reason is Reason.UNDECIDED
        assert found.verdicts[0].kind is Kind.EMISSION
        (p,) = found.lights.positions
        assert (np.abs(p - LAMP) < 4 * found.position_error[0]).all()
        assert found.position_error.max() < (0.05 if "noise" in name else 0.001)
    else:
        assert found.reason is Reason.NO_GAIN
        assert found.verdicts[0].kind is Kind.UNEXPLAINED
    enough = max(0.25 * cost(B, 0 * B), 1.5 * single(B))
    assert cost(B, B - (found.residual * found.sigma)[:, 0]) < enough < cost(B, 0 * B)


def test_the_best_point_is_below_a_spotlight(rng):
    """Straight below the lamp, which lights a part of the floor. It is told with what it explains,
    and with an error as large as what it leaves makes it: not the noise's."""
    found = localize(seen(*WRONG["spotlight"], rng))
    (p,) = found.lights.positions
    assert np.linalg.norm((p - LAMP)[:2]) < 0.1
    assert 0.3 < p[2] < LAMP[2]
    assert (found.position_error > 0.005).all()
    assert "of B squared" in found.verdicts[0].sentence


def test_outside_the_bounds_that_were_given(rng):
    """A point beyond them: the answer is unsure, holds a light at their border and says where."""
    q = seen(20 * shading(LAMP), 0.01, rng)
    found = localize(q, bounds=[[2.5, 1.5, 0.1], [3.9, 2.9, 1.0]])
    assert found.reason not in (Reason.DARK, Reason.CONVERGED)
    assert Kind.BORDER in {verdict.kind for verdict in found.verdicts}


def test_bright_at_random(rng):
    """Fifteen bright observations among dark ones, which no light explains: none is told, yet the
    room is not called dark. Three of them are no more than may lie anywhere: dark."""
    B = np.zeros(POINTS)
    B[rng.permutation(POINTS)[:15]] = 1.0
    found = localize(seen(B, 0.01, rng, cut=False))
    assert found.reason is Reason.NO_GAIN
    assert not len(found.lights)
    assert "1.2 % of the radiances" in found.verdicts[0].sentence
    B[np.flatnonzero(B)[3:]] = 0
    assert localize(seen(B, 0.01, rng, cut=False)).reason is Reason.DARK


@pytest.mark.parametrize("noise", ["given", "estimate"])
def test_darkness_is_dark(noise, rng):
    """Noise alone, of a known or an unknown size."""
    q = seen(np.ones(POINTS), 0.01, rng)
    dark = q.with_radiance(0.01 * rng.normal(size=(POINTS, 1)), 0.01)
    assert localize(dark, options=Options(noise=noise)).reason is Reason.DARK


def test_no_more_lamps_than_lights_are_allowed():
    """Of two points one may be found: three lamps would explain them, and are not claimed."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-2, 2, (600, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (600, 1))
    floor = {"positions": x, "normals": up, "directions": up, "material": Lambert(albedo=0.5)}
    dark = Observations(radiance=np.zeros(600), **floor)
    B = radiance(dark, PointLights([[0.5, -0.3, 1.2], [-1.0, 0.8, 1.5]], [10.0, 6.0]))
    q = dark.with_radiance(B * rng.normal(1, 0.01, B.shape), 0.01 * B)
    found = localize(q, bounds=[[-2, -2, 0.1], [2, 2, 2.5]], options=Options(most_lights=1))
    assert len(found.lights) == 1 and found.reason is Reason.MOST_LIGHTS
