"""Any solver: whatever it does, its case ends in a sentence; what it finds is judged as ours is."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import render
from lightloc import Irradiance, Observations, PointLights, Reason, radiance
from validation.jobs.code import fingerprint
from validation.judge import compare
from validation.methods import Method, Scene, SolverFailed, function, solved
from validation.methods.answer import MOST_LIGHTS, answered, taken
from validation.studies.solver import by
from validation.studies.table import command
from validation.suite import by_methods, read_suite

LIGHTLOC = Path(sys.executable).with_name("lightloc")
MINE = """
import os, time
import numpy as np
from lightloc import PointLights

def solve(q, geometry):
    assert geometry is None
    return [[0.2, 0.1, 0.5]], [10.0], [[0.1, 0.2, 0.3]], [0.5], "CONVERGED"

def told(q, geometry, bounds, seed):
    return {"lights": PointLights([[bounds[0][0], 0, 1]], [seed])}

def crash(q, geometry):
    raise KeyError("no  such\\nlight")

def leave(q, geometry):
    raise SystemExit

def die(q, geometry):
    print("last words")
    os._exit(7)

def hang(q, geometry):
    time.sleep(100)

def hog(q, geometry):
    return [np.ones(1 << 27) for _ in range(64)]

def nan(q, geometry):
    return [[np.nan, 0, 0]], [1]

def nap(q, geometry):
    time.sleep(0.2)
    return [[0, 0, 1]], [1]
"""


def floor(n: int = 50) -> Observations:
    """Readings of one light on a floor, without errors."""
    x = np.random.default_rng(0).uniform(-1, 1, (n, 3)) * [1, 1, 0]
    q = Observations(
        positions=x, normals=[[0, 0, 1]] * n, radiance=np.zeros(n), material=Irradiance()
    )
    return q.with_radiance(radiance(q, PointLights([[0.2, 0.1, 0.5]], [10.0])), sigma=0.01)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A user's folder with a module of solvers."""
    folder = tmp_path_factory.mktemp("user")
    (folder / "mine.py").write_text(MINE)
    return folder


def test_an_answer_with_its_errors_and_its_reason(folder):
    """It comes back as the answer that ours has, with what its lights leave."""
    found, _ = solved(Method.of("mine:solve", folder), floor(), None, None)
    assert found.lights.positions.tolist() == [[0.2, 0.1, 0.5]]
    assert found.position_error.tolist() == [[0.1, 0.2, 0.3]]
    assert found.intensity_error.tolist() == [[0.5]]
    assert found.reason is Reason.CONVERGED and found.chi2 < 1e-6
    assert "0.2" in str(found) and json.dumps(found.to_dict())


def test_a_solver_is_told_what_it_has_a_parameter_for(folder):
    """Bounds and a seed, by their names; an answer may be lights alone."""
    method = Method.of("mine.py:told", folder)
    found, _ = solved(method, floor(), None, None, bounds=[[-3, -3, 0], [3, 3, 2]], seed=5)
    assert found.lights.positions.tolist() == [[-3, 0, 1]]
    assert found.lights.intensities.tolist() == [[5]]
    assert found.reason is Reason.TAKEN and np.isnan(found.position_error).all()


def test_a_file_is_taken_for_itself(tmp_path):
    """Not for a module of Python's own that has its name; in a package it may import from that."""
    own = "def solve(q, geometry):\n    return [[0, 0, 1]], [1]\n"
    (tmp_path / "json.py").write_text(own)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "__init__.py").write_text("")
    (tmp_path / "mine" / "parts.py").write_text(own)
    (tmp_path / "mine" / "types.py").write_text("from .parts import solve\n")
    for text in ("json.py:solve", "json:solve", "mine.types:solve"):
        solve = function(Method.of(text, tmp_path))
        assert solve(None, None) == ([[0, 0, 1]], [1])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("crash", r"KeyError: 'no such\\nlight' \(mine.py, line 14\)"),
        ("leave", "SystemExit: no message"),
        ("die", r"process died \(exit code 7\); the last it printed: last words"),
        ("hang", "it ran longer than 1 s"),
        ("hog", "MemoryError"),
        ("nan", "its positions are not all finite"),
        ("gone", "mine has no function 'gone'"),
    ],
)
def test_whatever_a_solver_does_is_a_sentence(folder, name, said):
    """It raises, leaves, dies, hangs, takes all memory, or returns what is no answer."""
    method, seconds = Method.of(f"mine:{name}", folder), 1 if name == "hang" else 60
    with pytest.raises(SolverFailed, match=said):
        solved(method, floor(), None, None, seconds=seconds, memory_mb=2048)


