"""Two runs are told apart by what changed, and by nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from validation.diff import Change, Kind, changes
from validation.jobs import write_json
from validation.records import Limits, Result
from validation.report import write_diff

LIGHTLOC = Path(sys.executable).with_name("lightloc")
CASES, LIGHTS = 20, 3
POSITION, INTENSITY = 0.002, 0.01  # standard errors


def a_run(seed: int, **changed: dict[str, Any]) -> list[Result]:
    """Results of one suite with noise of their own; keywords change a case: a05={...}."""
    rng = np.random.default_rng(seed)
    room = np.random.default_rng(0)
    speed = rng.uniform(0.5, 2)  # of the machine
    results = []
    for i in range(CASES):
        true = room.uniform(1, 3, (LIGHTS, 3)), room.uniform(5, 20, (LIGHTS, 1))
        seconds = room.uniform(0.2, 5) * speed * np.exp(0.05 * rng.normal())
        change = changed.get(f"a{i:02d}", {})
        off = change.get("off", np.zeros(3))
        found = [
            {
                "position": (p + POSITION * rng.normal(size=3) + off * (k == 0)).tolist(),
                "intensity": (I * (1 + INTENSITY * rng.normal(size=1))).tolist(),
                "position_error": [POSITION] * 3,
                "intensity_error": (INTENSITY * I).tolist(),
            }
            for k, (p, I) in enumerate(zip(*true, strict=True))
        ]
        outcome = change.get("outcome", "passed")
        content = {
            **{"name": f"a{i:02d}", "scene": "s", "claim": "c", "brdf": "diffuse"},
            **{"transport": "direct", "noise": 0.01, "outcome": outcome, "diagonal": 7.0},
            "why": change.get("why", []),
            "lights": {
                "true": [
                    {"position": p.tolist(), "intensity": I.tolist()}
                    for p, I in zip(*true, strict=True)
                ],
                "found": found,
            },
            "comparison": {
                **{"count_true": LIGHTS, "count_found": change.get("count", LIGHTS)},
                "count_right": True,
                "pairs": [{"true": k, "found": k} for k in range(LIGHTS)],
            },
            "search": {"reason": change.get("reason", "converged")},
            "seconds": {"localize": seconds * change.get("slower", 1.0)},
        }
        results.append(Result.model_validate(content))
    return results


def named(found: list[Change]) -> list[tuple[str, Kind]]:
    return [(one.case, one.kind) for one in found]


def test_two_runs_with_other_noise_are_the_same():
    """Two hundred pairs, whatever the machine's speed: one in a thousand may name something."""
    seen = [changes(a_run(2 * i), a_run(2 * i + 1)).changes for i in range(200)]
    assert sum(map(bool, seen)) <= 2
    slow = {f"a{i:02d}": {"slower": 10.0} for i in range(CASES)}  # another machine
    assert changes(a_run(0), a_run(1, **slow)).changes == ()
    one = changes(a_run(0), a_run(1, **(slow | {"a11": {"slower": 30.0}})))
    assert named(list(one.changes)) == [("a11", Kind.SLOWER)]


def test_what_was_injected_is_found_and_nothing_else():
    """A light that moved, one that no longer is off, a time and a failure, fifty times."""
    far = np.array([0.0, 0.04, 0.0])  # 14 standard errors of the difference
    for i in range(50):
        before = a_run(1000 + 2 * i, a07={"off": far})
        after = a_run(
            1001 + 2 * i,
            a03={"off": far},
            a11={"slower": 3.0},
            a15={"outcome": "failed", "why": ["A light was missed."]},
        )
        assert named(list(changes(before, after).changes)) == [
            ("a15", Kind.FAILS),
            ("a03", Kind.WORSE),
            ("a11", Kind.SLOWER),
            ("a07", Kind.BETTER),
        ]


def test_the_other_way_round_is_the_opposite():
    """What fails now holds then, what is slower is faster, and what is gone is new."""
    before = a_run(0, a01={"outcome": "crashed"}, a02={"slower": 4.0})
    after = a_run(1, a04={"reason": "no_gain"}, a05={"count": 4})[:-1]
    there, back = changes(before, after), changes(after, before)
    assert named(list(there.changes)) == [
        ("a04", Kind.WORSE),
        ("a05", Kind.WORSE),
        ("a01", Kind.HOLDS),
        ("a02", Kind.FASTER),
        ("a19", Kind.GONE),
    ]
    assert dict(named(list(back.changes))) == {
        **{"a01": Kind.FAILS, "a02": Kind.SLOWER, "a05": Kind.BETTER},
        **{"a04": Kind.ANSWER, "a19": Kind.NEW},
    }
    assert there.bad == 3 and back.bad == 1  # a time decides nothing


def test_how_sure_an_answer_is_may_be_chance_in_other_data():
    """In the same data it is not; that the data are no longer explained is told of any."""
    sure, unsure, wrong = (
        a_run(0, a04={"reason": reason}) for reason in ("converged", "undecided", "no_gain")
    )
    assert named(list(changes(sure, unsure).changes)) == [("a04", Kind.ANSWER)]
    unsure, wrong = (
        [result.model_copy(update={"seed": 1}) for result in run] for run in (unsure, wrong)
    )
    assert changes(sure, unsure).changes == ()
    assert named(list(changes(sure, wrong).changes)) == [("a04", Kind.WORSE)]


