"""In a channel in which nothing can be seen an intensity is unknown, not 0; it spoils nothing."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import render
from lightloc import (
    BRDF,
    Conductor,
    Kind,
    Lambert,
    Localization,
    Mixed,
    Observations,
    Plastic,
    PointLights,
    Reason,
    Sum,
    localize,
    radiance,
)
from validation import compare

N = 600
LIGHTS = PointLights([[0.5, -0.3, 1.2], [-1.2, 0.8, 0.4]], [[10.0, 8, 6], [4, 3, 2]])
BOUNDS = [[-2, -2, 0.05], [2, 2, 2]]
NOISE = 0.01  # of the mean B

Seen = Callable[..., Observations]


def floor(material: BRDF) -> Observations:
    x = np.random.default_rng(1).uniform(-2, 2, (N, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (N, 1))
    w = np.array([0.5, -0.5, 2.0]) - x
    black = np.zeros((N, 3))
    return Observations(positions=x, normals=up, directions=w, radiance=black, material=material)


def lit(q: Observations, lights: PointLights, rng: np.random.Generator) -> Observations:
    """With noise, also where nothing is reflected, as a camera has it."""
    B = radiance(q, lights)
    sigma = NOISE * B.mean()
    return q.with_radiance(B + sigma * rng.normal(size=B.shape), sigma)


def right(found: Localization, known: NDArray[np.bool_], true: PointLights = LIGHTS) -> None:
    """The lights, within five of their errors; NaN just where an intensity is not ``known``."""
    lights = found.lights
    assert len(lights) == len(true)
    assert (np.abs(lights.positions - true.positions) < 5 * found.position_error).all()
    np.testing.assert_array_equal(~np.isnan(lights.intensities), known)
    np.testing.assert_array_equal(~np.isnan(found.intensity_error), known)
    off = np.abs(lights.intensities - true.intensities)
    assert (off < 5 * found.intensity_error)[known].all()


def said(found: Localization) -> list[str]:
    return [verdict.sentence for verdict in found.verdicts if verdict.kind is Kind.UNSEEN]


BLACK = {
    "lambert": (Lambert(albedo=[0.5, 0.4, 0]), "blue"),
    "plastic": (Plastic(alpha=0.3, diffuse=[0, 0.3, 0.5], specular=[0, 1, 1]), "red"),
    "conductor": (Conductor(alpha=0.4, specular=[1, 0, 0.5]), "green"),
    "mixed": (
        Mixed([Lambert(albedo=[0.5, 0, 0]), Lambert(albedo=[0.3, 0, 0])], np.arange(N) % 2),
        "green and blue",
    ),
    "sum": (Sum([Lambert(albedo=[0.5, 0.4, 0]), Lambert(albedo=[0.1, 0.2, 0])]), "blue"),
}


@pytest.mark.parametrize(
    ("name", "sigma"), [*((name, "given") for name in BLACK), ("lambert", "unknown")]
)
def test_an_unseen_channel_is_unknown(name, sigma, rng):
    """Said once, by its name; the others are as sure as if it were not there."""
    material, names = BLACK[name]
    q = lit(floor(material), LIGHTS, rng)
    if sigma == "unknown":  # of noise that is in proportion, as it is presumed
        B = radiance(q, LIGHTS)
        noise = 0.02 * np.sqrt(B * B.mean()) + 1e-9 * B.mean()
        q = q.with_radiance(B + noise * rng.normal(size=B.shape), None)
    found = localize(q, bounds=BOUNDS)
    known = np.array([colour not in names for colour in ("red", "green", "blue")])
    right(found, np.tile(known, (2, 1)))
    rest = "the intensities there are" if " " in names else "its intensity is"
    assert said(found) == [f"Nothing is seen in {names}: {rest} unknown."]
    assert found.reason is Reason.CONVERGED
    assert found.chi2 == pytest.approx(1, abs=0.15 if sigma == "given" else 0.5)


def test_lamps_that_are_dark_in_a_channel(rng):
    """What the floor would show is seen to be missing: 0, and known."""
    lights = PointLights(LIGHTS.positions, LIGHTS.intensities * [1, 1, 0])
    found = localize(lit(floor(Lambert(albedo=[0.5, 0.4, 0.3])), lights, rng), bounds=BOUNDS)
    right(found, np.ones((2, 3), bool), lights)
    assert not said(found)
    assert found.reason is Reason.CONVERGED


def wall(blue: tuple[float, float]) -> Observations:
    """Both sides of a thin wall, of the blue albedo that each is given."""
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 1, (N, 3)) * [0, 1, 1]
    side = np.arange(N) % 2
    normals = (1 - 2 * side)[:, None] * np.array([1.0, 0, 0])
    sides = Mixed([Lambert(albedo=[0.5, 0.4, each]) for each in blue], side)
    black = np.zeros((N, 3))
    return Observations(
        positions=x, normals=normals, directions=normals, radiance=black, material=sides
    )


@pytest.mark.parametrize("blue", [(0.3, 0.0), (0.0, 0.3), (0.0, 0.0)])
def test_a_channel_unseen_by_one_light(blue, rng):
    """The light that reaches only black points has an unknown blue; the other's is known."""
    true = PointLights([[0.6, 0.1, 0.2], [-0.5, -0.2, 0.3]], [[9.0, 8, 7], [4, 3, 2]])
    found = localize(lit(wall(blue), true, rng), bounds=[[-1, -1, -1], [1, 1, 1]])
    known = np.ones((2, 3), bool)
    known[:, 2] = np.array(blue) > 0
    right(found, known, true)
    if any(blue):
        i = blue.index(0.0)
        there = (
            f"Light {i + 1} reaches nothing that is seen in blue: its intensity there is unknown."
        )
        assert said(found) == [there]
    else:
        assert said(found) == ["Nothing is seen in blue: its intensity is unknown."]


