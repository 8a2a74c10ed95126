"""The studies: closed forms of the ceiling, scenes that are what they say, figures by hand."""

from __future__ import annotations

import importlib
import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.stats import chi2, norm

from lightloc import PointLights, Reason, radiance
from validation.commands.study import find
from validation.jobs.code import needed
from validation.jobs.store import Ended
from validation.judge.ceiling import DRAWS, within
from validation.rooms import relit
from validation.studies import (
    NAMES,
    ablated,
    coverage,
    efficiency,
    many,
    measures,
    scenes,
    trial,
    wrong,
)
from validation.studies import wrong_models as models
from validation.studies.study import EVERY, outcome, tabulate

SURE = 4.0  # standard errors: a Monte Carlo figure is off by more once in 16 000 times
ANY = np.array([np.inf])


def record(name: str = "lights-8-000", **changes: Any) -> dict[str, Any]:
    """A trial that went well: two lights, both off by 1 mm where the bound is 0.5 mm."""
    values = {
        **{"name": name, "lights": 2, "found": 2, "missed": 0, "ghosts": 0, "unflagged": 0},
        **{"position": 0.1, "intensity": 1.0, "solved": True, "tight": True, "chi2": 1.0},
        **{"reason": "CONVERGED", "verdicts": [], "certificate": 3.0, "seconds": 0.5},
        **{"ceiling": 0.9, "errors": [1e-3, 1e-3], "bounds": [5e-4, 5e-4]},
        **{"z": [[0.0, 1.0, -1.0], [0.5, -3.0, 1.5]], "displaced": 0},
    }
    return {**values, **changes}


def ended(name: str, error: str = "", **changes: Any) -> Ended:
    return Ended(name, "print", 1.0, None if error else record(name, **changes), error)


def near(found: float, p: float) -> bool:
    return abs(found - p) <= SURE * math.sqrt(p * (1 - p) / DRAWS)


# the ceiling


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0])
def test_ceiling_of_one_light_is_rayleighs(radius):
    """Isotropic errors of one light in 2D: 1 - exp(-r^2 / 2 s^2)."""
    s = 0.03
    found = within(np.diag([s * s, s * s, 1.0]), radius * s, ANY)
    assert near(found, 1 - math.exp(-(radius**2) / 2))


def test_ceiling_in_3d_and_of_the_intensity():
    """In 3D the distance is chi distributed; an intensity alone is Gaussian."""
    assert near(within(np.diag([4.0, 4.0, 4.0, 1.0]), 3.0, ANY), chi2.cdf(9 / 4, 3))
    found = within(np.diag([1.0, 1.0, 0.25]), np.inf, np.array([0.5]))
    assert near(found, norm.cdf(1) - norm.cdf(-1))


def test_ceiling_of_independent_lights_is_a_product_and_of_one_error_it_is_not():
    """Two lights: p^2 where errors are independent, p where they are the same error."""
    p = 1 - math.exp(-0.5)
    apart = np.diag([1.0] * 4 + [1e-6] * 2)
    assert near(within(apart, 1.0, np.repeat(ANY, 2)), p * p)
    same = np.kron(np.ones((2, 2)), np.eye(2))
    together = np.block([[same, np.zeros((4, 2))], [np.zeros((2, 4)), np.eye(2)]])
    assert near(within(together, 1.0, np.repeat(ANY, 2)), p)


def test_ceiling_is_the_same_in_other_units_and_zero_where_something_is_free():
    spread = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, 0.2], [0.1, 0.2, 3.0]])
    own = within(spread, 1.0, np.array([2.0]))
    assert within(1e-12 * spread, 1e-6, np.array([2e-6])) == own
    assert within(np.diag([1.0, np.inf, 1.0]), 1e9, ANY) == 0.0


# scenes


def test_one_percent_is_of_the_root_of_b_times_its_mean():
    """The noise that is added, and the error that the data state, are 0.01 sqrt(B mean B)."""
    room = scenes.room_list(0, 3)[0]
    clean = room.observe()
    k = scenes.noise_of(clean)
    stated = scenes.with_error(clean, k).sigma
    B = clean.radiance
    lit = B.mean() * 0.02 < B  # others have the floor's error
    assert np.allclose(stated[lit], 0.01 * np.sqrt(B * B.mean())[lit], rtol=1e-12)
    z = ((room.observe(noise=k).radiance - B) / stated)[lit]
    assert abs(np.std(z) - 1) < SURE / math.sqrt(2 * z.size)


