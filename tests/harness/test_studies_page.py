"""A study as it is run and shown: the command, its files, its page, and the report's link to it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from test_report import a_result, figures, save_run
from test_studies import record
from typer.testing import CliRunner

from validation.cli import app
from validation.commands.study import find
from validation.jobs.store import Ended
from validation.report import write, write_study
from validation.studies import many, points, table
from validation.studies.study import Study, tabulate

LIGHTLOC = Path(sys.executable).with_name("lightloc")
HOSTILE = "</script><script>alert('x')</script> <b>"
MADE = {
    **{"date": "2026-11-22T17:00:00+00:00", "commit": "abc1234", "cpus": 2, "machine": "x86_64"},
    "versions": {"lightloc": "0.1.0", "python": "3.11.7"},
}


@dataclass(frozen=True)
class Fake:
    """A trial in short: fields of the real one, as the studies' tables need them."""

    name: str
    lights: int = 8
    found: int = 8
    missed: int = 0
    ghosts: int = 0
    position: float = 1e-4
    intensity: float = 1e-3
    solved: bool = True
    tight: bool = True
    reason: str = "CONVERGED"
    verdicts: tuple[str, ...] = ()
    certificate: float = 3.0
    chi2: float = 1.0
    seconds: float = 0.5


def quick(name: str) -> Fake:
    """Fine, but for one that is wrong and sure of it, and one that crashes until it is mended."""
    if name == "lights-20-001" and not Path(os.environ["MENDED"]).exists():
        raise ValueError("not yet")
    return Fake(name, solved=name != "lights-15-000")


def of_fakes(name: str) -> Study:
    return replace(find(name), one=quick)


@pytest.fixture
def ran(tmp_path, monkeypatch) -> tuple[Path, Any]:
    """The study of many lights with fakes, two scenes per row, after its first run."""
    monkeypatch.setattr("validation.commands.study.find", of_fakes)
    monkeypatch.setenv("MENDED", str(tmp_path / "mended"))
    return tmp_path / "out", run(tmp_path / "out")


def run(out: Path) -> Any:
    command = ["study", "many", "--scenes", "2", "--jobs", "1", "-o", str(out)]
    return CliRunner().invoke(app, command)


def test_a_study_is_run_told_written_and_resumed(ran, tmp_path):
    """A crash makes exit code 1 and is told; the next run tries that scene alone."""
    out, done = ran
    assert done.exit_code == 1, done.output
    assert "crashed lights-20-001: ValueError: not yet" in done.stderr
    assert "goals missed: 15 lights, Unsolved say so 0.00 of 1 (goal ≥ 1)" in done.stdout
    assert "1 of 8 scenes crashed. A row has 2 scenes here, of 50." in done.stdout
    files = {path.name for path in (out / "many").iterdir()}
    assert files == {"scenes.jsonl", "study.md", "study.json", "index.html"}
    (tmp_path / "mended").touch()
    again = run(out)
    assert again.exit_code == 0 and "crashed" not in again.output
    assert len((out / "many" / "scenes.jsonl").read_text().splitlines()) == 8 + 1


def test_json_and_markdown_hold_what_the_page_shows(ran):
    out, _ = ran
    content = json.loads((out / "many" / "study.json").read_text())
    assert content["command"] == "lightloc study many --scenes 2"
    assert [row["name"] for row in content["rows"]][-1] == "every row"
    assert {scene["name"]: scene["doubt"] for scene in content["scenes"] if scene["doubt"]} == {
        "lights-15-000": "not solved, yet sure of it",
        "lights-20-001": "crashed",
    }
    text = (out / "many" / "study.md").read_text()
    assert "| 8 lights | 1.00 (≥ 0.95) |" in text and "**0.00 of 1 (≥ 1)**" in text
    assert content["made"]["date"] in text and "`lightloc study many --scenes 2`" in text


def test_page_says_what_was_asked_what_came_out_and_how_to_repeat_it(ran):
    """Goals met are green, missed ones red; what needs a look is listed, crashed ones first."""
    out, _ = ran
    page = out / "many" / "index.html"
    text = page.read_text()
    assert many.STUDY.question in text and "2 of 5 goals are met" not in text
    assert re.search(r"\d of \d goals are met", text) and "commit" in text
    assert 'class="n met"' in text and 'class="n wrong"' in text
    assert '<code id="command">lightloc study many --scenes 2</code>' in text
    listed = re.findall(r'<tr data-outcome="(\w+)">\s*<td data-sort="([^"]*)"', text)
    assert listed == [("crashed", "lights-20-001"), ("shown", "lights-15-000")]
    assert figures(page)["curve"]["data"][0]["x"] == [8, 10, 15, 20]
    for link in links(page):
        assert not re.match(r"(?i)(https?:)?//", link)
        assert link.startswith("data:") or (page.parent / link).is_file(), link


def links(page: Path) -> list[str]:
    return re.findall(r'(?:href|src)="([^"]*)"', page.read_text())


def save(folder: Path, study: Study, scenes: list[Ended], names: list[str]) -> Path:
    rows = tabulate(study, names, {scene.name: scene for scene in scenes})
    folder.mkdir(parents=True)
    (folder / "study.json").write_text(table.document(study, 1, rows, scenes, MADE))
    return folder


def test_report_links_to_the_studies_that_were_run(tmp_path):
    """Each with its goals, in the studies' order; none where none was run, hostile or not."""
    save_run(tmp_path, [a_result("one", "crashed")])
    assert not [link for link in links(write(tmp_path)) if "study" in link]
    names = many.STUDY.names(1)
    hostile = record(names[0], solved=False, reason=HOSTILE)
    scenes = [Ended(names[0], "", 1.0, hostile), Ended(names[1], "", 1.0, None, HOSTILE)]
    save(tmp_path / "studies" / "points", points.STUDY, [], points.STUDY.names(1))
    save(tmp_path / "studies" / "many", many.STUDY, scenes, names)
    index = write(tmp_path)
    found = [link for link in links(index) if "study" in link]
    assert found == ["study-many.html", "study-points.html"]
    assert "0 of 2 goals met" in index.read_text()
    for link in found:
        page = tmp_path / link
        assert "index.html" in links(page) and HOSTILE not in page.read_text()
        assert all(own.startswith("data:") or (tmp_path / own).is_file() for own in links(page))
    assert "No scene has been run yet." in (tmp_path / "study-points.html").read_text()


@pytest.mark.parametrize("content", ["", "[]", '{"schema": 1, "rows": []}', '{"schema": 7}'])
def test_a_broken_study_is_named(tmp_path, content, refuses):
    (tmp_path / "study.json").write_text(content)
    with refuses(str(tmp_path / "study.json")):
        write_study(tmp_path)


BAD = {
    "unknown study": (("nothing",), "nothing", "occluders"),
    "no study": ((), "name", "Missing"),
    "scenes": (("many", "--scenes", "0"), "--scenes", "1"),
    "jobs": (("many", "--jobs", "-1"), "--jobs", "0"),
    "folder is a file": (("many", "-o", "file"), "file", "written"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_before_any_work(case, tmp_path):
    """Exit code 2, one sentence that names it, and nothing written."""
    arguments, *said = BAD[case]
    (tmp_path / "file").write_text("a file")
    done = subprocess.run(
        [LIGHTLOC, "study", *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("lightloc: ") and all(words in line for words in said), line
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
