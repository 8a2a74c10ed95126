"""The gauntlet: rooms, faults, sensors and outliers are what they say, and its judges are fair."""

from __future__ import annotations

import math

import numpy as np
import pytest
import typer
from scipy.stats import norm

from lightloc import (
    Bound,
    PointLights,
    cramer_rao,
    radiance,
    shading,
)
from lightloc.optics import columns
from validation.commands import study as command
from validation.commands.study import find
from validation.judge import Further, countable, fitted
from validation.judge.further import DRAWS
from validation.rooms import block_room
from validation.studies import GROUPS, NAMES, lamps
from validation.studies import crossed_rooms as rooms
from validation.studies import fault_models as faults
from validation.studies.counts_trial import counts, profile
from validation.studies.crossing import crossed, read
from validation.studies.explained_rooms import empty, explained
from validation.studies.fault import FIREFLY, fault, noisy, with_fireflies
from validation.studies.faults import KINDS, LABELS, SOUND
from validation.studies.measures import bounded, clopper_pearson
from validation.studies.null_trial import null
from validation.studies.power_trial import power, with_faint
from validation.studies.scenes import noise_of, with_error
from validation.studies.sensors import LEVELS, SENSORS
from validation.studies.wild import KINDS as WILD
from validation.studies.wild import anywhere

SURE = 4.0  # standard errors: a Monte Carlo figure is off by more once in 16 000 times


def of(*own: int) -> np.random.Generator:
    return np.random.default_rng(own)


# rooms


def test_blocks_hide_what_the_segments_between_two_points_run_through():
    """Against a thousand points along each segment; what only grazes a block is left out."""
    g = block_room(3, 1, of(1)).geometry
    ends = of(2).uniform(0, g.size, (2, 400, 3))
    t = np.linspace(0, 1, 1001)[:, None, None]
    along = (ends[0] + t * (ends[1] - ends[0])).reshape(-1, 3)
    inside = g.inside(along).reshape(1001, 400).sum(axis=0)
    seen = np.array(g.visible(columns(ends[0]), columns(ends[1])))
    clear = (inside == 0) | (inside > 2)
    assert np.array_equal(seen[clear], (inside == 0)[clear]) and 100 < seen.sum() < 390
    assert not np.array(g.visible(columns(ends[0]), columns(ends[1] + 2 * g.size))).any()


def test_rays_in_a_room_of_blocks_end_on_its_surfaces():
    g = block_room(3, 1, of(1)).geometry
    x = of(3).uniform(0, g.size, (400, 3))
    free = x[~g.inside(x)]
    d = of(4).normal(size=free.shape)
    hit, y = g.intersect(columns(free), columns(d))
    y = np.stack([np.array(a) for a in y], axis=1)
    assert np.array(hit).all() and np.abs(g.clearance(y)).max() < 1e-5
    on = y + 1e-4 * (free - y)
    assert np.array(g.visible(columns(free), columns(on))).mean() > 0.99  # nothing is before them


def test_a_room_is_observed_where_it_has_surfaces_and_the_viewer_sees_them():
    room = block_room(2, 2, of(5))
    q = room.seen(500, faults.materials(), of(6))
    assert len(q) == 500 and np.abs(room.geometry.clearance(q.positions)).max() < 1e-9
    assert set(np.unique(q.regions)) == {0, 1, 2, 3}
    assert ((q.directions * q.normals).sum(axis=1) > 0).all()
    assert (room.geometry.clearance(room.lights.positions) > 0.2).all()


# faults


@pytest.mark.parametrize("model", faults.MODELS)
def test_only_where_nothing_is_wrong_the_truth_explains_the_data(model):
    """The believed room's own B is that of the data in the controls, and off by noise in others."""
    scene = faults.MODELS[model](1, of(7))
    off = np.abs(scene.right().radiance - scene.q.radiance)
    assert len(scene.lights) <= faults.MOST_LIGHTS and len(scene.q) >= 900
    if model in SOUND:
        assert off.max() < 1e-12 * scene.q.radiance.max()
    else:
        sigma = noisy(scene.q, np.zeros_like(off), True).known_sigma
        assert np.square(off / sigma).mean() > 2


