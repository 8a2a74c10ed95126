"""lightloc figures: the files, that they repeat, and that each shows what its caption says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from validation.figures import cluster, draw, four_lights, noise, one_light

MAIN = "from validation.cli import main; main()"


def QUIET(share: float) -> None:
    """Nobody watches."""


def figures(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", MAIN, "figures", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


def test_only_what_is_asked_for(tmp_path):
    """PNG and SVG of the figures asked for, and a page that names the paper's and ours."""
    done = figures("-o", "f", "--only", "4", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    names = sorted(path.name for path in (tmp_path / "f").iterdir())
    assert names == ["figure4.png", "figure4.svg", "index.html"]
    assert (tmp_path / "f" / "figure4.png").stat().st_size > 20_000
    page = (tmp_path / "f" / "index.html").read_text()
    assert noise.TITLE in page
    assert "http" not in page


@pytest.mark.parametrize("arguments", [("--only", "9"), ("-o", "taken/f")])
def test_bad_input(tmp_path, arguments):
    (tmp_path / "taken").write_text("a file")
    done = figures(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_same_bytes():
    """The same data are the same SVG, without a date."""
    first, again = (draw.written(noise.drawing(QUIET).figure, "svg") for _ in range(2))
    assert first == again


def test_figure_1_bounds():
    """D at the light is no less than its intensity, but for half a cell; I is no less than D."""
    d = one_light.data()
    assert d.bound_at_light > 0.99 * one_light.BRIGHT
    D = d.scene.fields[0]
    assert (d.diffuse >= D * (1 - 1e-5)).all()


def test_figure_2_counts_and_order():
    """More colours near a light than away; three candidates first, four lights at last."""
    d = four_lights.data(QUIET)
    near, away = d.colours
    assert near > 2 * away
    assert len(d.first.candidates) == 3
    assert len(d.answer) == 4
    assert d.worst < 0.01


def test_figure_3_failures():
    """One ends with too few lights at a low error, the other without a solution."""
    replaced, unfound = cluster.data(QUIET)
    assert replaced.solution
    assert len(replaced.lights) < cluster.LIGHTS
    assert not unfound.solution


def test_figure_4_noise_takes_limiters():
    """About a light in the middle, less than half as many limiters with noise as without."""
    clean, noisy = noise.data().colours()
    assert noisy < clean / 2
