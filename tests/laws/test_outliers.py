"""Where outliers lie: put where the truth is known, they are told to lie there."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

import render
from lightloc import (
    Lambert,
    Localization,
    NoiseLaw,
    Observations,
    Outliers,
    Plastic,
    PointLights,
    Where,
    localize,
)
from lightloc.answer import outliers_of
from lightloc.answer.noise_said import noise_said, terms
from lightloc.answer.outliers import BESIDE, CHANCE, MOST, at_edges, in_highlights, outliers_said


@pytest.fixture(scope="module")
def room():
    return render.load("box_occluder")


@pytest.fixture(scope="module")
def seen(room) -> Observations:
    q = render.observe(room, points=3000, transport="direct")
    return q.with_radiance(q.radiance, None)


def beside_by_jitter(q, room, rng) -> np.ndarray:
    """(n,) whether any of 40 random steps along the surface, up to `BESIDE`, changes visibility."""
    from lightloc.optics import shadows, surfels

    V, _ = shadows(surfels(q, room.geometry), room.lights.positions, room.geometry)
    found = np.zeros(len(q), bool)
    step = BESIDE * np.linalg.norm(np.diff(room.geometry.bounds, axis=0))
    for _ in range(40):
        way = rng.normal(size=(len(q), 3))
        way -= q.facets * (way * q.facets).sum(axis=1, keepdims=True)
        way *= step * rng.uniform(0, 1, (len(q), 1)) / np.linalg.norm(way, axis=1, keepdims=True)
        there = replace(q, positions=q.positions + way)
        seen, _ = shadows(surfels(there, room.geometry), room.lights.positions, room.geometry)
        found |= (seen != V).any(axis=0)
    return found


def test_edges_are_where_a_step_changes_the_shadow(room, seen, rng):
    """Beside four steps, forty random ones of at most that length: what they call an edge is one,
    but for corners, and few of the others are."""
    ours = at_edges(seen, room.lights, room.geometry)
    jittered = beside_by_jitter(seen, room, rng)
    assert 0.005 < ours.mean() < 0.2
    assert (jittered & ours).sum() > 0.8 * ours.sum()
    assert (jittered & ~ours).sum() < 0.5 * jittered.sum()
    assert not at_edges(seen, room.lights, None).any()


def test_outliers_at_edges_and_on_a_table(room, seen, rng):
    """Eleven at edges, nine on the wooden block and four anywhere: the first two are named."""
    edge = at_edges(seen, room.lights, room.geometry)
    wood = seen.regions == seen.region_names.index("wood")
    assert 0.01 < wood.mean() < 0.3
    far = np.zeros((len(seen), 1), bool)
    far[rng.choice(np.flatnonzero(edge & ~wood), 11, replace=False)] = True
    far[rng.choice(np.flatnonzero(wood & ~edge), 9, replace=False)] = True
    groups = outliers_of(seen, far, room.lights, room.geometry)
    assert [group.where for group in groups] == [Where.EDGE, Where.SURFACE]
    assert [len(group.observations) for group in groups] == [11, 9]
    assert groups[1].surface == "wood" and wood[groups[1].observations].all()
    far[rng.choice(np.flatnonzero(~edge & ~wood), 4, replace=False)] = True
    more = outliers_of(seen, far, room.lights, room.geometry)
    assert outliers_said(more, len(seen)) == (
        "24 of 3,000 observations (0.8 %) are outliers: 11 at shadows' edges, 9 on 'wood', "
        "4 elsewhere."
    )


@pytest.mark.slow
def test_outliers_anywhere_are_nowhere(room, seen, rng):
    """Negative control: of 25 random sets of 30, no more are said to lie somewhere than chance at
    5 % for each of the three sorts allows, once in a million."""
    named = 0
    for _ in range(25):
        far = np.zeros((len(seen), 1), bool)
        far[rng.choice(len(seen), 30, replace=False)] = True
        groups = outliers_of(seen, far, room.lights, room.geometry)
        named += any(group.where is not Where.ELSEWHERE for group in groups)
    assert named <= binom.isf(1e-6, 25, 3 * CHANCE)


@pytest.mark.slow
def test_outliers_in_highlights(rng):
    """On a glossy floor, seen from one place: where the lobe is bright. A dull one has none."""
    n = 1500
    x = rng.uniform(-2, 2, (n, 3)) * [1, 1, 0]
    w = np.array([3.0, 0.0, 2.0]) - x
    lights = PointLights([[-1.0, 0.0, 1.0]], [10.0])

    def floor(alpha):
        material = Plastic(diffuse=0.4, alpha=alpha)
        return Observations(
            positions=x,
            normals=[[0, 0, 1]] * n,
            directions=w,
            radiance=np.zeros(n),
            material=material,
        )

    glossy = in_highlights(floor(0.1), lights)
    assert 0.002 < glossy.mean() < 0.1
    mirror = np.array([-1 + 4 / 3, 0, 0])  # where the light is mirrored: heights 1 to 2
    away = np.linalg.norm(x - mirror, axis=1)
    assert away[glossy].max() < 1.0 < np.median(away[~glossy])
    far = np.zeros((n, 1), bool)
    far[np.flatnonzero(glossy)[:6]] = True
    (group,) = outliers_of(floor(0.1), far, lights, None)
    assert group.where is Where.HIGHLIGHT and str(group) == "6 in highlights"


def test_a_wrong_model_has_no_outliers_to_place(room, seen):
    """Nothing is said of where they lie without lights, or where they are more than `MOST`."""
    far = np.zeros((len(seen), 1), bool)
    far[0] = True
    assert outliers_of(seen, far, room.lights, room.geometry)
    nothing = PointLights(np.zeros((0, 3)), np.zeros((0, 1)))
    assert outliers_of(seen, far, nothing, room.geometry) == ()
    far[: int(MOST * len(seen)) + 1] = True
    assert outliers_of(seen, far, room.lights, room.geometry) == ()


@pytest.mark.slow
def test_an_answer_says_where_its_outliers_lie(room, seen, rng, tmp_path):
    """12 points on the block 40 % too bright, of which the first is clipped: found, named by their
    own indices, kept in a file, and marked nowhere else."""
    wood = np.flatnonzero(seen.regions == seen.region_names.index("wood"))
    wood = wood[seen.radiance[wood, 0] > 0.1 * np.median(seen.radiance)]
    moved = rng.choice(wood, 12, replace=False)
    B = seen.radiance * rng.normal(1, 0.01, seen.radiance.shape)
    B[moved] *= 1.4
    q = replace(seen.with_radiance(B, 0.01 * B), saturated=np.arange(len(seen)) == 5)
    found = localize(q, room.geometry)
    assert len(found.lights) == 3
    on = [group for group in found.outlying if group.where is Where.SURFACE]
    assert [group.surface for group in on] == ["wood"]
    assert set(on[0].observations) <= set(moved) and len(on[0].observations) >= 10
    assert "on 'wood'" in str(found)
    found.save(tmp_path / "found.npz")
    read = Localization.load(tmp_path / "found.npz")
    assert str(read) == str(found) and read.to_dict() == found.to_dict()
    np.testing.assert_array_equal(read.outlying[0].observations, found.outlying[0].observations)
    np.testing.assert_array_equal(read.limits.clipped, found.limits.clipped)
    said = found.to_dict()
    assert said["limits"] == {"clipped": 1, "floored": 0, "step": 0.0}
    assert {"where": "SURFACE", "surface": "wood", "observations": len(on[0].observations)} in (
        said["outlying"]
    )


def test_sentences_of_outliers():
    """One and several, in numbers that agree."""
    one = Outliers(Where.ELSEWHERE, np.array([3]))
    assert outliers_said([one], 50) == "1 of 50 observations (2 %) is an outlier."
    assert outliers_said([], 50) == ""


LAWS = {
    "relative": ([0.0], [0.0], [0.009], ["0.9 % of B"]),
    "read": ([0.002], [0.0], [0.0], ["0.002 at least"]),
    "shot": ([0.0], [1e-4], [0.0], ["0.01 times the root of B"]),
    "both": ([0.002], [0.0], [0.009], ["0.9 % of B", "0.002 at least"]),
    "one that is lost in the other": ([1e-4], [0.0], [0.05], ["5 % of B"]),
    "exact": ([0.0], [0.0], [0.0], []),
}


@pytest.mark.parametrize(("read", "shot", "relative", "said"), LAWS.values(), ids=LAWS)
def test_a_law_in_words(read, shot, relative, said):
    """The terms of read^2 + shot B + (relative B)^2 that tell somewhere among B are told."""
    B = np.array([[0.05, 0.2, 1.0]])
    assert terms(np.array(read), np.array(shot), np.array(relative), B) == said


def test_a_law_of_three_channels():
    """Told once where channels are alike as printed, else each."""
    B = np.tile([0.05, 0.2, 1.0], (3, 1))
    zero = np.zeros(3)
    assert terms(zero, zero, np.array([0.01, 0.01, 0.0101]), B) == ["1 % of B"]
    assert terms(zero, zero, np.array([0.01, 0.02, 0.03]), B) == ["1 / 2 / 3 % of B"]


def test_noise_is_said_where_it_was_estimated():
    """By its law where that is known, else as a share of most B; not where it was given, nor where
    nothing is lit."""
    B = np.linspace(0.1, 1, 50)[:, None]
    given, estimated = (SimpleNamespace(law=law) for law in (NoiseLaw.GIVEN, NoiseLaw.ESTIMATED))
    assert noise_said(given, B, 0.01 * B) == ""
    assert noise_said(estimated, B, 0.01 * B) == "Noise, estimated: 1 % of B."
    assert noise_said(estimated, 0 * B, B) == ""
    unknown, zero = np.full(1, np.nan), np.zeros(1)
    scaled = SimpleNamespace(law=NoiseLaw.ESTIMATED, read=unknown, shot=unknown, relative=unknown)
    assert noise_said(scaled, B, 0.01 * B) == "Noise, estimated: 1 % of B."
    lawful = SimpleNamespace(
        law=NoiseLaw.ESTIMATED, read=zero + 0.02, shot=zero, relative=zero + 0.009
    )
    assert noise_said(lawful, B, B) == "Noise, estimated: 0.9 % of B, and 0.02 at least."


def test_where_they_lie_whatever_the_unit():
    """The same room in metres and in centimetres, with a bright spot in it: told alike, by lights
    that bear no unit yet."""
    rng = np.random.default_rng(2)
    floor = rng.uniform(-2, 2, (400, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (400, 1))
    light = PointLights([[0.5, -0.3, 1.2]], [10.0])
    away = light.positions[0] - floor
    B = 0.5 / np.pi * 10 * away[:, 2] / np.linalg.norm(away, axis=1) ** 3
    B *= 1 + 0.02 * rng.normal(size=400)
    wild = np.linalg.norm(floor - floor[0], axis=1).argsort()[:6]
    B[wild] *= 3
    told = []
    for scale, unit in ((1.0, "m"), (100.0, "cm")):
        q = Observations(
            positions=floor * scale,
            normals=up,
            directions=up,
            radiance=B,
            material=Lambert(albedo=0.5),
            unit=unit,
        )
        box = np.array([[-2, -2, 0.1], [2, 2, 2]]) * scale
        found = localize(q, bounds=box)
        assert set(wild) <= set(np.flatnonzero(found.noise.outliers.any(axis=1)))
        told.append([str(group) for group in found.outlying])
    assert told[0] and told[0] == told[1]
