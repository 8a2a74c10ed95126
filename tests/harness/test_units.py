"""Units of length: the same scene in m, cm, mm, and said in every print and file."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import render
import validation
from lightloc import Localization, Observations, PointLights, localize
from validation.cli import main
from validation.draw import slices
from validation.records import Result
from validation.report.pages import environment
from validation.report.rows import light_rows

LIGHTS = PointLights([[1.2, 2.1, 1.9], [2.9, 0.8, 1.4]], [12.0, 8.0])
EXACT = 1e-6  # of the room, and of the intensities
UNSEEN = 0.1  # standard errors: what a unit may change where light is rendered (measured: 0.015)


def cube(name: str, low, high, flipped: bool) -> str:
    """A box as Mitsuba has it, between two corners."""
    half, middle = (high - low) / 2, (high + low) / 2
    places = " ".join(f'{axis}="{float(a)!r}"' for axis, a in zip("xyz", middle, strict=True))
    sizes = " ".join(f'{axis}="{float(a)!r}"' for axis, a in zip("xyz", half, strict=True))
    return f"""<shape type="cube" id="{name}">
      <boolean name="flip_normals" value="{str(flipped).lower()}"/>
      <transform name="to_world"><scale {sizes}/><translate {places}/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
    </shape>"""


def written(folder, scale: float):
    """The file of a room with a block, so many units to the metre, as a stranger would write it."""
    low, high = np.array([[0.0, 0, 0], [4, 3, 2.5]]) * scale
    block = np.array([[1.6, 1.2, 0.3], [2.1, 1.7, 1.1]]) * scale
    parts = [cube("room", low, high, True), cube("block", *block, False)]
    for p, I in zip(scale * LIGHTS.positions, scale**2 * LIGHTS.intensities[:, 0], strict=True):
        at = " ".join(f'{axis}="{float(a)!r}"' for axis, a in zip("xyz", p, strict=True))
        parts.append(
            f'<emitter type="point"><point name="position" {at}/>'
            f'<rgb name="intensity" value="{float(I)!r}"/></emitter>'
        )
    path = folder / f"room_{scale!r}.xml"
    path.write_text(f'<scene version="3.0.0">{"".join(parts)}</scene>')
    return path


def observed(path, **how):
    """A room's observations, and the answer to them."""
    room = render.load(path)
    q = render.observe(room, seed=4, **how)
    return q, localize(q, room.geometry)


@pytest.fixture(scope="module")
def in_metres(tmp_path_factory):
    """The room of 1 unit to the metre, observed in its direct light, and the answer."""
    path = written(tmp_path_factory.mktemp("metres"), 1.0)
    return observed(path, points=300, transport="direct")


@pytest.mark.parametrize("scale", [1000.0, 2.0**-20])
def test_direct_light_has_no_unit(tmp_path, in_metres, scale):
    """From the file to the answer: B, the lights and what is said of them, to a millionth.

    The block's shadow is what a ray that begins a fixed length off its surface would lose: with
    Mitsuba's own nothing at all was lit where the room is 2^-20 as large.
    """
    (q, one), (other, same) = (
        in_metres,
        observed(written(tmp_path, scale), points=300, transport="direct"),
    )
    np.testing.assert_allclose(other.radiance, q.radiance, rtol=2e-4)  # float32 near the lights
    assert one.reason is same.reason and len(same.lights) == 2
    off = np.abs(same.lights.positions / scale - one.lights.positions)
    assert off.max() < EXACT * np.linalg.norm([4, 3, 2.5])
    np.testing.assert_allclose(
        same.lights.intensities / scale**2, one.lights.intensities, rtol=EXACT
    )


@pytest.mark.parametrize("rendered", [None, 16])
def test_rendered_light_has_no_unit(tmp_path, rendered):
    """With all interreflection: by footnote 1, or rendered for the lights that are found.

    The same seed takes the same paths but for Mitsuba's ray offset, so that answers in mm differ
    from those in m by much less than their errors.
    """
    answers = []
    for scale in (1.0, 1000.0):
        room = render.load(written(tmp_path, scale))
        q = render.observe(room, points=600, spp=64, seed=4)
        answers.append(localize(q, room.geometry, indirect=rendered))
    one, same = answers
    assert one.reason is same.reason and len(one.lights) == len(same.lights) == 2
    off = np.abs(same.lights.positions / scale - one.lights.positions)
    assert (off < UNSEEN * one.position_error).all()
    brighter = np.abs(same.lights.intensities / scale**2 - one.lights.intensities)
    assert (brighter < UNSEEN * one.intensity_error).all()


