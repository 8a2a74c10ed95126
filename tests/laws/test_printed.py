"""What an answer shows: one table, numbers from 1, and nothing that fills a screen."""

from __future__ import annotations

import dataclasses
import sys
import types
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import lightloc
from lightloc import (
    Count,
    Grid,
    Kind,
    Lambert,
    Localization,
    Observations,
    Perimeter,
    Plastic,
    PointLights,
    SolidAngle,
    Verdict,
    cramer_rao,
    localize,
    radiance,
)
from lightloc.answer.printed import _known

LIGHTS = PointLights([[0.5, -0.3, 1.2], [-1.0, 1.0, 1.0]], [10.0, 5.0])
N = 400


def seen(**fields) -> Observations:
    floor = np.random.default_rng(0).uniform(-2, 2, (N, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (N, 1))
    dark = Observations(
        positions=floor,
        normals=up,
        directions=up,
        radiance=np.zeros(N),
        material=Lambert(albedo=np.linspace(0.4, 0.6, N)),
        **fields,
    )
    B = radiance(dark, LIGHTS)
    return dark.with_radiance(B, 0.002 * B.max())


@pytest.fixture(scope="module")
def found() -> Localization:
    return localize(seen(), bounds=[[-2, -2, 0.1], [2, 2, 2]])


def about(found: Localization, *lights: int) -> Localization:
    """The same with a verdict on some lights, by their indices."""
    verdict = Verdict(Kind.CLUSTER, lights, "Said of <them>.")
    return replace(found, verdicts=(verdict,))


def test_lights_are_numbered_from_1_in_their_own_row(found):
    _, head, first, second, said = str(about(found, 1)).split("\n")
    assert head.split("  ")[1].strip() == "light"
    assert first.split()[0] == "1"
    assert "0.5" in first
    assert "CLUSTER" not in first
    assert second.split()[0] == "2"
    assert second.endswith("CLUSTER")
    assert said == "  Said of <them>."


def test_columns_line_up(found):
    """What stands below a heading begins where it does."""
    _, head, *rows = str(replace(found, verdicts=())).split("\n")[:4]
    for title in ("light", "position", "intensity"):
        at = head.index(title)
        assert all(row[at] != " " and row[at - 2 : at] == "  " for row in rows)


def test_a_notebook_shows_the_same_table(found):
    cells = []

    class Cells(HTMLParser):
        def handle_data(self, data: str) -> None:
            cells.append(data)

    page = about(found, 0, 1)._repr_html_()
    Cells().feed(page)
    assert "Said of &lt;them&gt;." in page
    lines = str(about(found, 0, 1)).split("\n")
    for cell in cells:
        assert any(cell in line for line in lines)
    assert cells.count("CLUSTER") == 2


def test_numbers_in_files_are_those_of_the_sentences(found, tmp_path):
    """From 1 as JSON; indices again in Python once loaded."""
    answer = about(found, 1)
    assert [row["light"] for row in answer.to_dict()["lights"]] == [1, 2]
    assert answer.to_dict()["verdicts"][0]["lights"] == [2]
    answer.save(tmp_path / "found.npz")
    assert Localization.load(tmp_path / "found.npz").verdicts[0].lights == (1,)


def test_every_sentence_numbers_from_1():
    """Two lights near each other, one of which is faint: each verdict on one light names it."""
    near = PointLights([[0.5, -0.3, 1.2], [0.55, -0.3, 1.2]], [10.0, 5.0])
    q = seen()
    B = radiance(q, near)
    noise = 0.02 * B.max() * np.random.default_rng(1).normal(size=B.shape)
    told = localize(q.with_radiance(B + noise, 0.02 * B.max()), bounds=[[-2, -2, 0.1], [2, 2, 2]])
    single = [v for v in told.verdicts if len(v.lights) == 1]
    assert single
    for verdict in single:
        assert f"ight {verdict.lights[0] + 1} " in verdict.sentence


def test_a_data_frame_where_pandas_is(found, monkeypatch):
    """Its columns are the answer's numbers; without pandas it is one sentence."""
    pandas = types.ModuleType("pandas")
    pandas.RangeIndex = lambda first, last, name: (name, list(range(first, last)))
    pandas.DataFrame = lambda columns, index: (columns, index)
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    columns, index = about(found, 1).to_frame()
    assert index == ("light", [1, 2])
    np.testing.assert_array_equal(columns["y_error"], found.position_error[:, 1])
    np.testing.assert_array_equal(columns["intensity"], found.lights.intensities[:, 0])
    assert columns["verdicts"] == ["", "CLUSTER"]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ValueError, match="pip install pandas"):
        found.to_frame()


def test_no_repr_fills_a_screen(found):
    """Of every public value that holds arrays of hundreds of observations: under 500 characters."""
    q = seen()
    values = [
        found,
        q,
        found.noise,
        found.limits,
        found.counts[0],
        cramer_rao(q, LIGHTS),
        q.material,
        Plastic(alpha=np.full(N, 0.2)),
        Grid.over([[-2, -2, 0], [2, 2, 2]], 1000),
        SolidAngle(q.positions),
        Perimeter(np.zeros(N, int), np.linspace(0, 1, N), np.ones(1)),
    ]
    for value in values:
        assert 0 < len(repr(value)) < 500, type(value).__name__
    assert repr(LIGHTS).startswith("PointLights(positions=[[0.5, -0.3, 1.2], [-1, 1, 1]]")
    assert isinstance(found.counts[0], Count)


def test_public_values_with_arrays_have_short_reprs():
    """None is left with the one that dataclasses write, which shows whole arrays."""
    long = []
    for name in lightloc.__all__:
        value = getattr(lightloc, name)
        if isinstance(value, type) and dataclasses.is_dataclass(value):
            shown = [f for f in dataclasses.fields(value) if f.repr and "NDArray" in str(f.type)]
            generated = value.__repr__.__module__ == value.__module__
            if shown and generated and "Localization" not in name:
                long.append(name)
    assert long == []


@pytest.mark.parametrize(
    ("error", "said"),
    [(np.inf, "± inf"), (0.0042, "2.0000 ± 0.0042"), (26.3, "2 ± 26"), (263.0, "0 ± 260")],
)
def test_an_error_is_said_whatever_its_size(error, said):
    """Two digits of it, no exponent, and ``inf`` where nothing tells; none where none is stated."""
    assert said in _known(2.0, error, "m")
    assert "±" not in _known(2.0, np.nan, "m")