def test_every_study_is_named_and_its_scenes_are_known(tmp_path, monkeypatch):
    """A name finds its study; its rows have labels; scenes of one row lead those of more."""
    np.savez(
        tmp_path / "hall.npz", light_intensities=np.ones(4)
    )  # views has scenes where rooms are
    monkeypatch.setenv("LIGHTLOC_ROOMS", str(tmp_path))
    for name in NAMES:
        study = find(name)
        names = study.names(2)
        assert study.name == name and len(set(names)) == len(names)
        assert set(study.names(1)) < set(names)
        rows = tabulate(study, names, {})
        assert all(row.label and row.planned for row in rows)
        assert outcome(study, rows) == ["No scene has been run yet."]
        ungated = name in ("rivals", "ablation")
        assert ungated or any(measure.goals for measure in study.measures)


def test_a_change_of_the_search_is_made_and_unmade():
    """Every name that the ablation changes is there, is changed within, and is back after."""
    for change in ablated.CHANGES.values():
        module, name = importlib.import_module(f"lightloc.{change.where[0]}"), change.where[1]
        before = getattr(module, name)
        assert before != change.value
        with ablated.made(change):
            assert getattr(module, name) is change.value
        assert getattr(module, name) is before


def test_an_ablation_loses_what_the_search_has(monkeypatch):
    """Negative control: without a climb nothing is found, unless a diagnosis searches for lamps."""
    search = importlib.import_module("lightloc.localize")
    monkeypatch.setattr(search, "diagnosed", lambda found, *rest: found)
    monkeypatch.setitem(
        ablated.CHANGES, "nothing", ablated.Change("", ("localize", "climbed"), ablated.off)
    )
    one = ablated.ablated(f"nothing-{ablated.rooms().index('noisy-4-000'):03}")
    assert one.as_is and not one.solved


def test_the_hard_set_keeps_its_names_and_knows_nothing_of_how_lights_are_found():
    """Sixty or so rooms; their code imports no part of a search, so that it outlives one."""
    study = find("hard")
    names = study.names(study.per_row)
    assert 50 <= len(names) <= 70 and names[0] == "lights-15-000"
    inner = re.compile(r"lightloc(\.| import )(search|fit|interreflection)\b")
    read = {name: file.read_text() for name, file in needed(study.one.__module__).items()}
    assert not [name for name, text in read.items() if inner.search(text)]
    assert inner.search(needed("validation.studies.rooms")["validation.studies.rooms"].read_text())


def test_a_room_may_be_lit_by_as_many_lights_as_are_asked_for():
    """The first of them are where fewer would be, and all keep their distance from each other."""
    few, many = (relit.lit("diffuse", 3, count).lights.positions for count in (None, 9))
    assert len(few) == 4 and len(many) == 9 and np.array_equal(few, many[:4])
    assert pdist(many).min() > 0.1


def test_what_is_shown_makes_no_record():
    """Tables and goals may change and the records still hold; scenes and rooms may not."""
    made = set(needed(find("many").one.__module__))
    judge = {"validation.judge.ceiling", "validation.judge.match"}
    assert judge | {"validation.studies.trial"} < made
    assert {"validation.rooms.plane", "validation.studies.scenes"} < made
    shown = {"validation.studies.many", "validation.studies.table", "validation.judge.sphere"}
    assert not shown & made


@pytest.mark.parametrize("name", ["k0.05-000", "n50-001"])
def test_a_scene_is_solved_and_the_same_again(name):
    """A real one: found, near its bound, and the same twice but for the clock."""
    one = find("noise" if name.startswith("k") else "points").one
    first, again = (vars(one(name)) | {"seconds": 0} for _ in range(2))
    assert first == again
    assert first["solved"] and first["reason"] == "CONVERGED"
    assert np.square(first["errors"]).sum() < 25 * np.square(first["bounds"]).sum()


# wrong models


def chi_square_of_truth(model: str) -> float:
    """A residual, of the true lights under the believed model: 1 where it is right."""
    rng = np.random.default_rng(7)
    q, lights = models.MODELS[model](1, rng)
    return float(np.square((q.radiance - radiance(q, lights)) / q.sigma).mean())


