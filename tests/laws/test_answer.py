"""What an answer says of its lights follows from them: errors, bound, residual, outliers, order."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lightloc import (
    Assumption,
    Kind,
    Localization,
    Observations,
    Options,
    PointLights,
    Reason,
    Verdict,
    Way,
    cramer_rao,
    intensity_distance,
    localize,
    radiance,
)
from lightloc.answer import MARGIN
from lightloc.interreflection.settle import movement
from validation.rooms.plane import rooms

FAR = 30.0  # standard errors: an outlier


@pytest.fixture(scope="module")
def seen() -> Observations:
    """A square room with three lights, its noise, and an outlier on either side."""
    q = rooms(3, count=1)[0].observe(noise=0.02)
    B = q.radiance.copy()
    bright = np.argsort(B[:, 0])[-40:]  # dark ones could not be so much darker
    B[bright[0]] += FAR * q.sigma[bright[0]]
    B[bright[20]] -= FAR * q.sigma[bright[20]]
    return q.with_radiance(B, q.sigma)


@pytest.fixture(scope="module")
def found(seen) -> Localization:
    return localize(seen)


def test_residual_and_outliers(seen, found):
    """(B - model) / sigma; outliers are counted on both sides."""
    model = radiance(seen, found.lights)
    np.testing.assert_allclose(
        found.residual, (seen.radiance - model) / found.sigma, atol=1e-3, rtol=1e-3
    )
    assert found.residual.max() > Options().outlier
    assert found.residual.min() < -Options().outlier
    assert found.outliers == (np.abs(found.residual) > Options().outlier).sum() == 2


def test_errors_are_those_of_the_lights_in_their_order(seen, found):
    """Brightest first, each with its own Cramér-Rao bound and rows of the covariance."""
    assert (np.diff(found.lights.intensities[:, 0]) < 0).all()
    bound = cramer_rao(seen.with_radiance(seen.radiance, found.sigma), found.lights)
    np.testing.assert_allclose(found.position_error, bound.position, rtol=1e-3)
    np.testing.assert_allclose(found.intensity_error, bound.intensity, rtol=1e-3)
    np.testing.assert_allclose(
        np.sqrt(np.diag(found.covariance))[:6], bound.position[:, :2].ravel(), rtol=1e-3
    )
    assert len(set(found.intensity_error[:, 0].round(6))) == 3  # each has an error of its own


def test_the_bound_holds_under_noise():
    """D is taken of B and `MARGIN` standard errors, so that one light is not above its own bound.

    Without the margin it is: the least of 400 noisy quotients lies some errors below the rest, no
    more than the margin here.
    """
    room = rooms(2, count=1)[0]
    one = PointLights(room.lights.positions[:1], room.lights.intensities[:1])
    dark, rng = room.observe(), np.random.default_rng(4)
    sigma = 0.03 * radiance(dark, one)
    noise = sigma * rng.normal(size=sigma.shape).clip(0.1 - MARGIN, MARGIN)
    q = dark.with_radiance(radiance(dark, one) + noise, sigma)
    found = localize(q)
    plain, _ = intensity_distance(q, found.lights.positions)
    bound, _ = intensity_distance(q, found.lights.positions, margin=MARGIN)
    np.testing.assert_allclose(found.bound, bound, rtol=1e-6)
    assert len(found.lights) == 1
    assert plain[0, 0] < found.lights.intensities[0, 0] < found.bound[0, 0]


def test_one_light_that_moves_is_movement(found):
    """The light that has moved most counts, and the channel of it that has."""
    p, I = found.lights.positions.copy(), found.lights.intensities.copy()
    p[1] += 2 * found.position_error[1]
    assert movement(found, PointLights(p, I)) == pytest.approx(2)
    I[2] -= 5 * found.intensity_error[2]
    assert movement(found, PointLights(p, I)) == pytest.approx(5)


def test_a_file_brings_back_the_answer(found, tmp_path):
    """Saved and loaded, an answer prints alike and is equal to the bit, observation by
    observation."""
    found = replace(found, certificate=np.nan, way=Way.GATHERED)
    found.save(tmp_path / "found.npz")
    read = Localization.load(tmp_path / "found.npz")
    assert str(read) == str(found)
    assert read.to_dict() == found.to_dict()
    for one, other in zip(everything(read), everything(found), strict=True):
        np.testing.assert_array_equal(one, other)
    for name in ("reason", "way", "history", "verdicts", "inseparable", "assumed"):
        assert getattr(read, name) == getattr(found, name)
    found.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "found.npz").read_bytes()


def everything(found):
    """All arrays of an answer."""
    own = [value for value in vars(found).values() if isinstance(value, np.ndarray)]
    lights = [found.lights, *(count.lights for count in found.counts)]
    parts = [part for some in lights for part in (some.positions, some.intensities)]
    return [*own, *parts, found.noise.outliers]


def test_the_answer_as_json_holds_the_lights(found, tmp_path):
    """`PointLights.load` reads it; what is unknown is null, and no number is none."""
    path = tmp_path / "found.json"
    path.write_text(json.dumps(replace(found, certificate=np.inf).to_dict(), allow_nan=False))
    read = PointLights.load(path)
    np.testing.assert_array_equal(read.positions, found.lights.positions)
    np.testing.assert_array_equal(read.intensities, found.lights.intensities)
    answer = json.loads(path.read_text())
    assert answer["certificate"] is None
    assert answer["noise"]["outliers"] == 2
    assert answer["assumed"] == ["ISOTROPIC", "MATERIALS", "NO_AMBIENT", "ERRORS"]


@pytest.mark.parametrize("harm", ["cut", "field", "format", "answer", "step"])
def test_a_broken_answer_is_refused(found, tmp_path, refuses, harm):
    """The file is named, and what is wrong with it."""
    path = tmp_path / "found.npz"
    found.save(path)
    if harm == "cut":
        path.write_bytes(path.read_bytes()[:1000])
    else:
        keys = dict(np.load(path))
        if harm == "field":
            del keys["residual"]
        elif harm == "answer":
            keys["answer"] = np.array("{")
        elif harm == "step":
            answer = json.loads(str(keys["answer"]))
            answer["history"][0]["turns"] = 1
            keys["answer"] = np.array(json.dumps(answer))
        else:
            keys["format"] = np.array("lightloc-localization-99")
        np.savez(path, **keys)
    with refuses(str(path)):
        Localization.load(path)


def test_each_count_and_how_likely(seen, found):
    """The answer's count is the likeliest; its lights are the answer's own."""
    by_count = {len(count.lights): count for count in found.counts}
    assert {0, 1, 2, 3} <= by_count.keys()
    assert by_count[3].likely == 1
    np.testing.assert_array_equal(by_count[3].lights.positions, found.lights.positions)
    assert max(by_count[k].likely for k in (0, 1, 2)) < 1e-6
    chi2 = [count.chi2 for count in found.counts]
    assert all(more <= fewer for fewer, more in pairwise(chi2))


def test_what_is_assumed(seen, found):
    """What is asked of the data is assumed no more."""
    asked = localize(seen, options=Options(ambient=True, noise="estimate"))
    assert set(found.assumed) - set(asked.assumed) == {Assumption.NO_AMBIENT, Assumption.ERRORS}
    assert Assumption.ISOTROPIC in asked.assumed


def test_a_light_that_may_be_several_makes_one_more_possible(found):
    """In an undecided answer alone: one that converged has one number."""
    several = Verdict(Kind.CLUSTER, (0,), "Light 1 may be several lights.")
    told = replace(found, verdicts=(*found.verdicts, several))
    k = len(found.lights)
    assert replace(told, reason=Reason.UNDECIDED).possible == (k, k + 1)
    assert replace(told, reason=Reason.CONVERGED).possible == (k,)
    assert replace(found, reason=Reason.UNDECIDED, verdicts=()).possible == (k,)
