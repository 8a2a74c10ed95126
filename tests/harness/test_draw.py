"""What the figures of pages hold: data at its metres, marks of every light, JSON that is safe."""

from __future__ import annotations

import base64
import json
import math
from io import BytesIO

import matplotlib.image
import numpy as np
import pytest
from test_report import BOX, FACES

from validation import draw
from validation.draw.colours import place
from validation.draw.marks import FOUND, SYMBOLS, TRUE
from validation.draw.mesh import creases, section
from validation.records import Curve, Line, Step

EXTENT = (0.0, 4.0, 0.0, 5.0)
ROOM = {"vertices": BOX, "faces": FACES}
LIGHTS = [
    draw.Light("true", (1, 2, 1.5), "true light 1"),
    draw.Light("missed", (3, 2, 1.5), "true light 2"),
    draw.Light("found", (1.1, 2, 1.5), "found light 1", partner=(1, 2, 1.5)),
    draw.Light("ghost", (2, 4, 1.5), "found light 2"),
]
HOSTILE = "</script><script>alert('x')</script>"


def sliced(**arrays):
    """Figures of fields at 1.5 m."""
    whole = {"D": np.ones((6, 5)), "extent": np.array(EXTENT), "height": 1.5}
    return draw.slices(whole | arrays, ROOM, LIGHTS)


def a_step(lights: int | None, chi2: float | None, step: str = "add") -> Step:
    return Step(step=step, lights=lights, chi2=chi2)


def lit(figure) -> dict[str, list[list[float]]]:
    """kind: places of the marks that can be pointed at."""
    return {
        trace.name: np.stack([trace[axis] for axis in "xyz" if axis in trace], axis=1).tolist()
        for trace in figure.data
        if trace.hovertext is not None and trace.name in SYMBOLS
    }


def test_a_box_shows_its_twelve_edges_and_no_diagonal():
    assert len(creases(BOX, FACES, 1e-6)) == 12
    walls = section(ROOM, 1.5)
    assert np.linalg.norm(walls[:, 0] - walls[:, 1], axis=1).sum() == pytest.approx(2 * (4 + 5))


@pytest.mark.parametrize("chi2", [[9.0, 0.5, 2.0], [9.0, None, 0.0], [4.0, math.pi, None]])
def test_a_searchs_curve_is_its_history(chi2):
    """Each chi-square at its step; a logarithmic axis just where all are above zero."""
    figure = draw.search_curve([a_step(k, value) for k, value in enumerate(chi2)])
    (curve,) = figure.data
    known = [(step, value) for step, value in enumerate(chi2, start=1) if value is not None]
    assert list(zip(curve.x, curve.y, strict=True)) == known
    assert (figure.layout.yaxis.type == "log") == all(value > 0 for _, value in known)
    assert curve.hovertext[0] == "add, 0 lights"


def test_a_search_of_one_step_has_no_curve():
    assert draw.search_curve([a_step(1, 3.0), a_step(2, None)]) is None


def test_a_studys_curve():
    """A dashed line has the colour of the line before it, any other its own; gaps stay gaps."""
    lines = [
        Line("a", [1, 2], [0.5, None], error=[0.1, None]),
        Line("b", [1, 2], [0.4, 0.3], kind="dash"),
        Line("c", [1, 4], [0.2, 0.1]),
    ]
    figure = draw.study_curve(Curve("t", "n", "share", tuple(lines), ((0.95, "goal"),), log_x=True))
    colours = [trace.line.color for trace in figure.data]
    assert colours[0] == colours[1] != colours[2]
    assert [list(trace.y) for trace in figure.data] == [line.y for line in lines]
    assert list(figure.data[0].error_y.array) == [0.1, None]
    assert figure.layout.xaxis.type == "log" and list(figure.layout.xaxis.ticktext) == list("124")
    assert [shape.y0 for shape in figure.layout.shapes] == [0.95]
    assert [note.text for note in figure.layout.annotations] == ["goal"]