def test_other_data_take_other_time():
    """Three times as long is a change for the same data, and chance for others; ten is none."""
    before = a_run(0)
    for slower, same, other in (
        (3.0, [("a11", Kind.SLOWER)], []),
        (10.0, *[[("a11", Kind.SLOWER)]] * 2),
    ):
        after = a_run(1, a11={"slower": slower})
        assert named(list(changes(before, after).changes)) == same
        drawn = [result.model_copy(update={"seed": 1}) for result in after]
        assert named(list(changes(before, drawn).changes)) == other


def test_a_jitter_of_a_tenth_of_a_second_is_no_change():
    """What a build server did: 0.73 s, then 0.85 s, where all the others took 0.77 times as long.

    Three times as long is a change in a second's search, and is not in a twentieth of one.
    """
    rng = np.random.default_rng(0)

    def timed(name: str, before: float, after: float) -> list[tuple[str, Kind]]:
        runs = [a_run(seed)[:10] for seed in (0, 1)]
        for k, run in enumerate(runs):
            for result in run:
                others = 1.2 * (0.77 if k else 1.0) * np.exp(0.05 * rng.normal())
                mine = result.name == name
                result.seconds["localize"] = (before, after)[k] if mine else others
        return named(list(changes(*runs).changes))

    assert timed("a03", 0.73, 0.85) == []
    assert timed("a03", 1.0, 3.0 * 0.77) == [("a03", Kind.SLOWER)]
    assert timed("a03", 0.05, 0.15 * 0.77) == []


def test_values_without_errors_are_not_compared():
    """Another solver need not state any: its outcomes are compared alone."""
    runs = [a_run(0), a_run(1, a03={"off": np.ones(3)})]
    for run in runs:
        for result in run:
            for light in result.lights.found:
                light.position_error[:] = [None] * 3
                light.intensity_error[:] = [None]
    assert changes(*runs).changes == ()


@pytest.fixture
def folders(tmp_path) -> tuple[Path, Path]:
    """Two runs on disk; a case of the second fails, with a sentence that is no HTML."""
    hostile = ["<script>alert(1)</script> & more"]
    runs = {"old": a_run(0), "new": a_run(1, a00={"outcome": "failed", "why": hostile})}
    for name, run in runs.items():
        for result in run:
            folder = tmp_path / name / "cases" / result.name
            folder.mkdir(parents=True)
            write_json(folder / "result.json", {"schema": 1, **result.model_dump(mode="json")})
        counts = {"passed": CASES, "failed": 0, "shown": 0, "crashed": 0}
        suite = {"schema": 1, "suite": "s", "cases": [r.name for r in run], **counts}
        write_json(tmp_path / name / "suite.json", suite)
    return tmp_path / "old", tmp_path / "new"


def test_the_command_exits_by_what_got_worse(folders, tmp_path):
    """1 with the failure named first, 0 the other way round and for one run with itself."""

    def diff(*words: Any) -> subprocess.CompletedProcess[str]:
        words = (LIGHTLOC, "diff", *words)
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)

    old, new = folders
    done = diff(old, new, "--page", "d.html")
    assert done.returncode == 1, done.stderr
    assert done.stdout.splitlines()[:2] == [
        "Fail now:",
        "  a00: <script>alert(1)</script> & more",
    ]
    assert done.stdout.endswith("1 for the worse, 0 otherwise; 19 of 20 cases as before\n")
    assert (tmp_path / "d.html").read_text().startswith("<!doctype html>")
    said = json.loads(diff(old, new, "--json").stdout)
    assert said["worse"] == 1 and said["changes"][0]["kind"] == "FAILS"
    quiet = diff(old, new, "--quiet")
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (1, "", "")
    assert diff(new, old).returncode == 0 and diff(old, old).returncode == 0
    gone = diff(old, tmp_path / "nowhere")
    assert gone.returncode == 2 and "nowhere" in gone.stderr


def test_the_page_is_whole_and_escapes_what_it_is_given(tmp_path):
    """One file that fetches nothing, with both ways in it."""
    hostile = {"outcome": "failed", "why": ["<script>alert(1)</script>"]}
    page = write_diff(
        tmp_path / "d.html", ("old", a_run(0)), ("<b>new", a_run(1, a00=hostile))
    ).read_text()
    assert "<script" not in page and "<b>" not in page and "http" not in page
    assert page.count("<h1>") == 2 and "Fail now" in page and "Hold now" in page


def test_a_solver_without_errors_is_compared_by_its_limits():
    """A light that went astray is named; one that moved within the limit is not."""
    limits = Limits(position_percent=1.0, intensity_percent=5.0, radius_percent=5.0)

    def run(**worst: float) -> list[Result]:
        results = []
        for result in a_run(0):
            for light in result.lights.found:
                light.position_error[:] = [None] * 3
                light.intensity_error[:] = [None]
            more = {
                "worst_position_percent": worst.get(result.name, 0.2),
                "missed": [1] if worst.get(result.name) == 0 else [],
            }
            judged = result.comparison.model_copy(update=more)
            results.append(result.model_copy(update={"limits": limits, "comparison": judged}))
        return results

    before, after = run(), run(a03=2.0, a05=0.9, a07=0)
    there, back = changes(before, after), changes(after, before)
    assert named(list(there.changes)) == [("a03", Kind.WORSE), ("a07", Kind.WORSE)]
    assert named(list(back.changes)) == [("a03", Kind.BETTER), ("a07", Kind.BETTER)]