def test_paths_need_a_scene_that_is_not_too_small(tmp_path):
    """Mitsuba's leave a surface by 9e-5 whatever the unit: what they would get wrong is refused."""
    room = render.load(written(tmp_path, 0.001))
    render.observe(room, points=16, transport="direct")
    said = "the scene is only 0.0056 units of length across"
    with pytest.raises(ValueError, match=said):
        render.observe(room, points=16, spp=2)
    q = render.observe(room, points=16, transport="direct")
    with pytest.raises(ValueError, match=said):
        room.geometry.interreflection([[0.001, 0.001, 0.001]], q)


def test_lights_in_another_unit():
    """They leave the same radiance, and come back to the last bit but one."""
    for unit, scale in {"cm": 100, "mm": 1000, "in": 1 / 0.0254}.items():
        there = LIGHTS.in_unit(unit)
        np.testing.assert_allclose(there.positions, scale * LIGHTS.positions, rtol=1e-11)
        np.testing.assert_allclose(there.intensities, scale**2 * LIGHTS.intensities, rtol=1e-11)
        np.testing.assert_allclose(there.in_unit("m").positions, LIGHTS.positions, rtol=1e-11)
    assert replace(LIGHTS, unit="unit").in_unit("unit").unit == "unit"
    with pytest.raises(ValueError, match="is 'unit', which can't be converted to 'cm'"):
        replace(LIGHTS, unit="unit").in_unit("cm")


def test_comparing_in_two_units(refuses):
    """Found lights are converted to the true ones' unit; where one is not known, nothing is."""
    found = PointLights(1000 * LIGHTS.positions + [20.0, 0, 0], 1e6 * LIGHTS.intensities, "mm")
    verdict = validation.compare(found, LIGHTS, diagonal=5.0)
    assert verdict.unit == "m" and not verdict.missed
    np.testing.assert_allclose([pair.distance for pair in verdict.pairs], 0.02, rtol=1e-6)
    assert "true light 1, found light 1: 0.02 m (0.4 % of the diagonal)" in str(verdict)
    assert "true light 1, found light 1: 20 mm" in str(
        validation.compare(LIGHTS.in_unit("cm"), found)
    )
    for unit in ("unit", "ell"):
        with refuses(f"the unit of length is '{unit}' of the found lights and 'm' of the true"):
            validation.compare(replace(LIGHTS, unit=unit), LIGHTS)
    same = replace(LIGHTS, unit="unit")
    assert validation.compare(same, same).worst_position_percent == 0
    alone = PointLights([[0, 0, 2]], [1.0], "unit")
    with refuses("the room's diagonal is not known"):
        validation.compare(alone, alone)


def test_a_metre_in_any_unit():
    """Without a diagonal a lone light is judged by the metre, in mm as in m."""
    one, near = PointLights([[0, 0, 2]], [1.0]), PointLights([[0, 0, 2.01]], [1.0])
    for unit in ("m", "mm", "ft"):
        pair = validation.compare(near.in_unit(unit), one.in_unit(unit)).pairs[0]
        np.testing.assert_allclose(pair.distance_percent, 1.0, rtol=1e-6)


def test_what_is_in_two_units_is_refused(load, refuses):
    """Lights, observations and a room: not one metre too many."""
    room = replace(load("box_one"), unit="cm")
    with refuses("these lights: in m, and "):
        render.relight(room, LIGHTS)
    q = render.observe(load("box_one"), points=16, transport="direct")
    for meet in (render.attach, render.remeasure):
        with refuses("these observations: in m, and "):
            meet(q, room) if meet is render.attach else meet(room, q)
    view = render.photograph(load("box_one"), width=8, transport="direct")
    with refuses("the view: in m, and "):
        render.observe_view(view, room)


