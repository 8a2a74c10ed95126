"""The study of assumed materials: its rooms, its map, and a page for each cell."""

from __future__ import annotations

import base64
from dataclasses import asdict

import numpy as np
import pytest

from lightloc import PointLights
from render import relight
from validation.draw import unfolded
from validation.jobs import Ended, write_text
from validation.report import write_study
from validation.studies import table
from validation.studies.brdf import ASSUMED, STUDY, heat, label, names
from validation.studies.brdf_rooms import MATERIALS, room_of
from validation.studies.brdf_trial import brdf, observed
from validation.studies.study import tabulate

ROWS = ("diffuse-diffuse-direct", "diffuse-ggx3-direct")


@pytest.fixture(scope="module")
def ended() -> dict[str, Ended]:
    """A right cell and a wrong one."""
    scenes = [f"{row}-000" for row in ROWS]
    return {name: Ended(name, "code", 1.0, asdict(brdf(name))) for name in scenes}


def test_every_material_is_in_the_map_as_itself_and_as_six_others():
    rows = {name.rsplit("-", 1)[0] for name in names(1)}
    assert len(MATERIALS) >= 10 and len(ASSUMED) >= 6
    for material in MATERIALS:
        for transport in ("direct", "full"):
            assert f"{material}-{material}-{transport}" in rows
            assert all(f"{material}-{other}-{transport}" in rows for other in ASSUMED)
    assert all(label(row) for row in rows)


def test_rooms_differ_in_their_material_alone():
    """The same points in every material; other radiance in each."""
    lights = PointLights([[1.4, 3.1, 2.1], [4.1, 1.4, 1.2]], [20.0, 10.0])
    seen = {name: observed(relight(room_of(name), lights), "direct", 0) for name in MATERIALS}
    first = seen["diffuse"]
    for name, q in seen.items():
        assert np.allclose(q.positions, first.positions), name
        off = np.abs(q.radiance - first.radiance).mean() / first.radiance.mean()
        assert name == "diffuse" or off > 0.02, name


def test_right_material_is_right_and_a_wrong_one_is_not_believed(ended):
    right, wrong = (ended[f"{row}-000"].record for row in ROWS)
    assert right["found"] == right["lights"] == 2 and not right["outside"]
    assert right["reason"] == "CONVERGED" and abs(right["brighter"]) < 1
    assert wrong["reason"] not in ("CONVERGED", "EXTENDED") and wrong["said"]
    assert wrong["named"] != "nothing"


def test_each_cell_has_a_page_with_its_lights_and_its_command(ended, tmp_path):
    """As a browser would follow it: the tile leads to the page, and the page back."""
    chosen = [f"{row}-000" for row in ROWS]
    rows = tabulate(STUDY, chosen, ended)
    how = {"date": "2026-01-01T00:00:00+00:00"}
    write_text(tmp_path / "study.json", table.document(STUDY, 1, rows, list(ended.values()), how))
    index = write_study(tmp_path).read_text()
    for row in ROWS:
        assert f'href="index-cells/{row}.html"' in index
        page = (tmp_path / "index-cells" / f"{row}.html").read_text()
        assert f"lightloc study brdf --scenes 1 --row {row}" in page
        assert 'href="../index.html"' in page and "true 2" in page
        assert page.count('data-figure="walls') == 2
    assert '<th scope="row">found 1</th>' in page
    assert "".join(f" --row {row}" for row in ROWS) in index  # what repeats all that was run
    tiles = [tile for line in heat(list(ended.values()))[0].tiles for tile in line if tile]
    assert {tile.row: tile.outcome for tile in tiles} == {ROWS[0]: "passed", ROWS[1]: "shown"}


def test_the_walls_come_back_as_they_were_kept(ended):
    """Half floats are near enough: 4 mm in a room of 5.5 m."""
    kept = np.frombuffer(base64.b64decode(ended[f"{ROWS[0]}-000"].record["walls"]), np.float16)
    points = kept.reshape(-1, 5)[:, :3].astype(float)
    low, high = room_of("diffuse").bounds
    off = np.minimum(np.abs(points - low), np.abs(points - high)).min(axis=1)
    assert len(points) == 2048 and off.max() < 0.004
    figure = unfolded(points, points[:, 0], [], "x", ("Magma", 0.0, 1.0))
    x, y = (np.array(figure.data[1][axis]) for axis in "xy")
    w, d, h = high - low
    assert -h - 0.01 <= x.min() and x.max() <= 2 * w + h + 0.01
    assert -h - 0.01 <= y.min() and y.max() <= d + h + 0.01
