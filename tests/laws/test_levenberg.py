"""Levenberg-Marquardt for many starts (section 5.2): laws, agreement with scipy's, its traps.

The traps are counted in Table 1's square rooms, without noise and with the count known. A rate is
higher than another where it is so by more than twice the binomial error of their difference.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from lightloc import (
    Lambert,
    Observations,
    Outline,
    PointLights,
    radiance,
    shading,
    shading_gradient,
)
from lightloc.backend import one_blas_thread
from lightloc.fit import batched
from lightloc.fit.batched import MARGIN, Unknown
from lightloc.fit.levenberg import Descents, damped_steps, descend
from lightloc.fit.loss import cauchy
from lightloc.fit.problem import Problem
from validation.rooms.plane import CLEARANCE, PlaneRoom, rooms
from validation.studies.columns import LOW_ERROR

BOUNDS = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]])
LIGHTS = PointLights([[0.4, -0.2, 1.1], [-0.5, 0.3, 0.6]], [4.0, 2.0])


def seen(rng: np.random.Generator, channels: int = 1) -> Observations:
    """A floor and two walls, lit by LIGHTS."""
    x = rng.uniform(-1, 1, (300, 3))
    side = np.arange(300) % 3
    normals = np.eye(3)[side]
    x[np.arange(300), side] = -1.0
    dark = Observations(
        positions=x,
        normals=normals,
        directions=normals,
        radiance=np.zeros((300, channels)),
        material=Lambert(albedo=0.5 if channels == 1 else [0.6, 0.4, 0.2]),
    )
    return dark.with_radiance(radiance(dark, LIGHTS), 0.0)


def problem(q: Observations, sigma: float = 1.0) -> Problem:
    return Problem.of(q, np.full_like(q.radiance, sigma), None, BOUNDS)


def starts(rng: np.random.Generator, m: int, c: int = 1) -> tuple[np.ndarray, np.ndarray]:
    p = LIGHTS.positions + rng.normal(0, 0.1, (m, 2, 3))
    return p, rng.uniform(1, 5, (m, 2, c))


@pytest.mark.parametrize("channels", [1, 3])
def test_near_the_truth_all_starts_come_back(rng, channels):
    """Without noise: to float32's accuracy of S, 1e-6, times the condition of the fit, 100."""
    q = seen(rng, channels)
    there = descend(problem(q), Descents.of(*starts(rng, 7, channels)))
    for p, I in zip(there.positions, there.intensities, strict=True):
        np.testing.assert_allclose(p, LIGHTS.positions, atol=1e-4)
        np.testing.assert_allclose(I, np.broadcast_to(LIGHTS.intensities, I.shape), rtol=1e-4)
    assert not there.strayed.any()


def test_starts_do_not_see_each_other(rng):
    """A start ends where it ends alone: bit for bit but for the order of sums."""
    q = seen(rng)
    p, I = starts(rng, 4)
    together = descend(problem(q), Descents.of(p, I), steps=6)
    for i in range(4):
        alone = descend(problem(q), Descents.of(p[i : i + 1], I[i : i + 1]), steps=6)
        np.testing.assert_allclose(alone.positions[0], together.positions[i], atol=1e-9)


def test_never_uphill(rng):
    """More steps never end higher, and chi-square is what the residuals say."""
    q = seen(rng)
    p, I = starts(rng, 5)
    p += rng.normal(0, 0.3, p.shape)
    before = np.full(5, np.inf)
    for steps in (0, 1, 2, 4, 8, 16):
        there = descend(problem(q), Descents.of(p, I), steps=steps)
        assert (there.chi2 <= before).all()
        before = there.chi2
    light = PointLights(there.positions[0], np.maximum(there.intensities[0], 0))
    if (there.intensities[0] >= 0).all():
        again = np.square(q.radiance - radiance(q, light)).sum()
        assert np.isclose(again, there.chi2[0], rtol=1e-4, atol=1e-9)