def test_a_slice_lies_at_its_metres():
    """Cells fill the extent, row 0 at its lower end; walls close around it; all lights marked."""
    D = np.arange(1.0, 31.0).reshape(6, 5)
    D[0, :3] = np.inf, np.nan, 0
    figure = sliced(D=D)["D"]
    field = figure.data[0]
    left, below = field.x0 - field.dx / 2, field.y0 - field.dy / 2
    ends = (left, left + 5 * field.dx, below, below + 6 * field.dy)
    assert ends == pytest.approx(EXTENT)
    assert np.isnan(field.z[0, :2]).all() and field.z[0, 2] == pytest.approx(field.zmin)
    np.testing.assert_allclose(field.z[1:], np.log10(D[1:]), rtol=1e-6)
    assert [math.log10(float(t)) for t in field.colorbar.ticktext] == pytest.approx(
        list(field.colorbar.tickvals)
    )
    walls = np.stack([figure.data[1].x, figure.data[1].y], axis=1)
    ends = walls[np.isfinite(walls).all(axis=1)]
    np.testing.assert_array_equal([ends.min(axis=0), ends.max(axis=0)], [[0, 0], [4, 5]])
    assert ((ends == [0, 0]) | (ends == [4, 5])).any(axis=1).all()
    assert lit(figure) == {light.kind: [list(light.at[:2])] for light in LIGHTS}
    assert figure.layout.yaxis.scaleanchor == "x"


def test_limiters_have_the_colours_of_their_places():
    """Pixels within the frame are the limiters', row 0 at ymin; the frame is the walls'."""
    limiter = np.zeros((50, 40, 3))
    limiter[...] = (4, 2.5, 1.5)
    limiter[0] = (2, 0, 0)
    limiter[-1, 0] = np.nan
    figure = sliced(limiter=limiter)["L"]
    image = figure.data[0]
    text = image.source.removeprefix("data:image/png;base64,")
    painted = np.round(255 * matplotlib.image.imread(BytesIO(base64.b64decode(text))))
    wide, deep = (
        round(float(-at / step) + 0.5)
        for at, step in zip((image.x0, image.y0), (image.dx, image.dy), strict=True)
    )
    assert painted.shape == (50 + 2 * deep, 40 + 2 * wide, 4)
    inner = painted[deep:-deep, wide:-wide]
    low, high = BOX.min(axis=0), BOX.max(axis=0)
    for pixel, at in ((inner[0, 7], (2, 0, 0)), (inner[20, 7], (4, 2.5, 1.5))):
        np.testing.assert_allclose(pixel[:3], place(np.array(at), low, high), atol=1)
    assert inner[-1, 0, 3] == 0 and (inner[:-1, :, 3] == 255).all()
    corner = place(np.array([0, 0, 1.5]), low, high)
    np.testing.assert_array_equal(painted[0, 0, :3], corner)


WRONG = {
    "extent": [(0, 0, 0, 5), (0, 4, 5, 0), (0, math.nan, 0, 5), (0, 4)],
    "V": [np.ones(5), np.ones((6, 5, 3)), np.ones((0, 5))],
    "limiter": [np.ones((6, 5))],
}


@pytest.mark.parametrize(("name", "value"), [(k, v) for k, vs in WRONG.items() for v in vs])
def test_what_is_no_slice_is_refused(name, value, refuses):
    assert set(sliced(V=np.ones((6, 5)), limiter=np.ones((6, 5, 3)))) == set("DVL")
    with refuses(name):
        sliced(**{name: np.array(value)})