def test_faults_have_the_sizes_that_they_say():
    right, wrong = (make(1, of(8)) for make in (faults.nothing, faults.normals))
    angle = np.degrees(np.arccos((right.q.normals * wrong.q.normals).sum(axis=1)))
    assert np.allclose(angle, 5)
    q = faults.gamma(1, of(8)).q
    assert np.allclose(q.radiance**2.2, right.q.radiance * q.radiance.max() ** 1.2)
    for size in (0.1, 0.3):
        scene = faults.albedo(size)(1, of(8))
        ratio = scene.right().radiance / np.maximum(scene.q.radiance, 1e-12)
        walls = (scene.q.regions == 2) & (scene.q.radiance[:, 0] > 0)
        assert np.allclose(np.abs(ratio[walls] - 1), size, rtol=1e-6)
        assert np.allclose(ratio[~walls & (scene.q.radiance[:, 0] > 0)], 1)
    factors = {round(faults.off(number, 0.3), 6) for number in range(faults.MOST_LIGHTS * 2)}
    assert factors == {0.7, 1.3}


def test_a_block_is_missing_or_too_much_and_not_observed():
    missing, extra = (make(1, of(9)) for make in (faults.missing, faults.extra))
    assert len(missing.geometry.low) == 1 and len(extra.geometry.low) == 2
    for scene in (missing, extra):
        assert np.abs(scene.geometry.clearance(scene.q.positions)).max() < 1e-9
        assert not scene.geometry.inside(scene.q.positions + 1e-6 * scene.q.normals).any()


def test_lamps_shine_as_the_power_of_a_cosine():
    """Straight ahead as an isotropic light does, at 60 degrees (1/2)^m of it, and 0 behind."""
    q, lights, region = lamps.led_over_plane(of(10))
    iso = shading(q, lights.positions)[:, 0, 0] * lights.intensities[0, 0]
    away = q.positions - lights.positions
    cosine = -away[:, 2] / np.linalg.norm(away, axis=1)
    assert np.allclose(q.radiance[:, 0] / iso, cosine, rtol=1e-5)
    turned = lamps.shone(q, lights, np.array([[0, 0, 1.0]]), 3.0)
    assert not turned.radiance.any() and (region[0] < lights.positions).all()
    m = [lamps.narrow(of(i)) for i in range(200)]
    assert 1 <= min(m) < 1.2 and 12 < max(m) <= 15


def test_the_light_of_a_patch_is_spread_over_it():
    """Far from it a patch is as bright as its points together; its middle is where it is said."""
    spots = lamps._patch(np.array([1.0, 2, 3]), np.array([0.4, 0, 0]), np.array([0, 0.6, 0]))
    assert np.allclose(spots.mean(axis=0), [1, 2, 3]) and len(spots) == lamps.SPOTS**2
    assert np.allclose(np.ptp(spots, axis=0), np.array([0.4, 0.6, 0]) * (1 - 1 / lamps.SPOTS))


def test_a_firefly_is_one_value_alone():
    q = noisy(faults.nothing(0, of(11)).q, np.zeros((faults.POINTS, 1)), False)
    wild = with_fireflies(q, (3,))
    assert np.flatnonzero(wild.radiance != q.radiance).tolist() == [3]
    assert np.isclose(wild.radiance[3, 0], FIREFLY * q.radiance.mean())


def test_every_fault_has_a_kind_and_a_label():
    assert set(faults.MODELS) == set(LABELS) == {*KINDS, *SOUND}


# sensors and outliers


@pytest.mark.parametrize("sensor", SENSORS)
def test_noise_is_as_large_as_it_is_said_to_be(sensor):
    B = of(12).uniform(0.5, 2.0, (20_000, 1))
    reading = SENSORS[sensor](B, of(13))
    z = ((reading.B - B) / reading.sigma)[reading.tells]
    if sensor == "exact":
        assert not z.any()
    else:  # a value that is clipped for being high leaves fewer high ones: a little
        assert abs(z.std() - 1) < 0.02 and abs(z.mean()) < 0.06