def test_what_a_solver_prints_is_kept_and_its_time_is_its_own(folder):
    """Where it raised, too; nothing where it was silent. Its process's start is not its time."""
    log: list[bytes] = []
    for name in ("crash", "die"):
        with pytest.raises(SolverFailed):
            solved(Method.of(f"mine:{name}", folder), floor(), None, None, log=log.append)
    assert b"KeyError" in log[0] and b'mine.py", line 14, in crash' in log[0]
    assert log[1:] == [b"last words\n"]
    clock = time.perf_counter()
    _, seconds = solved(Method.of("mine:nap", folder), floor(), None, None, log=log.append)
    assert 0.2 <= seconds < (time.perf_counter() - clock) / 2 and len(log) == 2


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (None, "it returned a NoneType; expected positions"),
        (([[0, 0, 1]],), "it returned a tuple"),
        (([0, 0, 1], [1]), r"its positions have the shape \(3,\); expected \(k, 3\)"),
        (([[0, 0, 1]], [1, 2]), r"its intensities have the shape \(2,\)"),
        (([["a", "b", "c"]], [1]), "its positions are no array of numbers"),
        (([[0, 0, 1]], [np.inf]), "its intensities are not all finite"),
        (([[0, 0, 1], [0, 0, 2]], [1, -1]), "light 2 is negative"),
        ((np.zeros((MOST_LIGHTS + 1, 3)), np.ones(MOST_LIGHTS + 1)), "it returned 201 lights"),
        ({"positions": [[0, 0, 1]], "intensities": [1], "reason": "DONE"}, "its reason is 'DONE'"),
    ],
)
def test_what_is_no_answer_is_refused(given, said):
    with pytest.raises(ValueError, match=said):
        taken(given, channels=1)


def test_no_light_is_an_answer():
    """Of any number of channels, and what it leaves is all that is seen."""
    found = answered(floor(), taken(([], []), channels=1), None)
    assert len(found.lights) == 0 and found.chi2 > 1
    assert taken(([], []), channels=3)["intensities"].shape == (0, 3)


@pytest.mark.parametrize("name", ["grid", "starts", "adam"])
def test_the_shipped_solvers_find_a_light(name):
    """Each as a suite calls it, in a room that it loads itself."""
    scene = Scene("box_one")
    room = render.load(scene.file)
    q = render.observe(room, points=2048, seed=1, transport="direct", noise=0.01)
    found, _ = solved(Method.of(f"validation.solvers.{name}:solve", Path()), q, room, scene)
    judged = compare(found.lights, room.lights, room.diagonal)
    assert judged.count_right and not judged.missed
    assert judged.worst_position_percent < 1.5


def test_cases_by_several_solvers_have_names_of_their_own(folder):
    """A case by one keeps its name; what repeats it names the row and the method."""
    rows = read_suite("standard")[1][:2]
    alone = by_methods(rows, ["mine:solve"], folder)
    assert [one.name for one in alone] == [row.name for row in rows]
    both = by_methods(rows, ["mine:crash", "paper"], folder)
    assert [one.name for one in both] == [
        *(f"{row.name}--mine-crash" for row in rows),
        *(f"{row.name}--paper" for row in rows),
    ]
    assert both[0].row == rows[0].name and both[0].asked and not rows[0].asked
    assert both[0].method == f"{folder.resolve() / 'mine.py'}:crash"
    with pytest.raises(ValueError, match="two go by the name 'paper'"):
        by_methods(rows, ["paper", "paper"], folder)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("serch", "expected search, paper, or a function"),
        ("mine:", "expected search, paper, or a function"),
        ("nowhere:solve", "there is no module 'nowhere' in"),
        ("nowhere.py:solve", "there is no file"),
        ("a b:solve", "'a b' is no module"),
    ],
)
def test_a_method_that_is_none_is_said_before_anything_runs(folder, text, said):
    with pytest.raises(ValueError, match=said):
        Method.of(text, folder)
    words = [LIGHTLOC, "validate", "--method", text]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and said in done.stderr and not done.stdout


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ('metod = "paper"', "there is no key 'metod'; did you mean method?"),
        ("options.most_light = 3", "options: there is no 'most_light'; did you mean most_lights?"),
        ("options.false_alarm = 2", "Options.false_alarm is 2; expected less than 1"),
        ('method = "nowhere:solve"', "there is no module 'nowhere'"),
        ('method = "mine.py:solve"\noptions.cells = 9', "takes none"),
    ],
)
def test_a_row_that_is_wrong_is_said_with_the_nearest_right_one(tmp_path, row, said):
    (tmp_path / "mine.py").write_text(MINE)
    file = tmp_path / "own.toml"
    file.write_text(
        f'[[case]]\nname = "a"\nscene = "box_one"\nbrdf = "diffuse"\nclaim = "c"\n'
        f"position_percent = 1\nintensity_percent = 1\n{row}\n"
    )
    with pytest.raises(ValueError, match=r"own.toml: case 'a': ") as error:
        read_suite(file)
    assert said in str(error.value)