def test_the_room_shows_what_was_observed():
    """Points at their places, B's logarithm as their colour, and normals that look inwards."""
    points = np.array([[0, 2, 1], [4, 2, 1], [2, 2, 0], [2, 2, 2]], dtype=float)
    B, z = np.array([1.0, 10, 100, 0]), np.array([0.5, -1, np.nan, 2])
    arrays = {**ROOM, "points": points, "radiance": B[:, None], "residual": z}
    figure = draw.room(arrays, LIGHTS)
    first, second = figure.data[:2]
    for trace in (first, second):
        np.testing.assert_array_equal(np.stack([trace.x, trace.y, trace.z], axis=1), points)
        np.testing.assert_array_equal(trace.customdata[:, 3:], np.stack([B, z], axis=1))
        inwards = [[1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, 0]]
        np.testing.assert_array_equal(trace.customdata[:, :3], inwards)
    np.testing.assert_array_equal(first.marker.color, [0, 1, 2, 0])  # the dark one is darkest
    np.testing.assert_array_equal(second.marker.color, z)
    assert lit(figure) == {light.kind: [list(light.at)] for light in LIGHTS}
    links = figure.data[4]
    np.testing.assert_allclose([links.x[:2], links.y[:2]], [[1, 1.1], [2, 2]], rtol=1e-6)
    without = draw.room({k: v for k, v in arrays.items() if k != "residual"}, [])
    assert sum(trace.customdata is not None for trace in without.data) == 1


def test_outliers_are_crossed():
    """Each at its place, under a legend of its own and with the words that say where that is."""
    points = np.array([[0, 2, 1], [4, 2, 1], [2, 2, 0], [2, 2, 2]], dtype=float)
    arrays = {**ROOM, "points": points, "radiance": np.ones((4, 1))}
    which = {"outlier": np.array([0, 2, 1, 2]), "places": np.array(["at shadows' edges", "on 'a'"])}
    edge, table = [t for t in draw.room(arrays | which, []).data if t.name == "outlier"]
    np.testing.assert_array_equal([edge.x, edge.y, edge.z], points[2:3].T)
    np.testing.assert_array_equal([table.x, table.y, table.z], points[[1, 3]].T)
    assert (edge.hovertext, table.hovertext) == ("outlier, at shadows' edges", "outlier, on 'a'")
    assert edge.showlegend and not table.showlegend
    none = {"outlier": np.zeros(4, int), "places": np.zeros(0, str)}
    assert not [t for t in draw.room(arrays | none, []).data if t.name == "outlier"]


BROKEN = {
    "outlier": {"outlier": np.zeros(3), "places": np.array(["a"])},
    "points": {"points": np.zeros((4, 2))},
    "faces": {"faces": np.array([[0, 1, 99]])},
    "residual": {"residual": np.zeros(3)},
}


@pytest.mark.parametrize("which", BROKEN)
def test_a_broken_room_is_refused(which):
    whole = {**ROOM, "points": np.zeros((4, 3)), "radiance": np.ones((4, 1))}
    draw.room(whole, [])
    with pytest.raises(ValueError, match=r"face|points|residual|outlier"):
        draw.room(whole | BROKEN[which], [])


def test_many_points_are_thinned_and_it_is_said():
    points = np.random.default_rng(0).uniform(0, 3, (50_000, 3))
    arrays = {**ROOM, "points": points, "radiance": np.ones((50_000, 1))}
    figure = draw.room(arrays, [])
    assert len(figure.data[0].x) == 16_667
    assert figure.layout.annotations[0].text == "16,667 of 50,000 points are drawn"


def test_a_figure_in_a_page_is_safe_and_repeats():
    """No markup gets out, NaN is no JSON, and the same data give the same text."""
    steps = [a_step(None, value, HOSTILE) for value in (2.0, 1.0)]
    texts = [draw.embedded(draw.search_curve(steps)) for _ in range(2)]
    assert texts[0] == texts[1]
    assert not set("<>") & set(texts[0])
    assert json.loads(texts[0])["data"][0]["hovertext"] == [HOSTILE, HOSTILE]


def test_marks_tell_apart():
    """Every kind of light has a colour and symbol of its own, and print has the same colours."""
    assert len(set(SYMBOLS.values())) == len(SYMBOLS)
    assert TRUE["c"] == SYMBOLS["true"][1] == SYMBOLS["missed"][1]
    assert FOUND["edgecolors"] == SYMBOLS["found"][1] == SYMBOLS["ghost"][1]
