"""Two runs, paired: counts and p by hand, and a control in which rooms are lost."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import binomtest
from typer.testing import CliRunner

from validation.cli import BAD_INPUT, app
from validation.commands.paired import KEPT, LOST
from validation.jobs.store import FILE, Ended
from validation.studies.paired import count, paired, sign_test

ROOMS = 12


def told(old: Path, new: Path) -> tuple[int, str]:
    """The command's exit code, and what it prints."""
    done = CliRunner().invoke(app, ["paired", str(old), str(new)])
    return done.exit_code, done.stdout


def a_scene(name: str, solved: bool = True, seconds: float = 2.0, **more: Any) -> Ended:
    record = {"name": name, "lights": 3, "found": 3, "reason": "CONVERGED", "solved": solved}
    return Ended(name, "any code", seconds, record | {"seconds": seconds} | more)


def of_table1(name: str, solved: bool, seconds: float) -> Ended:
    """What the search did stands beside what the paper's algorithm did, which must not matter."""
    ours = {"ours_solved": solved, "ours_seconds": seconds, "ours_found": 4, "ours_reason": "X"}
    return a_scene(name, not solved, 100.0, **ours)


def write(folder: Path, scenes: list[Ended]) -> Path:
    folder.mkdir(parents=True)
    (folder / FILE).write_text("".join(json.dumps(asdict(scene)) + "\n" for scene in scenes))
    return folder


def a_run(folder: Path, lost: int = 0, seconds: float = 2.0) -> Path:
    """A study of one row, whose first rooms are not solved."""
    scenes = [a_scene(f"lights-3-{i:03}", i >= lost, seconds * (i + 1)) for i in range(ROOMS)]
    write(folder / "many", scenes)
    return folder


@pytest.mark.parametrize(("lost", "won"), [(0, 0), (1, 0), (5, 0), (6, 0), (7, 2), (2, 7), (4, 4)])
def test_p_is_that_of_the_binomial_test(lost, won):
    exact = binomtest(lost, lost + won).pvalue if lost + won else 1.0
    assert sign_test(lost, won) == pytest.approx(exact, rel=1e-12)


def test_counts_and_ratios_by_hand(tmp_path):
    """Four rooms: both, only old, only new, and one that crashed; times 1 2 4 8 and 1 1 8."""
    old = [a_scene(f"a-{i}", solved=i != 2, seconds=2.0**i) for i in range(4)]
    new = [a_scene(f"a-{i}", solved=i != 1, seconds=s) for i, s in enumerate((1.0, 1.0, 8.0))]
    crashed = Ended("a-3", "other code", 1.0, None, "ValueError: no")
    pairs, alone = paired(
        write(tmp_path / "old", [*old, a_scene("a-4")]), write(tmp_path / "new", [*new, crashed])
    )
    row = count(pairs)
    assert (row.rooms, row.old, row.new, row.lost, row.won, alone) == (4, 3, 2, 2, 1, 1)
    assert row.p == 1.0 and not row.significantly_lost
    assert (row.ratio, row.each) == (0.5, 1.0)  # medians 1 and 2; ratios 1, 1/2 and 2
    assert [pair.said for pair in pairs][2:] == [
        "CONVERGED, 3 of 3 lights",
        "crashed: ValueError: no",
    ]


def test_equal_runs_lose_nothing(tmp_path):
    old, new = a_run(tmp_path / "old"), a_run(tmp_path / "new", seconds=1.0)
    code, said = told(old, new)
    assert code == KEPT
    assert "many/lights-3" in said and "every row" in said and "0.50" in said
    assert "lost" not in said


@pytest.mark.parametrize(("lost", "code"), [(1, KEPT), (5, KEPT), (6, LOST), (ROOMS, LOST)])
def test_a_lost_room_is_listed_and_a_significant_loss_fails(tmp_path, lost, code):
    """Negative control: 5 of 5 discordant pairs have p = 0.06, 6 of 6 have p = 0.03."""
    old, new = a_run(tmp_path / "old"), a_run(tmp_path / "new", lost)
    ended, said = told(old, new)
    assert ended == code
    listed = [line for line in said.splitlines() if line.startswith("lost: ")]
    assert len(listed) == lost
    assert listed[0] == "lost: many/lights-3-000 (CONVERGED, 3 of 3 lights)"
    ended, said = told(new, old)
    assert ended == KEPT and "lost: " not in said  # as many rooms won are no loss


def test_all_studies_below_a_folder_are_pooled(tmp_path):
    """Three rooms lost in either study are six in all; Table 1 keeps the search's own fields."""
    for run, solved in (("old", True), ("new", False)):
        a_run(tmp_path / run, 0 if solved else 3)
        rooms = [of_table1(f"noisy-4-{i:03}", solved, 3.0) for i in range(3)]
        write(tmp_path / run / "deep" / "table1", rooms)
    pairs, _ = paired(tmp_path / "old", tmp_path / "new")
    assert {pair.row for pair in pairs} == {"many/lights-3", "deep/table1/noisy-4"}
    assert count(pairs).lost == 6
    first = pairs[0]
    assert (first.old, first.new, first.new_seconds, first.said) == (
        True,
        False,
        3.0,
        "X, 4 of 3 lights",
    )
    assert told(tmp_path / "old", tmp_path / "new")[0] == LOST


def test_what_is_no_scene_is_passed_over_and_the_last_line_of_a_name_wins(tmp_path):
    folder = write(tmp_path / "old", [a_scene("a-0", solved=False), a_scene("a-0")])
    with (folder / FILE).open("a") as file:
        file.write('{"name": "a-1", "fing')
    other = Ended("b-0", "", 1.0, {"name": "b-0"})  # of a study in which nothing is solved
    pairs, alone = paired(folder, write(tmp_path / "new", [a_scene("a-0"), other]))
    assert [(pair.name, pair.old) for pair in pairs] == [("a-0", True)] and alone == 0


BAD = {
    "no folder": ("nothing", "nothing: no such folder"),
    "nothing in it": ("empty", "empty: holds no scenes.jsonl"),
    "other scenes": ("other", "other: has no scene in common with"),
    "no argument": (None, "Missing argument 'new'"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence_and_exit_code_2(case, tmp_path):
    new, said = BAD[case]
    old = a_run(tmp_path / "old")
    write(tmp_path / "other", [a_scene("a-0")])
    (tmp_path / "empty").mkdir()
    arguments = [old] if new is None else [old, tmp_path / new]
    done = subprocess.run(
        [Path(sys.executable).with_name("lightloc"), "paired", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == BAD_INPUT and not done.stdout
    (line,) = done.stderr.splitlines()
    assert line.startswith("lightloc: ") and said in line