@pytest.mark.parametrize("model", models.MODELS)
def test_a_wrong_model_does_not_explain_the_data_and_the_control_does(model):
    """Chi-square of the truth: 1 within its own spread for the control, far above it for others."""
    found = chi_square_of_truth(model)
    spread = math.sqrt(2 / 400)
    assert abs(found - 1) < SURE * spread if model == "right" else found > 1 + SURE * spread


def test_errors_of_models_have_the_size_that_they_say(monkeypatch):
    """10 % of the albedo, 5 degrees of normals, one outlier in twenty, lights as bright."""
    assert np.isclose(np.square(models._smooth(100, np.random.default_rng(0))).mean(), 1)
    true, _ = models._square(0)
    for make, size in ((models.normals_by_wall, 1e-9), (models.normals_by_point, SURE / 28)):
        q, _ = make(0, np.random.default_rng(0))
        angle = np.degrees(np.arccos(np.clip((q.normals * true.normals).sum(axis=1), -1, 1)))
        assert abs(np.sqrt(np.square(angle).mean()) / 5 - 1) < size
    monkeypatch.setattr(models, "ONE_PERCENT", 1e-6)
    for make in (models.albedo_by_wall, models.albedo_by_point):
        q, _ = make(0, np.random.default_rng(0))
        factor = q.radiance / true.radiance - 1
        assert abs(np.sqrt(np.square(factor).mean()) / 0.1 - 1) < SURE / 28
    q, _ = models.outliers(0, np.random.default_rng(0))
    assert (np.abs(q.radiance / true.radiance - 1) > 1e-3).sum() == 20
    q, _ = models.area(0, np.random.default_rng(0))
    assert abs(q.radiance.sum() / true.radiance.sum() - 1) < 0.05
    parameters = [models._box(models.Plastic(alpha=a), np.random.default_rng(0)) for a in (1, 2)]
    assert np.array_equal(parameters[0].positions, parameters[1].positions)


@pytest.mark.parametrize(("model", "number", "moved"), [("right", 5, 0), ("albedo_by_wall", 5, 1)])
def test_what_a_wrong_model_moves_from_the_truth(model, number, moved):
    """Nothing where the model is right; a light where walls of another albedo ask for that."""
    rng = np.random.default_rng([models.SEED, number, list(models.MODELS).index(model)])
    assert models.displaced(*models.MODELS[model](number, rng)) == moved


# a trial


def test_a_trial_is_judged_by_hand(monkeypatch):
    """Two lights found the other way round, 3 mm and 4 mm off, and a ghost that a verdict names."""
    q = scenes.with_error(scenes.room_list(0, 2)[0].observe(8), 0.1)
    truth = PointLights([[0.2, 0.2, 0], [0.8, 0.7, 0]], [2.0, 4.0])
    answer = SimpleNamespace(
        lights=PointLights([[0.8, 0.704, 0], [0.203, 0.2, 0]], [4.1, 2.0]),
        position_error=np.array([[1.0, 2e-3, 0], [3e-3, 1.0, 0]]),
        intensity_error=np.array([[0.1], [0.2]]),
        verdicts=(),
        certificate=math.nan,
        chi2=1.0,
        reason=Reason.CONVERGED,
    )
    monkeypatch.setattr(trial, "found", lambda q, geometry, **how: answer)
    done = trial.trial("a-000", q, truth, known=q)
    assert done.solved and not done.tight
    assert np.allclose([done.position, done.intensity], [0.4, 2.5])
    assert np.allclose(done.errors, [0.003, 0.004])
    assert np.allclose(done.z, [[1, 0, 0], [0, 2, 1]], atol=1e-9)
    assert len(done.bounds) == 2 and 0 <= done.ceiling <= 1
    tight = trial.Tolerance(0.0035, 5.0)
    assert not trial.trial("a-000", q, truth, tolerance=tight).solved
    wide = trial.trial("a-000", q, truth, diagonal=10.0)  # of which the errors are parts
    assert wide.tight and np.isclose(wide.position, 0.04)
    kind = SimpleNamespace(name="UNCERTAIN")
    answer.lights = PointLights([*answer.lights.positions, [0.5, 0.1, 0]], [4.1, 2.0, 1.0])
    answer.verdicts = (SimpleNamespace(kind=kind, lights=(2,)),) * 2
    ghost = trial.trial("a-000", q, truth)
    assert (ghost.ghosts, ghost.unflagged, ghost.missed, ghost.errors) == (1, 0, 0, [])
    assert not ghost.solved and ghost.verdicts == ["UNCERTAIN"]