def test_sigma_is_a_unit(rng):
    """Errors s times as large: the same path, chi-square divided by s^2 (s a power of 2)."""
    q = seen(rng)
    p, I = starts(rng, 3)
    once, wide = (descend(problem(q, s), Descents.of(p, I), steps=3) for s in (1.0, 4.0))
    np.testing.assert_allclose(wide.positions, once.positions, rtol=1e-9)
    np.testing.assert_allclose(wide.chi2 * 16, once.chi2, rtol=1e-9)


@pytest.mark.parametrize("unknown", Unknown)
def test_agrees_with_scipy(rng, unknown):
    """With noise the minimum is the one that scipy's Levenberg-Marquardt finds."""
    q = seen(rng)
    noisy = q.with_radiance(q.radiance + rng.normal(0, 0.01, q.radiance.shape), 0.01)
    p, I = starts(rng, 1)
    ours = descend(problem(noisy, 0.01), Descents.of(p, I), unknown=unknown)

    def split(x):
        return x[:6].reshape(2, 3), x[6:]

    def residual(x):
        S, _ = shading_gradient(noisy, split(x)[0])
        return ((S[:, :, 0] @ split(x)[1]) - noisy.radiance[:, 0]) / 0.01

    def jacobian(x):
        S, g = shading_gradient(noisy, split(x)[0])
        moved = g[:, :, 0] * split(x)[1][None, :, None]
        return np.concatenate([moved.reshape(300, 6), S[:, :, 0]], axis=1) / 0.01

    theirs = least_squares(residual, np.concatenate([p.ravel(), I.ravel()]), jacobian, method="lm")
    np.testing.assert_allclose(ours.chi2[0], 2 * theirs.cost, rtol=1e-6)
    np.testing.assert_allclose(ours.positions[0], split(theirs.x)[0], atol=1e-4)


def test_a_light_that_strays_is_stopped(rng):
    """Section 5.2's early end: only those that go too far, and at once."""
    q = seen(rng)
    p, I = starts(rng, 4)
    p[0] += 0.4
    near = descend(problem(q), Descents.of(p, I), stray=0.45)
    assert near.strayed[0]
    assert not near.strayed[1:].any()
    assert not descend(problem(q), Descents.of(p, I)).strayed.any()


def test_nothing_to_see(rng):
    """A light that no observation sees, and one far outside: finite, and no worse than before."""
    q = seen(rng)
    p = np.array([[[-2.0, -2.0, -2.0], [0.4, -0.2, 1.1]], [[1e5, 1e5, 1e5], [0.0, 0.0, 0.5]]])
    begun = Descents.of(p, np.ones((2, 2, 1)))
    there = descend(problem(q), begun)
    assert np.isfinite(there.chi2).all()
    assert (there.chi2 <= descend(problem(q), begun, steps=0).chi2).all()


# traps


def seen_in(room: PlaneRoom) -> Problem:
    q = room.observe()
    return Problem.of(q, np.ones_like(q.radiance), None, q.bounds)


def explained(there: Descents, posed: Problem) -> np.ndarray:
    """Which starts reach section 6.1's low error."""
    return there.chi2 / posed.rows < LOW_ERROR


def random_starts(rng: np.random.Generator, m: int, k: int) -> tuple[np.ndarray, np.ndarray]:
    """As Table 1's, and with the clearance of its lights from the walls."""
    p = rng.uniform(CLEARANCE, 1 - CLEARANCE, (m, k, 3)) * [1, 1, 0]
    return p, rng.uniform(1, 5, (m, k, 1))


def is_higher(these: np.ndarray, those: np.ndarray) -> bool:
    error = np.sqrt(these.var() / len(these) + those.var() / len(those))
    return bool(these.mean() > those.mean() + 2 * error)


def random_rate(rng: np.random.Generator, **how) -> np.ndarray:
    """Which of 100 random starts of five lights, 25 in each of four rooms, succeed."""
    won = []
    for room in rooms(5, count=4):
        posed = seen_in(room)
        won.append(explained(descend(posed, Descents.of(*random_starts(rng, 25, 5)), **how), posed))
    return np.concatenate(won)


