"""A model that is wrong is told apart by kind, and its lights are those that are there.

Rooms are boxes with points on all sides, seen from one place, with noise of 1 %. Each fault is put
into B, and the search is given the model without it; a right model is the control.
"""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import (
    Kind,
    Lambert,
    Localization,
    Observations,
    Options,
    Plastic,
    PointLights,
    Reason,
    localize,
    radiance,
    shading,
)
from lightloc.brdf.microfacet import transmittance_table
from lightloc.diagnosis.choice import hope, plain, promises
from lightloc.diagnosis.coat import INDEX, inside, let_in
from lightloc.diagnosis.departure import Departure, Evidence
from lightloc.diagnosis.diagnose import cost_of
from lightloc.diagnosis.emission import lamps_found
from lightloc.diagnosis.joint import fitted
from lightloc.diagnosis.kinds import MAKERS
from lightloc.diagnosis.piece import pieces
from lightloc.fit import Criterion, Problem

SIZE = np.array([4.0, 3.0, 2.5])
NOISE = 0.01  # of sqrt(B mean B)
FAR = 5.0  # standard errors: by chance once in a million
SMALL = 500  # points


def room(material, seed=3, n=SMALL, **fields):
    """Points on the sides of a box, dark; six regions."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(size=(n, 3))
    axis, side = rng.integers(0, 3, n), rng.integers(0, 2, n)
    normals = np.zeros((n, 3))
    x[np.arange(n), axis], normals[np.arange(n), axis] = side, 1.0 - 2.0 * side
    return Observations(
        positions=x * SIZE,
        normals=normals,
        directions=np.array([0.45, 0.4, 0.55]) * SIZE - x * SIZE,
        radiance=np.zeros(n),
        material=material,
        regions=2 * axis + side,
        region_names=["-x", "+x", "-y", "+y", "floor", "ceiling"],
        **fields,
    )


def albedos(n=SMALL):
    """(n,) one for each side."""
    own = np.array([0.5, 0.7, 0.4, 0.6, 0.3, 0.8])
    return own[room(Lambert(albedo=0.5), n=n).regions]


LIGHT = PointLights([[1.2, 1.7, 1.4]], [10.0])
TWO = PointLights([[1.2, 1.7, 1.4], [3.1, 0.8, 1.0]], [10.0, 7.0])


def noisy(q, B, seed=0, louder=1.0):
    """q with a B and noise of 1 %, or louder than is said."""
    sigma = NOISE * np.sqrt(np.maximum(B, 0) * B.mean()) + 1e-4 * B.mean()
    rng = np.random.default_rng(seed)
    return q.with_radiance(B + louder * sigma * rng.normal(size=B.shape), sigma)


def believed():
    return room(Lambert(albedo=albedos()))


def right():
    return noisy(believed(), radiance(believed(), TWO)), TWO


def other_albedo():
    q = believed()
    factor = np.where(q.regions == 4, 1.3, 1.0)[:, None]
    return noisy(q, radiance(q, TWO) * factor), TWO


def plastic():
    q = room(Plastic(alpha=0.3, diffuse=albedos()))
    return noisy(believed(), radiance(q, LIGHT)), LIGHT


def rougher():
    true, q = (room(Plastic(alpha=a, diffuse=albedos())) for a in (0.3, 0.36))
    return noisy(q, radiance(true, LIGHT)), LIGHT


def gamma():
    B = radiance(believed(), TWO)
    return noisy(believed(), B.mean() * (B / B.mean()) ** (1 / 2.2)), TWO


def ambient():
    q = believed()
    B = radiance(q, LIGHT)
    return noisy(q, B + 0.1 * B.mean() * albedos()[:, None]), LIGHT


def window():
    q = believed()
    a, b = np.meshgrid(np.linspace(1, 2.2, 6), np.linspace(0.8, 1.8, 6))
    places = np.stack([0 * a.ravel() + 1e-3, a.ravel(), b.ravel()], axis=1)
    off = q.positions[:, None] - places
    slant = np.maximum(off[:, :, 0], 0) / np.linalg.norm(off, axis=2)
    light = (shading(q, places)[:, :, 0] * slant).sum(axis=1, keepdims=True)
    B = radiance(q, LIGHT)
    return noisy(q, B + 0.3 * B.mean() * light / light.mean()), LIGHT


def tilted():
    q, (turn, lean) = believed(), (np.cos(np.radians(5)), np.sin(np.radians(5)))
    along = np.roll(np.abs(q.normals), 1, axis=1)
    wrong = Observations(
        **{name: getattr(q, name) for name in ("positions", "directions", "radiance", "material")},
        normals=turn * q.normals + lean * along,
        regions=q.regions,
        region_names=q.region_names,
    )
    return noisy(wrong, radiance(q, LIGHT)), LIGHT


def spots(middle, u, v):
    """(64, 3) places over a patch with sides u and v."""
    at = (np.arange(8) + 0.5) / 8 - 0.5
    a, b = np.meshgrid(at, at)
    return middle + a.reshape(-1, 1) * u + b.reshape(-1, 1) * v


def patch():
    """A light 1 m by 0.8 m wide."""
    q, places = believed(), spots(LIGHT.positions[0], [1.0, 0, 0], [0, 0.5, 0.6])
    wide = shading(q, places)[:, :, 0].mean(axis=1, keepdims=True) * LIGHT.intensities[0]
    return noisy(q, wide), LIGHT


PANEL = PointLights([[1.5, 1.2, 2.45]], [20.0])


def panel():
    """A panel of 0.6 m under a ceiling that is not seen."""
    q = believed()
    q = q.at(np.flatnonzero(q.regions != 5))
    places = spots(PANEL.positions[0], [0.6, 0, 0], [0, 0.6, 0])
    off = q.positions[:, None] - places
    slant = np.maximum(-off[:, :, 2], 0) / np.linalg.norm(off, axis=2)
    light = (shading(q, places)[:, :, 0] * slant).mean(axis=1, keepdims=True)
    return noisy(q, light * PANEL.intensities[0]), PANEL


def too_loud():
    return noisy(believed(), radiance(believed(), LIGHT), louder=2.0), LIGHT


FAULTS = {
    other_albedo: Kind.MATERIAL,
    plastic: Kind.MATERIAL,
    rougher: Kind.MATERIAL,
    gamma: Kind.ENCODING,
    ambient: Kind.INDIRECT,
    window: Kind.OUTSIDE,
    tilted: Kind.GEOMETRY,
    patch: Kind.EXTENDED,
    panel: Kind.EXTENDED,
    too_loud: Kind.NOISE,
}

LONG = (rougher, ambient)


def off(found: Localization, lights: PointLights) -> float:
    """The farthest that a light is from its own, in its stated errors; there are as many."""
    there = np.argmin(np.linalg.norm(found.lights.positions[:, None] - lights.positions, axis=2), 1)
    assert sorted(there) == list(range(len(lights)))
    return float(
        (np.abs(found.lights.positions - lights.positions[there]) / found.position_error).max()
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=[pytest.mark.long] * (f in LONG)) for f in FAULTS],
    ids=lambda fault: fault.__name__,
)
def test_a_fault_is_named_first_and_the_lights_are_those_that_are_there(fault):
    q, lights = fault()
    found = localize(q)
    kinds = [v.kind for v in found.verdicts if v.kind in set(FAULTS.values())]
    assert kinds[0] is FAULTS[fault]
    wide = FAULTS[fault] is Kind.EXTENDED
    assert found.reason is (Reason.EXTENDED if wide else Reason.UNDECIDED)
    assert found.width.any() == wide
    assert found.relative == (fault is gamma)
    assert off(found, lights) < FAR


def test_of_a_right_model_nothing_is_said():
    q, lights = right()
    found = localize(q)
    assert found.reason is Reason.CONVERGED
    assert found.departures == ()
    assert off(found, lights) < FAR


def evidence_of(q: Observations) -> Evidence:
    problem = Problem.of(q, q.known_sigma, None, q.bounds)
    return Evidence(q, problem, Criterion.of(Options()))


def test_no_lamp_is_looked_for_where_nothing_shines():
    """As in a sample from which more interreflected light was removed than it had."""
    q = room(Lambert(albedo=0.5))
    assert lamps_found(evidence_of(q.with_radiance(np.full((SMALL, 1), -1.0), 0.01))) == []


def gain(q: Observations, lights: PointLights) -> float:
    """By how much the best departure gains more than it costs, to first order, at fitted lights."""
    evidence = evidence_of(q)
    there = fitted(evidence, lights, None, np.zeros(0)).lights
    base = cost_of(evidence, plain(evidence, there))
    return base - min(hope(evidence, one) for one in promises(evidence, there, MAKERS, far=False))


@pytest.mark.slow
def test_noise_gains_no_departure_and_an_albedo_of_three_percent_does():
    """Thirty nulls; each price is the 1e-6 quantile of what noise gains."""
    q = believed()
    B = radiance(q, TWO)
    assert max(gain(noisy(q, B, seed), TWO) for seed in range(30)) < 0
    factor = np.where(q.regions == 4, 1.03, 1.0)[:, None]
    assert gain(noisy(q, B * factor), TWO) > 0


STEP = 1e-4


def departures(q: Observations) -> list[Departure]:
    lit = evidence_of(q).lit(TWO)
    return [one for maker in MAKERS for one in maker(lit)]


@pytest.mark.slow
@pytest.mark.parametrize("make", [right, rougher], ids=lambda make: make.__name__)
def test_each_departure_has_the_derivatives_of_its_model(make):
    """By its own unknowns; differences are good to float32's rounding over the step."""
    q, _ = make()
    lit = evidence_of(q).lit(TWO)
    for one in departures(q):
        low, high = one.limits(lit)
        u = np.clip(one.starts(lit)[-1] + 0.05, low, high)
        there = one.model(lit, u)
        np.testing.assert_allclose(there.by_unknowns, one.columns(lit, u))
        for j in range(len(u)):
            move = STEP * (np.arange(len(u)) == j)
            slope = (one.model(lit, u + move).B - one.model(lit, u - move).B) / (2 * STEP)
            scale = max(np.abs(slope).max(), there.B.max())
            error = np.abs(slope - there.by_unknowns[:, :, j])
            assert np.quantile(error, 0.99) < 0.02 * scale, one.name