def test_limits_of_instruments_are_where_they_are_said_to_be():
    B = of(12).uniform(0.5, 2.0, (1000, 1))
    bits = SENSORS["bits"](B, of(0)).B
    steps = bits / bits.max() * LEVELS
    assert np.allclose(steps, steps.round(), atol=1e-9) and len(np.unique(bits)) <= LEVELS + 1
    for name, share in (("clipped2", 0.02), ("clipped10", 0.1)):
        reading = SENSORS[name](B, of(0))
        assert (reading.B.max() == reading.B).mean() == share == (~reading.tells).mean()
    zeros = SENSORS["zeros"](B, of(0))
    assert (zeros.B == 0).mean() == 0.4 and np.array_equal(zeros.B[:, 0] > 0, zeros.tells)


def test_outliers_are_where_they_are_said_to_be():
    """At edges: on the other side of a shadow of one light. Moved: one piece. Random: anywhere."""
    room = rooms.solid("diffuse", 3, 1, of(14))
    given = (room.q, room.lights, room.geometry, 60)
    which, B = WILD["edges"](*given, of(15))
    bright = radiance(room.q, room.lights)[which]  # as if nothing were in the way
    dark = room.q.radiance[which] == 0
    assert np.allclose(B, np.where(dark, bright, 0), atol=1e-6 * bright.max())
    assert 0 < dark.sum() < 60
    piece, _ = WILD["moved"](*given, of(15))
    spread = [
        np.linalg.norm(room.q.positions[w] - room.q.positions[w[0]], axis=1).max()
        for w in (piece, anywhere(*given, of(15))[0])
    ]
    assert spread[0] < 0.5 * spread[1] and len(set(piece)) == 60


@pytest.mark.parametrize("kind", WILD)
def test_so_many_outliers_are_there_as_are_asked_for(kind):
    """Those that are counted lie far from the truth; most of those that were made do."""
    room = rooms.flat("diffuse", 3, 4, of(16))
    reading, far = read(room, "c0.01", 0.05, kind, [17])
    off = np.abs(reading.B - room.q.radiance) / reading.sigma
    assert (off[far] > SURE).all() and (off[~far] > 6).sum() == 0
    assert 0.5 < far.mean() / 0.05 <= 1 + 1 / len(far)
    assert not read(room, "c0.01", 0.0, kind, [17])[1].any()


