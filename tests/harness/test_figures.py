"""The figures: files that repeat and only those asked for, and what each must show, as a law.

Each law is judged on the data that its figure is drawn from, computed once. The tolerances: a cell
of the 2D grid is 1/256 m; 3D candidates count as a light's within 10 % of the scene's radius, as
far as a triangle of the sphere about p can lie from p with T = 15 % of it.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from lightloc import intensity_distance
from lightloc.answer.result import Reason
from validation import draw
from validation.commands.figures import MODULES, draw_all, figures_command
from validation.figures import cluster, four_lights, noise, one_light, three_d, wall_points
from validation.figures.plane import apart

QUICK = (1, 4)  # figures whose data take no search
NEAR = 0.10  # of the radius
LEAST_BYTES = 20_000  # an empty canvas of this size is smaller
ROUNDING = 1e-5  # D is computed in float32, 80 roundings at most


def nothing(share: float) -> None:
    assert 0 <= share <= 1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Figures 1 and 4, drawn."""
    out = tmp_path_factory.mktemp("figures")
    draw_all(QUICK, out)
    return out


@pytest.fixture(scope="module")
def one():
    return one_light.data()


@pytest.fixture(scope="module")
def four():
    return four_lights.data(nothing)


def test_only_the_asked_figures(folder):
    """Two figures asked for: their PNG and SVG, the page, and nothing else; whole and not empty."""
    names = [f"figure{number}.{kind}" for number in QUICK for kind in ("png", "svg")]
    assert sorted(path.name for path in folder.iterdir()) == sorted([*names, "index.html"])
    for name in names:
        assert (folder / name).stat().st_size > LEAST_BYTES
    for number in QUICK:
        assert (folder / f"figure{number}.png").read_bytes().startswith(b"\x89PNG")
        ElementTree.parse(folder / f"figure{number}.svg")


def test_the_page_shows_them_beside_the_papers_words(folder):
    page = (folder / "index.html").read_text()
    for module in (one_light, noise):
        assert module.TITLE.replace("'", "&#x27;") in page
        assert module.PAPER[:40] in page
    assert page.count("<img") == len(QUICK)
    assert "<script" not in page
    assert not list(folder.glob(".*"))  # no half file stays


def test_same_bytes(folder, tmp_path):
    """Drawn again, every SVG and PNG has the same bytes."""
    draw_all(QUICK, tmp_path)
    for path in [*tmp_path.glob("*.svg"), *tmp_path.glob("*.png")]:
        assert path.read_bytes() == (folder / path.name).read_bytes(), path.name


def test_other_data_other_bytes():
    """Negative control: a figure with one point elsewhere has other bytes."""

    def drawn(x: float) -> bytes:
        figure = draw.canvas(3, 3, "title")
        draw.true(figure.subplots(), [[x, 0.5, 0.0]])
        return draw.written(figure, "svg")

    assert drawn(0.5) == drawn(0.5)
    assert drawn(0.5) != drawn(0.6)


@pytest.mark.parametrize("number", [0, 7, -1])
def test_no_such_figure(number, tmp_path, refuses):
    """Refused in a sentence, before anything is made."""
    with refuses(f"--only {number}"):
        figures_command(out=tmp_path / "out", only=[1, number])
    assert not (tmp_path / "out").exists()


def test_nowhere_to_write(tmp_path, refuses):
    file = tmp_path / "file"
    file.write_text("mine")
    with refuses(str(file)):
        figures_command(out=file, only=[1])
    with refuses(str(file / "below")):
        figures_command(out=file / "below", only=[1])
    assert file.read_text() == "mine"


def test_every_figure_has_a_module():
    assert sorted(MODULES) == [1, 2, 3, 4, 5, 6]


def test_outline_colours_differ():
    """No two of 40 places along the outline share a colour, not even to one who sees no red-green.

    To such an eye a colour is, roughly, its lightness and its blue-yellow part.
    """
    rgb = draw.outline_colours(np.arange(40.0), 40.0)
    seen = np.stack([rgb @ [0.3, 0.6, 0.1], rgb[:, 2] - rgb[:, :2].mean(axis=1)], axis=1)
    for colours in (rgb, seen):
        between = apart(colours, colours) + 9 * np.eye(len(colours))
        assert between.min() > 0.02