@pytest.fixture(scope="module")
def found() -> Localization:
    q = lit(floor(BLACK["lambert"][0]), LIGHTS, np.random.default_rng(0))
    return localize(q, bounds=BOUNDS)


def test_in_files(found, tmp_path):
    """null in JSON, NaN in arrays, and back; in prints a word."""
    found.save(tmp_path / "found.npz")
    assert str(Localization.load(tmp_path / "found.npz")) == str(found)
    answer = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert [light["intensity"][2] for light in answer["lights"]] == [None, None]
    found.lights.save(tmp_path / "lights.json")
    assert "NaN" not in (tmp_path / "lights.json").read_text()
    back = PointLights.load(tmp_path / "lights.json")
    np.testing.assert_array_equal(back.intensities, found.lights.intensities)
    assert ", unknown " in str(found) and "nan" not in f"{found}{back}"


def test_judged_by_what_is_known(found):
    """The judge compares red and green; a wrong red is seen all the same."""
    verdict = compare(found.lights, LIGHTS)
    assert len(verdict.pairs) == 2 and verdict.worst_intensity_percent < 1
    assert np.isnan(verdict.pairs[0].intensity_percent[2]) and "unknown" in str(verdict)
    redder = PointLights(found.lights.positions, found.lights.intensities * [1.1, 1, 1])
    assert compare(redder, LIGHTS).worst_intensity_percent > 9


def test_shown_again(found):
    """Where nothing reflects blue, B is the same whatever blue is; where something does, unknown.
    Rendered, an unknown intensity is 0."""
    black, q = np.nan_to_num(found.lights.intensities), floor(BLACK["lambert"][0])
    zero = PointLights(found.lights.positions, black)
    np.testing.assert_allclose(radiance(q, found.lights), radiance(q, zero), rtol=1e-12)
    white = radiance(floor(Lambert(albedo=0.5)), found.lights)
    np.testing.assert_array_equal(np.isnan(white).all(axis=0), [False, False, True])
    room = render.load("box_one")
    again = render.relight(room, PointLights(room.bounds.mean(axis=0)[None], [[3.0, 2, np.nan]]))
    assert again.lights.intensities.tolist() == [[3.0, 2.0, 0.0]]
    assert np.isfinite(render.observe(again, points=64, seed=0, transport="direct").radiance).all()


@pytest.mark.parametrize("way", ["gathered", "rendered"])
def test_among_interreflected_light(way, tmp_path):
    """A room that reflects no blue at all, seen with its interreflection."""
    grey = '<bsdf type="diffuse"><rgb name="reflectance" value="0.6 0.4 0"/></bsdf>'
    (tmp_path / "room.xml").write_text(
        f"""<scene version="3.0.0"><shape type="cube"><transform name="to_world">
        <scale x="2" y="1.5" z="1.2"/></transform><boolean name="flip_normals" value="true"/>{grey}
        </shape><emitter type="point"><point name="position" x="0.5" y="-0.3" z="0.4"/>
        <rgb name="intensity" value="9"/></emitter></scene>"""
    )
    room = render.load(tmp_path / "room.xml")
    q = render.observe(room, points=400, seed=1, spp=64, transport="full")
    found = localize(q, room.geometry, indirect=32 if way == "rendered" else "gathered")
    assert len(found.lights) == 1
    assert np.linalg.norm(found.lights.positions - room.lights.positions) < 0.05
    np.testing.assert_array_equal(np.isnan(found.lights.intensities), [[False, False, True]])
    np.testing.assert_allclose(found.lights.intensities[0, :2], 9, rtol=0.1)
    assert said(found) == ["Nothing is seen in blue: its intensity is unknown."]