def test_factors_are_crossed():
    """Each level as often as any other, and no two factors go together."""
    levels = [rooms.drawn(number) for number in range(600)]
    for name, values in rooms.FACTORS.items():
        found = [levels_.get(name) for levels_ in levels]
        assert {found.count(value) for value in values} == {600 // len(values)}
    columns_ = np.array([[rooms.FACTORS[name].index(one[name]) for name in one] for one in levels])
    apart = np.corrcoef(columns_.T) - np.eye(len(rooms.FACTORS))
    assert np.abs(apart).max() < SURE / math.sqrt(600)


# the judges


def test_a_fit_from_the_truth_leaves_what_noise_leaves():
    """Chi-square has as many degrees of freedom as are left; from a little off it is the same."""
    room = explained(empty(2, 3, of(18)), 2, of(19))
    fit = fitted(room.q, room.lights, room.geometry, room.sigma)
    free = len(room.q) - 9
    assert abs(fit.chi2 - free) < SURE * math.sqrt(2 * free)
    aside = PointLights(
        room.lights.positions + np.array([0.01, -0.01, 0]), 1.1 * room.lights.intensities
    )
    again = fitted(room.q, aside, room.geometry, room.sigma)
    assert np.allclose(again.lights.positions, fit.lights.positions, atol=1e-4)
    z = (fit.lights.positions - room.lights.positions)[:, :2] / cramer_rao(
        room.q, room.lights, room.geometry
    ).position[:, :2]
    assert np.abs(z).max() < SURE


def test_what_noise_lets_one_place_gain_has_a_closed_form():
    """One place: the square of a Gaussian, where that is positive."""
    column = np.full((100, 1), 0.1)
    one = Further(np.zeros((1, 3)), column, np.ones(1), np.zeros((100, 0)))
    gains = [one.gain(0.05, of(i)) for i in range(40)]
    exact = norm.ppf(0.95)
    spread = math.sqrt(0.05 * 0.95 / (40 * DRAWS)) / norm.pdf(exact)
    assert abs(np.sqrt(gains).mean() - exact) < 2 * SURE * spread


def test_a_further_light_is_where_it_gains_most():
    room = explained(empty(2, 1, of(20)), 2, of(21))
    places = room.places()
    further = Further.of(room.q, room.lights, room.geometry, room.sigma, places)
    p = further.places[[len(further.places) // 3]]
    more = radiance(room.q, PointLights(p, [0.7]), room.geometry) / room.sigma
    best = further.best(more[:, 0] - further.basis @ (further.basis.T @ more[:, 0]))
    assert np.allclose(best.positions, p) and np.isclose(best.intensities[0, 0], 0.7)


def test_lights_that_stand_out_are_counted_and_faint_ones_are_not():
    lights = PointLights([[0, 0, 1], [0, 1, 1]], [1.0, 1.0])
    for error, p in ((0.01, 1.0), (0.2, 0.25), (10.0, 0.0)):
        bound = Bound.of(np.diag([1.0] * 6 + [error**2] * 2), np.arange(3), 2, 1)
        assert abs(countable(bound, lights, 25.0) - p) < 1e-6 + (p == 0) * 1e-5


def test_bounds_of_a_rate_are_those_of_clopper_and_pearson():
    """With no hit the upper one is 1 - 0.025^(1/n); with all, the mirror image."""
    low, high = clopper_pearson(0, 30)
    assert low == 0 and np.isclose(high, 1 - 0.025 ** (1 / 30))
    assert np.allclose(clopper_pearson(30, 30), (1 - high, 1))
    assert bounded(lambda record: True)([]).value is None


def test_a_faint_light_is_as_bright_as_its_own_error_times_the_strength():
    """At the bound its error is then its intensity over the strength."""
    room = with_faint(empty(3, 1, of(22)), 6.0, of(23))
    bright = room.q.with_radiance(
        radiance(
            room.q,
            PointLights(room.lights.positions[:1], room.lights.intensities[:1]),
            room.geometry,
        ),
        0.0,
    )
    known = with_error(bright, noise_of(bright))
    error = cramer_rao(known, room.lights, room.geometry).intensity[-1, 0]
    assert np.isclose(room.lights.intensities[-1, 0], 6 * error, rtol=1e-3)


def test_the_profile_holds_the_true_count_where_lights_are_bright_and_none_that_is_less():
    for seed in range(3):
        room = explained(empty(2, 3, of(24, seed)), 2, of(25, seed))
        held = profile(room, of(26, seed))
        assert 3 in held and min(held) == 3 and max(held) <= 5


def test_the_gauntlet_is_studies_that_are_there():
    assert set(GROUPS["gauntlet"]) <= set(NAMES)
    assert len(find("null").names(100)) == 2400
    assert len(find("crossed").names(67)) >= 600 and len(find("counts").names(38)) >= 300
    assert len(find("faults").names(25)) == 25 * len(faults.MODELS)


def test_one_name_runs_them_all_and_each_once(tmp_path, monkeypatch):
    ran: list[str] = []
    monkeypatch.setattr(command, "_study", lambda study, *rest: ran.append(study.name) or 0)
    with pytest.raises(typer.Exit):
        command.study_command(["gauntlet", "null"], tmp_path, None, [], 0, None)
    assert ran == list(GROUPS["gauntlet"])


def test_where_there_are_no_rooms_of_others_nothing_is_run(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("LIGHTLOC_ROOMS", raising=False)
    with pytest.raises(typer.Exit) as ended:
        command.study_command(["views"], tmp_path, None, [], 0, None)
    assert ended.value.exit_code == 0 and "LIGHTLOC_ROOMS" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_scene_of_each_goes_from_end_to_end():
    right = fault("right-000")
    assert right.found == right.lights == right.right_found and not right.told
    assert not right.outside and right.reason == right.right_reason == "CONVERGED"
    assert not fault("led-000").told  # a place 7 cm off explains it as well
    shot = crossed("shot-000")
    assert shot.found == shot.lights and shot.sigma_off < 0.2 and shot.allowed > 0.99
    assert null("2d-stated-000").found == 1
    bright, faint = power("x30-000"), power("x1-000")
    assert bright.found == bright.lights and bright.gain > 10 * bright.needed > faint.gain / 10
    held = counts("lights-2-000")
    assert 2 in held.possible and min(held.profile) == 2