OWN_SUITE = """
[defaults]
points = 256
brdf = "diffuse"
claim = "A small case."
position_percent = 1
intensity_percent = 5
[[case]]
name = "twice"
scene = "box_one"
noise = 0.01
repeats = 2
metric = "judges:brightness"
[[case]]
name = "strict"
scene = "box_one"
metric = "judges:brightness"
metric_most = 1
[[case]]
name = "broken"
scene = "box_one"
metric = "judges:gone"
[[case]]
name = "rougher"
scene = "box_conductor"
parameters.alpha = 0.3
assumed = "box_conductor"
assumed_parameters.alpha = 0.6
options.most_lights = 3
[[case]]
name = "other_shapes"
scene = "box_one"
assumed = "sphere"
"""


def test_a_row_has_a_metric_repeats_options_and_assumed_materials(tmp_path):
    """A metric is told and judged; other materials leave a case that says so; shapes must agree."""
    (tmp_path / "judges.py").write_text(
        "def brightness(found, room, seen):\n    return float(found.lights.intensities.sum())\n"
    )
    (tmp_path / "own.toml").write_text(OWN_SUITE)
    words = [LIGHTLOC, "validate", "--suite", "own.toml", "-o", "out", "--json"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    summary = json.loads(done.stdout)
    cases = {
        name: json.loads((tmp_path / "out" / "cases" / name / "result.json").read_text())
        for name in summary["cases"]
    }
    assert list(cases)[:2] == ["twice-r1", "twice-r2"]
    once, twice = (cases[f"twice-r{i}"] for i in (1, 2))
    assert once["seed"] + 1 == twice["seed"] and once["outcome"] == "passed"
    assert once["metrics"]["judges-brightness"] != twice["metrics"]["judges-brightness"]
    assert once["command"].endswith("--case twice-r1")
    assert any("metric judges-brightness is" in said for said in cases["strict"]["why"])
    assert cases["broken"]["why"] == [
        "The metric failed: ValueError: judges has no function 'gone'."
    ]
    rougher = cases["rougher"]
    assert rougher["assumed"] == "box_conductor" and rougher["options"] == {"most_lights": 3}
    assert rougher["search"]["reason"] != "converged"
    assert cases["other_shapes"]["outcome"] == "crashed"
    assert "has other shapes than 'box_one'" in cases["other_shapes"]["why"][-1]


ROOMS = """
import numpy as np
def solve(q, geometry, seed=0):
    return np.array([[0.5, 0.5, 0.0]]), np.array([1.0 + seed])
def nothing(q, geometry):
    return None
"""


def test_a_study_s_rooms_are_solved_by_any_solver(tmp_path):
    """The study of a solver has its name, its title, its command, and its answers."""
    from validation.studies.many import STUDY

    (tmp_path / "mine.py").write_text(ROOMS)
    method = Method.of("mine.py:solve", tmp_path)
    study = by(STUDY, method)
    assert (study.name, study.title) == ("many--mine", f"{STUDY.title}, by mine")
    assert command(study, 3) == f"lightloc study many --method {method.said} --scenes 3"
    record = study.one("lights-8-000")
    assert record.found == 1 and record.reason == "TAKEN" and not record.solved
    assert STUDY.one("lights-8-000").solved  # ours, after that, as before


def test_a_study_s_solver_that_returns_no_lights_fails_that_scene(tmp_path):
    from validation.studies.many import STUDY

    (tmp_path / "mine.py").write_text(ROOMS)
    study = by(STUDY, Method.of("mine.py:nothing", tmp_path))
    with pytest.raises(ValueError, match="it returned a NoneType; expected positions"):
        study.one("lights-8-000")


def test_a_study_by_another_solver_is_another_s_record(tmp_path):
    """A solver's file that changed is run again; records of ours are not taken for its own."""
    from validation.studies.many import STUDY

    file = tmp_path / "mine.py"
    file.write_text(ROOMS)
    study = by(STUDY, Method.of("mine.py:solve", tmp_path))
    first = fingerprint(study.one, "lights-8-000")
    assert first == fingerprint(study.one, "lights-8-000") != fingerprint(STUDY.one)
    file.write_text(ROOMS + "\n# changed\n")
    assert fingerprint(study.one, "lights-8-000") != first


def test_a_study_of_what_our_answers_say_takes_no_other_solver(refuses):
    from validation.studies.null import STUDY

    with refuses("--method: the study null is of our own search alone"):
        by(STUDY, Method("paper"))


def test_a_solver_s_error_in_a_study_names_its_own_line(tmp_path):
    """Not that of the library in which it was raised."""
    from validation.studies.many import STUDY

    (tmp_path / "mine.py").write_text(
        "import numpy as np\ndef solve(q, geometry):\n    return np.linalg.inv(np.zeros((2, 2)))\n"
    )
    study = by(STUDY, Method.of("mine.py:solve", tmp_path))
    with pytest.raises(ValueError, match=r"LinAlgError: Singular matrix \(mine.py, line 3\)"):
        study.one("lights-8-000")


def test_the_studies_that_take_any_solver_are_those_that_are_named():
    import importlib

    from validation.studies import NAMES
    from validation.studies.solver import BY_ANY

    every = [importlib.import_module(f"validation.studies.{name}").STUDY for name in NAMES]
    assert {study.name for study in every if study.solvers} == set(BY_ANY)