# figures


def test_a_crashed_scene_counts_as_not_solved():
    """By hand: 4 ended, 1 crashed, 2 solved: 2/4 with the error 1/4; of 3 converged, 2."""
    some = [ended("a-0"), ended("a-1"), ended("a-2", solved=False), ended("a-3", "ValueError: no")]
    rate = measures.share(many.solved)(some)
    assert (rate.value, rate.error) == (0.5, 0.25)
    asked = measures.share(many.solved, lambda r: r["solved"])(some)
    assert (asked.value, asked.text) == (1.0, "1.00 of 2")
    assert measures.share(many.solved, lambda r: False)(some).value is None


def test_goals_of_many_lights():
    """A wrong answer that converged misses the goal over all rows; one that says so does not."""
    names = many.STUDY.names(2)
    right = {name: ended(name) for name in names}
    rows = tabulate(many.STUDY, names, right)
    assert rows[-1].name == EVERY and rows[-1].ended == 8
    assert outcome(many.STUDY, rows)[0] == "All 3 goals met."
    unsure = right | {"lights-15-000": ended("lights-15-000", solved=False, reason="UNDECIDED")}
    rows = tabulate(many.STUDY, names, unsure)
    assert outcome(many.STUDY, rows)[0] == "All 4 goals met."
    sure = right | {"lights-15-000": ended("lights-15-000", solved=False)}
    said = outcome(many.STUDY, tabulate(many.STUDY, names, sure))[0]
    assert said.startswith("2 of 4 goals missed: 15 lights, Unsolved say so 0.00 of 1 (goal ≥ 1)")


def test_efficiency_of_errors_twice_the_bound_is_two():
    """Of usable answers only, and without spread where all scenes are the same."""
    some = [ended(f"k0.1-{i}") for i in range(5)] + [ended("k0.1-5", found=3, errors=[9.0])]
    ratio = efficiency.ratio(some)
    assert np.isclose(ratio.value, 2) and ratio.error < 1e-12
    assert np.isclose(efficiency.by_light(some).value, 2)
    assert efficiency.rms(0)(some).value == pytest.approx(0.1)
    assert efficiency.ratio([ended("k0.1-0", reason="UNDECIDED")]).value is None


@pytest.mark.parametrize(("size", "met"), [(1.0, True), (1.5, False)])
def test_coverage_of_a_gaussian_is_95_percent_and_of_errors_too_small_is_less(size, met):
    """Quantiles of the Gaussian; the control states errors a third too small."""
    z = size * norm.ppf((np.arange(600) + 0.5) / 600)
    light = [[float(v)] * 3 for v in z]
    names = coverage.STUDY.names(1)
    rows = tabulate(coverage.STUDY, names, {name: ended(name, z=light) for name in names})
    cell = rows[-1].cell("x")
    assert cell.met is met
    assert np.isclose(cell.value, 2 * norm.cdf(norm.ppf(0.975) / size) - 1, atol=2 / 600)
    assert (coverage.pearson(z)[1] > 0.99) is met


def test_wrong_models_that_pass_unnoticed_or_leave_ghosts_miss_their_goals():
    names = wrong.STUDY.names(1)
    good = {name: ended(name, verdicts=["UNEXPLAINED"]) for name in names[1:]}
    good[names[0]] = ended(names[0])
    rows = tabulate(wrong.STUDY, names, good)
    assert "All 16 goals met." in outcome(wrong.STUDY, rows)
    bad = good | {names[1]: ended(names[1], ghosts=2), names[0]: ended(names[0], reason="NO_GAIN")}
    rows = tabulate(wrong.STUDY, names, bad)
    assert outcome(wrong.STUDY, rows)[0].startswith("3 of 16 goals missed")
    assert wrong.doubt(bad[names[1]].record) == "not noticed, 2 ghosts"