def test_a_dark_light_comes_back():
    """One light explains two as well as it can, and the other is dark where less light is wanted.

    With its logarithm as the unknown, most come back and explain the room. Negative control: an
    intensity clamped at 0 has no gradient left, and nothing moves at all.
    """
    rng = np.random.default_rng(0)
    room = rooms(2, count=1)[0]
    posed = seen_in(room)
    alone = descend(
        posed, Descents.at(PointLights(room.lights.positions[:1], room.lights.intensities[:1]))
    )
    S = shading(posed.surfels, alone.positions[0], None)[:, 0]
    left = S @ alone.intensities[0] - posed.radiance
    places = rng.uniform(CLEARANCE, 1 - CLEARANCE, (40, 3)) * [1, 1, 0]
    places = places[(shading(posed.surfels, places, None)[:, :, 0].T @ left.sum(axis=1)) > 0]
    m = len(places)
    assert m > 10
    p = np.concatenate([np.repeat(alone.positions, m, axis=0), places[:, None]], axis=1)
    I = np.repeat(alone.intensities, m, axis=0)
    faint, none = (np.concatenate([I, np.full((m, 1, 1), x)], axis=1) for x in (1e-6, 0.0))
    assert explained(descend(posed, Descents.of(p, faint)), posed).mean() > 0.75
    held = descend(posed, Descents.of(p, none), unknown=Unknown.POSITIVE)
    assert not held.intensities[:, 1].any()
    np.testing.assert_array_equal(held.positions[:, 1], places)
    assert not explained(held, posed).any()


def test_a_wall_does_not_hold_lights(monkeypatch):
    """Random starts succeed more often when lights keep off the walls than when they do not."""
    with_margin = random_rate(np.random.default_rng(1))
    monkeypatch.setattr(batched, "MARGIN", 0.0)
    assert is_higher(with_margin, random_rate(np.random.default_rng(1)))


def test_a_start_on_the_border(rng):
    """One light begins on the border: inside at the true place, and nobody ever nearer than
    `MARGIN` to a wall."""
    p, I = np.tile(LIGHTS.positions, (4, 1, 1)), np.tile(LIGHTS.intensities, (4, 1, 1))
    p[0, 0, 0], p[1, 0, 1], p[2, 1, 0], p[3, 1, 2] = 1.0, -1.0, -1.0, 2.0
    there = descend(problem(seen(rng)), Descents.of(p, I))
    for found in there.positions:  # in the last, the lights have changed places
        order = np.argsort(-found[:, 0])
        np.testing.assert_allclose(found[order], LIGHTS.positions, atol=1e-3)
    low, high = BOUNDS + MARGIN * 2 * np.array([[1], [-1]])
    for steps in (0, 1, 2, 4, 8):
        wild = descend(
            problem(seen(rng)), Descents.of(p + rng.normal(0, 3, p.shape), I), steps=steps
        )
        assert (wild.positions >= low - 1e-12).all()
        assert (wild.positions <= high + 1e-12).all()


def test_the_first_step_does_not_throw_lights():
    """Five lights a tenth of the side off: damping that begins at 1 keeps more in their basin."""
    rng = np.random.default_rng(2)
    won: dict[float, list] = {1.0: [], 1e-3: []}
    for room in rooms(5, count=3):
        posed, angle = seen_in(room), rng.uniform(0, 2 * np.pi, (50, 5))
        off = 0.1 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=2)
        I = np.repeat(room.lights.intensities[None], 50, axis=0)
        for damping, rate in won.items():
            there = descend(posed, Descents.of(room.lights.positions + off, I), damping=damping)
            rate.append(explained(there, posed))
    careful, trusting = (np.concatenate(rate) for rate in won.values())
    assert is_higher(careful, trusting)