def test_each_departure_begins_where_the_model_is_as_given():
    q, _ = right()
    lit = evidence_of(q).lit(TWO)
    for one in departures(q):
        for u in one.starts(lit)[: one.none]:
            np.testing.assert_allclose(
                one.model(lit, u).B, lit.plain.B, rtol=1e-5, atol=1e-6 * lit.plain.B.max()
            )


@pytest.mark.slow
def test_the_table_of_coats_is_that_of_plastic():
    share, within = transmittance_table(0.3, INDEX)
    alpha, cosines = np.full(1, 0.3), np.linspace(0, 1, len(share))
    np.testing.assert_allclose(let_in(alpha, cosines[None])[0], share, atol=0.01)
    np.testing.assert_allclose(inside(alpha), within, atol=1e-3)


@pytest.mark.slow
def test_what_is_free_is_told_with_its_errors(tmp_path):
    q, lights = gamma()
    found = localize(q, options=Options(free=("gamma",)))
    assert found.reason is Reason.CONVERGED
    assert off(found, lights) < FAR
    (told,) = found.departures
    assert told.kind is Kind.ENCODING
    assert abs(told.values[0] - 1 / 2.2) < FAR * told.errors[0] < 0.01
    assert told.sentence in str(found)
    found.save(tmp_path / "found.npz")
    (again,) = Localization.load(tmp_path / "found.npz").departures
    assert again.sentence == told.sentence
    np.testing.assert_array_equal(again.values, told.values)