def test_files_keep_the_unit(load, tmp_path):
    """Lights, observations, views and answers; lights of former versions are in metres."""
    room = replace(load("box_one"), unit="cm", lights=replace(load("box_one").lights, unit="cm"))
    room.lights.save(tmp_path / "lights.json")
    assert PointLights.load(tmp_path / "lights.json").unit == "cm"
    old = json.loads((tmp_path / "lights.json").read_text())
    del old["unit"]
    (tmp_path / "old.json").write_text(json.dumps(old))
    assert PointLights.load(tmp_path / "old.json").unit == "m"
    view = render.photograph(room, width=16, transport="direct")
    render.write_exr(view, tmp_path / "view.exr")
    assert render.read_exr(tmp_path / "view.exr") == view and view.unit == "cm"
    q = render.observe_view(tmp_path / "view.exr")
    q.save(tmp_path / "q.npz")
    found = localize(Observations.load(tmp_path / "q.npz"), room.geometry)
    found.save(tmp_path / "found.npz")
    again = Localization.load(tmp_path / "found.npz")
    assert again.unit == again.lights.unit == again.to_dict()["unit"] == "cm"
    assert {count.lights.unit for count in again.counts} == {"cm"}


def test_the_command_line(tmp_path, monkeypatch, capsys):
    """--unit says what no file says; what a file says stands."""

    def run(*words) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["lightloc", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        out = capsys.readouterr()
        return end.value.code or 0, out.out + out.err

    scene = written(tmp_path, 100.0)
    seen, truth, found = (tmp_path / name for name in ("seen.npz", "truth.json", "found.json"))
    render_it = ("render", scene, "-o", seen, "--lights", truth, "--transport", "direct")
    code, said = run(*render_it, "--points", 400)
    assert code == 0 and "lengths in the scene's own unit" in said
    code, said = run("localize", seen, "--scene", scene, "--unit", "cm", "-o", found)
    assert code == 0 and "position (cm)" in said and "units of 0.0001 W/sr" in said
    assert json.loads(found.read_text())["unit"] == "cm"
    assert run("compare", found, scene)[0] == 2
    for other in (scene, truth):
        code, said = run("compare", found, other, "--unit", "cm")
        assert code == 0 and " cm (" in said
    code, said = run(*render_it, "--points", 16, "--unit", "cm")
    assert code == 0 and "lengths in cm" in said
    code, said = run("localize", seen, "--unit", "mm", "-o", found)
    assert code == 2 and "says that its lengths are in cm" in said


def result(unit: str, power: str) -> Result:
    """A case of one light, found."""
    light = {"position": [1, 2, 3], "intensity": [5.0]}
    pair = {"true": 0, "found": 0, "distance": 0.02}
    comparison = {"count_true": 1, "count_found": 1, "count_right": True, "pairs": [pair]}
    return Result(
        **dict.fromkeys(("name", "scene", "claim", "brdf", "transport"), "a"),
        noise=0.0,
        outcome="passed",
        diagonal=5.0,
        unit=unit,
        power=power,
        lights={"true": [light], "found": [light | {"bound": [6.0]}]},
        comparison=comparison,
    )


def test_the_report_says_the_unit():
    """Tables, sentences, axes and colour bars: no metre where there is none."""
    page = environment().get_template("lights.html.j2")
    for unit, power, said, apart, bright in (
        ("m", "W/sr", "Positions in m and intensities in W/sr", "2 cm", "5 W/sr"),
        ("cm", "0.0001 W/sr", "Positions in cm and intensities in 0.0001 W/sr", "0.02 cm", "5"),
        ("unit", "", "Positions in the scene&#39;s own unit", "0.02 units", "5"),
    ):
        one = result(unit, power)
        (row,) = light_rows(one)
        assert (row.distance, row.true_intensity) == (apart, bright)
        text = page.render(result=one, lights=[row])
        assert said in text
        fields = {"D": np.ones((2, 2)), "extent": [0, 1, 0, 1], "height": 0.5}
        drawn = slices(fields, None, [], unit, power)["D"]
        title = drawn.layout.xaxis.title.text
        assert title == ("x" if unit == "unit" else f"x in {unit}")