def test_more_random_starts_succeed_than_the_published_methods():
    """All three together, beside intensities of either sign and a first damping of 1e-3."""
    ours = random_rate(np.random.default_rng(3))
    theirs = random_rate(np.random.default_rng(3), unknown=Unknown.FREE, damping=1e-3)
    assert is_higher(ours, theirs)


def test_what_is_near_may_go_up_to_the_border():
    """A light nearer to the border than MARGIN is out of a climb's reach and within a polish's."""
    low, high = np.array([[0.0, 0, 0], [1, 1, 0]])
    light = PointLights([[0.4, 1 - MARGIN / 4, 0]], [2.0])
    q = rooms(2, count=1)[0].observe()
    q = q.with_radiance(radiance(q, light), 0.0)
    problem = Problem.of(q, np.ones_like(q.radiance), None, np.array([low, high]), double=True)
    start = np.array([[[0.4, 1 - MARGIN, 0]]]), np.array([[[2.0]]])
    far = descend(problem, Descents.of(*start))
    near = descend(problem, Descents.of(*start), unknown=Unknown.POSITIVE, damping=1e-3)
    assert np.linalg.norm(far.positions[0, 0] - light.positions[0]) > MARGIN / 2
    np.testing.assert_allclose(near.positions[0, 0], light.positions[0], atol=1e-9)


@pytest.mark.parametrize("unknown", list(Unknown))
def test_a_start_on_an_observation_is_no_crash(unknown):
    """S is infinite on an observation itself: such a start ends where numbers are finite."""
    room = rooms(2, count=1)[0]
    q = room.observe()
    problem = Problem.of(q, np.ones_like(q.radiance), None, q.bounds)
    start = np.array([[q.positions[7], room.lights.positions[1]]])
    with np.errstate(all="ignore"):
        there = descend(
            problem, Descents.of(start, np.ones((1, 2, 1))), unknown=unknown, damping=1e-3
        )
    assert np.isfinite(there.positions).all()
    assert np.isfinite(there.intensities).all()


def test_a_step_by_qr_is_the_step_by_normal_equations():
    """64 bits take a QR of the Jacobian, 32 bits J^T J: the same where short."""
    room = rooms(3, count=1)[0]
    q = room.observe()
    sigma = np.full_like(q.radiance, 0.01)
    near = room.lights.positions[None] + [[[0.02, -0.01, 0]]]
    steps = []
    for double in (False, True):
        problem = Problem.of(q, sigma, None, q.bounds, double=double)
        model = batched.Model(problem, 3, 0.0, Unknown.POSITIVE)
        place = model.begun(near, room.lights.intensities[None], np.array([np.inf]))
        assert bool(place.R.shape[1]) is double
        steps.append(damped_steps(model, place, np.array([1e4]))[0])
    np.testing.assert_allclose(steps[0], steps[1], rtol=1e-3, atol=1e-9)


def exact_place(m=3, k=4):
    """Some hypotheses near exact data of k lights, with their model."""
    room = rooms(k, count=1)[0]
    q = room.observe()
    problem = Problem.of(q, 1e-3 * (q.radiance + 1e-6), None, q.bounds, double=True)
    model = batched.Model(problem, k, 0.0, Unknown.LOGARITHM)
    off = np.random.default_rng(4).normal(0, 0.02, (m, k, 3)) * [1, 1, 0]
    I = np.repeat(room.lights.intensities[None], m, axis=0)
    return model, model.begun(room.lights.positions + off, I, np.full(m, 3.0))


def test_residuals_bend_as_their_second_difference_says():
    """Q^T of the second derivative along a step, by residuals on both sides of it."""
    model, place = exact_place()
    step = np.random.default_rng(5).normal(0, 1e-3, place.x.shape)
    sides = [
        model.place(
            place.x + h * step,
            np.full(3, np.inf),
            *[
                np.zeros((3, 4, 0), np.float32),
                np.zeros((3, 2, 4, 0), np.float32),
                np.full((3, 4, 3), np.inf),
            ],
        )
        for h in (-1, 0, 1)
    ]
    problem = model.problem
    S = [
        batched.slopes(problem.surfels, one.positions.reshape(-1, 3), problem.axes)[0][0]
        for one in sides
    ]
    r = [
        (one.reshape(3, 4, -1) * side.intensities).sum(axis=1) / problem.sigma[:, 0]
        for one, side in zip(S, sides, strict=True)
    ]
    second = ((r[0] - 2 * r[1] + r[2])[:, None] @ place.Q).swapaxes(1, 2)
    np.testing.assert_allclose(
        model.bent(place, step), second, rtol=0.05, atol=1e-3 * np.abs(second).max()
    )