def test_what_is_free_is_one_of_three_words():
    for free in (("roughness",), "albedo"):
        with pytest.raises(ValueError, match=r"Options\.free is .*; expected some of 'albedo'"):
            Options(free=free)


def test_one_albedo_of_all_is_not_told():
    flat = np.random.default_rng(0).uniform(-2, 2, (300, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (300, 1))
    q = Observations(
        positions=flat,
        normals=up,
        directions=up,
        radiance=np.zeros(300),
        material=Lambert(albedo=0.5),
    )
    B = radiance(q, PointLights([[0.5, -0.3, 1.2]], [10.0]))
    with pytest.raises(ValueError, match="a factor on all of them is one on all intensities"):
        localize(noisy(q, B), bounds=[[-2, -2, 0.1], [2, 2, 2]], options=Options(free=("albedo",)))


@pytest.mark.parametrize(("share", "grows"), [(0.08, True), (0.02, False)])
def test_outliers_along_a_line_make_errors_larger(share, grows):
    """Those beside them may be off by less than is seen; scattered, the same values pull nowhere.
    Control: a few do not. Without patches the two are the same to 1 %."""
    q, _ = right()
    rng = np.random.default_rng(0)
    away = np.abs(q.positions[:, 2] - 1.2)
    count = round(share * len(q))
    factor = rng.uniform(1.0, 1.2, (count, 1))
    errors = []
    for which in (np.argsort(away)[:count], rng.permutation(len(q))[:count]):
        B = q.radiance.copy()
        B[which] *= factor
        found = localize(q.with_radiance(B, q.sigma))
        assert len(found.lights) == 2
        errors.append(np.log(found.position_error).mean())
    assert (errors[0] - errors[1] > np.log(1.2)) == grows


def swapped(share, together, sigma=True):
    """A share of the points have the B of others, all of one place or anywhere."""
    q, _ = right()
    rng = np.random.default_rng(0)
    away = np.linalg.norm(q.positions - q.positions[rng.integers(len(q))], axis=1)
    some = np.argsort(away)[: round(share * len(q))]
    if not together:
        some = rng.permutation(len(q))[: len(some)]
    B = q.radiance.copy()
    B[some] = q.radiance[rng.permutation(len(q))[: len(some)]]
    return q.with_radiance(B, q.sigma if sigma else None)


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [True, False], ids=["sigma", "no sigma"])
@pytest.mark.parametrize("together", [True, False], ids=["together", "scattered"])
def test_a_piece_that_is_not_what_it_is_believed_to_be(together, sigma):
    """It is named and left out, and its points are the outliers; scattered ones are no piece."""
    q = swapped(0.1, together, sigma)
    found = localize(q)
    assert off(found, TWO) < FAR
    kinds = [v.kind for v in found.verdicts]
    assert (Kind.GEOMETRY in kinds) == together
    if together:
        assert kinds[0] is Kind.GEOMETRY
        assert found.reason is Reason.UNDECIDED
        assert found.departures[0].name == "a piece of the surface"
    if not sigma:
        assert 0.07 < found.noise.share < 0.13


def test_a_piece_is_never_most_of_what_is_lit():
    """One light that reaches a corner alone: what it lights is no piece that may be left out."""
    q = room(Lambert(albedo=0.5), n=3000)
    corner = np.linalg.norm(q.positions - SIZE, axis=1) < 1.2
    evidence = evidence_of(noisy(q, 3.0 * corner[:, None] + 1e-6))
    nothing = PointLights(np.zeros((0, 3)), np.zeros((0, 1)))
    assert 0 < corner.mean() < 0.2
    (piece,) = pieces(evidence.lit(nothing))
    assert piece.aside is not None
    assert piece.aside.sum() <= 0.2 * corner.sum()