def test_one_light(one):
    """Figure 1: at the light I of every point, D and its intensity are one number.

    Elsewhere I of x0 alone is the looser bound; the diffuse and the shiny one agree at the light.
    """
    scene = one.scene
    at_light, _ = intensity_distance(scene.q, scene.lights.positions)
    np.testing.assert_allclose(at_light, scene.lights.intensities, rtol=ROUNDING)
    D = scene.fields[0]
    for I in (one.diffuse, one.shiny):
        cell = apart(scene.grid.points, scene.lights.positions)[:, 0].argmin()
        assert np.isclose(I[cell], scene.lights.intensities[0, 0], rtol=0.05)
    assert (one.diffuse * (1 + ROUNDING) >= D).all()
    assert (0.5 * one.diffuse > D).mean() > 0.5
    assert not (one.shiny >= D).all()  # negative control: a shiny x0 bounds some places more


def test_four_lights(four):
    """Figure 2: more colours about a light than away; three candidates, then all four lights."""
    near, away = four.colours
    assert near > 3 * away
    true = four.scene.lights.positions
    assert sorted(apart(four.first.candidates, true).argmin(axis=1)) != [0, 1, 2, 3]
    assert len(four.first.candidates) == 3
    assert four.last.iteration > 0
    assert four.last.reason is Reason.CONVERGED
    assert len(four.answer) == 4
    assert four.worst < 0.01
    D, _ = intensity_distance(four.scene.q, true)
    assert (four.scene.lights.intensities * (1 - ROUNDING) <= D).all()


def test_clusters():
    """Figure 3: fewer lights than there are at a low error; and a room left without a solution."""
    replaced, unfound = cluster.data(nothing)
    assert replaced.solution
    assert len(replaced.lights) < len(replaced.scene.lights)
    two, between = cluster.closest(replaced.scene.lights)
    assert between < 0.1
    assert len(np.unique(apart(two, replaced.lights.positions).argmin(axis=1))) == 1
    assert not unfound.solution
    assert unfound.reason is not Reason.CONVERGED
    assert unfound.told_apart < 0.1 * unfound.last.iteration


def test_noise():
    """Figure 4: with noise few limiters take over the neighbourhood of the light; B is the same."""
    d = noise.data()
    clean, noisy = d.colours()
    assert noisy < clean / 3
    assert d.two_largest()[1] > 3 * d.two_largest()[0]
    z = (d.noisy.q.radiance - d.clean.q.radiance) / (noise.K * np.sqrt(d.clean.q.radiance))
    assert 0.9 < z.std() < 1.1  # 400 normal numbers: 0.035 standard deviations off 1


def test_three_dimensions():
    """Figure 5: two candidates at two lights; of three lights two at first, the third later."""
    d = three_d.data(nothing)
    assert len(d.of_two.candidates) == 2
    assert (d.off(d.of_two, d.two) < NEAR * d.two.radius).all()
    true = d.three.lights.positions
    at_first = apart(true, d.first.candidates).min(axis=1) < NEAR * d.three.radius
    at_last = apart(true, d.last.candidates).min(axis=1) < NEAR * d.three.radius
    assert at_first.sum() == 2
    assert at_last[~at_first].all()
    assert d.last.iteration > 0
    assert d.last.reason is Reason.CONVERGED


def test_wall_points():
    """Figure 6: the first maximum is at one light, what is left of it at the other; both found.

    Noise of 1 % on 16 000 points leaves positions good to a millimetre; 5 mm are allowed.
    """
    d = wall_points.data(nothing)
    true = d.room.lights.positions
    which = apart(np.stack([d.first, d.second]), true).argmin(axis=1)
    assert sorted(which) == [0, 1]
    off = apart(np.stack([d.first, d.second]), true).min(axis=1)
    assert off.max() < 0.2 * d.q.diagonal / 2
    assert len(d.two) == 2
    assert apart(true, d.two.positions).min(axis=1).max() < 0.005
    assert d.mse < 1.05 * d.expected
    assert len(d.one) == 1  # negative control: one light leaves far more than the noise
    assert apart(true, d.one.positions).min(axis=1).max() > 1