def test_a_bend_that_is_not_finite_leaves_the_straight_step(monkeypatch):
    """Where what lies a tenth of the step ahead is no number, the step does not bend."""
    model, place = exact_place()
    damping = np.full(3, 1e4)
    whole = np.full((3, place.g.shape[1], 1), np.nan)
    monkeypatch.setattr(batched.Model, "bent", lambda *_: whole)
    step, promised = damped_steps(model, place, damping)
    monkeypatch.setattr(batched.Model, "bent", lambda *_: np.zeros_like(whole))
    straight, same = damped_steps(model, place, damping)
    assert np.linalg.norm(straight) > 0
    np.testing.assert_array_equal(step, straight)
    np.testing.assert_array_equal(promised, same)


def test_bent_steps_follow_the_valleys_of_exact_data(monkeypatch):
    """Twenty lights, begun 1 cm off: right in 100 evaluations, in which straight steps creep."""
    room = rooms(20, count=1)[0]
    q = room.observe()
    problem = Problem.of(q, 1e-6 * (q.radiance + 1e-3), None, q.bounds, double=True)
    off = np.random.default_rng(6).normal(0, 0.01, (8, 20, 3)) * [1, 1, 0]
    starts = room.lights.positions + off, np.repeat(room.lights.intensities[None], 8, axis=0)

    def right():
        with one_blas_thread():
            there = descend(problem, Descents.of(*starts), steps=100)
        return (np.abs(there.positions - room.lights.positions).max(axis=(1, 2)) < 1e-5).sum()

    bent = right()
    monkeypatch.setattr(batched.Model, "bent", lambda self, place, step: np.zeros((*step.shape, 1)))
    assert bent == 8
    assert right() < 4


def test_fewer_observations_than_unknowns():
    """A QR of fewer rows than columns still gives a step."""
    room = rooms(3, count=1)[0]
    q = room.observe(5)
    problem = Problem.of(q, np.full_like(q.radiance, 0.01), None, q.bounds, double=True)
    there = descend(problem, Descents.at(room.lights), steps=3)
    assert np.isfinite(there.positions).all()


def test_one_light_that_strays_is_enough(rng):
    """The other stands where it belongs, all the way."""
    p, I = LIGHTS.positions[None].copy(), LIGHTS.intensities[None]
    p[0, 0] += [0.3, 0.3, -0.3]
    there = descend(problem(seen(rng)), Descents.of(p, I), stray=0.4)
    moved = np.linalg.norm(there.positions - p, axis=2)[0]
    assert moved[0] > 0.4 > moved[1]
    assert there.strayed[0]


PILLAR = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]]).with_occluders(
    Outline.disc([0.45, 0.5], 0.12)
)


def shaded_place(blur: float, unknown: Unknown) -> tuple[batched.Model, batched.Place]:
    """Hypotheses of three lights about a pillar, whose light falls short of what is seen."""
    rng = np.random.default_rng(4)
    x, n = PILLAR.sample(200)
    dark = Observations(
        positions=x, normals=n, directions=n, radiance=np.zeros(200), material=Lambert(albedo=np.pi)
    )
    p = np.array([[0.2, 0.3, 0.0], [0.75, 0.6, 0], [0.4, 0.8, 0]])
    q = dark.with_radiance(radiance(dark, PointLights(p, [3.0, 2.0, 1.0]), PILLAR), 0.0)
    sigma = 0.1 * (q.radiance + q.radiance.mean())
    problem = Problem.of(q, sigma, PILLAR, PILLAR.bounds, double=True)
    model = batched.Model(problem, 3, blur, unknown)
    off = rng.normal(0, 0.03, (4, 3, 3)) * [1, 1, 0]
    return model, model.begun(p + off, rng.uniform(1, 4, (4, 3, 1)), np.full(4, 2.0))


@pytest.mark.parametrize("blur", [0.0, 0.05])
@pytest.mark.parametrize("unknown", Unknown)
def test_a_steps_gradient_is_that_of_its_loss(blur, unknown):
    """g = J^T W r is half the derivative of the robust chi-square, soft shadows included.

    By central differences over h, 1e-6 in 64 bits. Soft shadows are kept in 32 bits: with h = 1e-4
    V changes by up to h / blur = 2e-3, of which a rounding, 6e-8, is 3e-5.
    """
    model, place = shaded_place(blur, unknown)
    loss, h = np.full(4, 2.0), 1e-4 if blur else 1e-6
    plain = model.begun(place.positions, place.intensities, np.full(4, np.inf))
    assert (place.chi2 < 0.9 * plain.chi2).all()  # the loss does flatten
    slope = np.zeros_like(place.g)
    for i in range(place.x.shape[1]):
        step = np.zeros_like(place.x)
        step[:, i] = h
        if blur:
            ends = [model.moved(place, s, loss).chi2 for s in (step, -step)]
        else:  # hard shadows are held
            ends = [held(model, place, place.x + s, loss) for s in (step, -step)]
        slope[:, i] = (ends[0] - ends[1]) / (2 * h)
    np.testing.assert_allclose(2 * place.g, slope, rtol=1e-4, atol=1e-4 * np.abs(slope).max())


def held(model: batched.Model, place: batched.Place, x: np.ndarray, loss: np.ndarray) -> np.ndarray:
    """Chi-square at x with the shadows of a place."""
    positions, intensities = model.lights(x)
    S, _ = batched.slopes(model.problem.surfels, positions.reshape(-1, 3), model.problem.axes)
    lit = S.reshape(*place.seen.shape) * place.seen * intensities / model.problem.sigma[:, 0]
    return cauchy(model.left(lit, 0), loss[:, None])[0].sum(axis=1)


@pytest.mark.parametrize("blur", [0.0, 0.05])
def test_both_ways_of_a_step_have_the_same_equations(blur):
    """Q R is the whitened J, r at its side: R^T R = A = J^T W J, and R^T Q^T r = g."""
    _, place = shaded_place(blur, Unknown.LOGARITHM)
    R, b = place.R[:, :, :-1], place.R[:, :, -1:]
    size = np.abs(place.A).max()
    np.testing.assert_allclose(R.swapaxes(1, 2) @ R, place.A, rtol=1e-9, atol=1e-12 * size)
    g = (R.swapaxes(1, 2) @ b)[:, :, 0]
    np.testing.assert_allclose(g, place.g, rtol=1e-9, atol=1e-12 * np.abs(place.g).max())


@pytest.mark.parametrize("blur", [0.0, 0.05])
def test_shadows_are_those_of_where_the_lights_are(blur):
    """After a step of more than half a blur, chi-square is that of a start at its end, to rounding.

    Negative control: with the shadows of where the step began it is another by 5 % and more.
    """
    model, place = shaded_place(blur, Unknown.POSITIVE)
    loss, far = np.full(4, np.inf), np.zeros_like(place.x)
    far[:, :6] = np.random.default_rng(7).uniform(-0.3, 0.3, (4, 6))
    there = model.moved(place, far, loss)
    p, I = model.lights(there.x)
    fresh = model.begun(p, I, loss)
    stale = model.moved(replace(place, taken=there.positions), far, loss)
    np.testing.assert_allclose(there.chi2, fresh.chi2, rtol=1e-9)
    assert (np.abs(stale.chi2 / fresh.chi2 - 1) > 0.05).any()  # else nothing is seen
