"""What a sensor hides is told from the values: clipped ones, its floor, its steps; shadows stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import render
from lightloc import (
    Irradiance,
    Lambert,
    Limits,
    Observations,
    Options,
    PointLights,
    Reason,
    localize,
    radiance,
)
from lightloc.given import limits_of
from lightloc.given.limits import ON_A_LINE, ON_A_SURFACE, at_most
from lightloc.given.steps import LEAST, step_of

N = 800
LAMPS = PointLights([[0.4, -0.3, 1.2], [-1.1, 0.9, 0.7]], [10.0, 4.0])


def on_a_floor(n=N, seed=0) -> Observations:
    """Exact B of two lamps over a floor of 4 m, sigma unknown."""
    x = np.random.default_rng(seed).uniform(-2, 2, (n, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    q = Observations(
        positions=x, normals=up, directions=up, radiance=np.zeros(n), material=Lambert(albedo=0.5)
    )
    return q.with_radiance(radiance(q, LAMPS), None)


@pytest.fixture(scope="module")
def shadows() -> Observations:
    """Exact B of a room with an occluder: 2 % of the points are in the dark."""
    room = render.load("box_occluder")
    q = render.observe(room, points=2000, transport="direct")
    assert 0.01 < (q.radiance == 0).mean() < 0.1
    return q.with_radiance(q.radiance, None)


NOISE = {"exact": 0.0, "0.05 %": 5e-4, "1 %": 0.01, "5 %": 0.05}


def noisy(q, level, seed=1):
    return q.radiance * np.random.default_rng(seed).normal(1, level, q.radiance.shape)


@pytest.mark.parametrize("level", NOISE.values(), ids=NOISE)
def test_nothing_is_left_out_of_what_no_sensor_cut(level, shadows):
    """Renders with hard shadows, in 64 and 32 bits, exact and noisy, with negative values too:
    no step, no maximum, no floor."""
    for q in (on_a_floor(), shadows):
        B = noisy(q, level)
        blurred = B + np.random.default_rng(2).normal(0, 0.01 * np.median(B), B.shape)
        for seen in (B, B.astype(np.float32), blurred, np.maximum(blurred, 0)):
            limits = limits_of(q.with_radiance(seen, None), look=True)
            assert not limits.left_out.any() and limits.step == 0 and str(limits) == ""


@pytest.mark.parametrize("bits", [6, 8, 10, 12, 14])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_steps_are_told(bits, kind, shadows):
    """Whole multiples of a step, in floats of either kind, from a dark offset on or not; all but
    what the format's rounding leaves of it."""
    step = shadows.radiance.max() / (2**bits - 2)
    counts = np.round(shadows.radiance / step)
    for offset in (0.0, 0.4321):
        B = (counts * step + offset).astype(kind).astype(float)
        assert step_of(B) == pytest.approx(step, rel=1e-5)


def test_steps_of_their_own_in_each_channel():
    """After a white balance channels have steps of their own; the largest counts. A black channel
    has none, and one that is continuous denies it."""
    counts = np.random.default_rng(0).integers(0, 256, (500, 3)).astype(float)
    assert step_of(counts * [0.5, 1.0, 0.75]) == pytest.approx(1.0)
    assert step_of(counts * [0.5, 1.0, 0.0]) == pytest.approx(1.0)
    counts[:, 1] += np.random.default_rng(1).uniform(0, 1, 500)
    assert step_of(counts) == 0


def test_steps_that_are_none():
    """Not after a gamma; not those of half floats; not of few values, whatever they are."""
    B = on_a_floor().radiance
    counts = np.round(255 * (B / B.max()) ** (1 / 2.2))
    assert step_of(counts) > 0
    assert step_of((counts / 255) ** 2.2) == 0
    assert step_of(B.astype(np.float16).astype(float)) == 0
    few = np.arange(LEAST - 1.0)[:, None]
    assert step_of(few) == 0 and step_of(np.arange(LEAST + 1.0)[:, None]) == 1


@pytest.mark.parametrize("share", [0.02, 0.1])
@pytest.mark.parametrize("bits", [None, 8])
def test_clipped_values_are_told(share, bits, shadows):
    """2 and 10 % of the points at the maximum, continuous or quantized to another maximum than the
    bits' own: those, and no others."""
    for q in (on_a_floor(), shadows):
        B = noisy(q, 0.01)
        top = np.quantile(B, 1 - share)
        seen = np.minimum(B, top)
        if bits:
            seen = np.round(seen / top * (2**bits - 20))
        limits = limits_of(q.with_radiance(seen, None), look=True)
        np.testing.assert_array_equal(limits.clipped, seen[:, 0] == seen.max())
        assert not limits.floored.any() and bool(limits.step) is bool(bits)


@pytest.mark.parametrize("share", [ON_A_LINE, ON_A_SURFACE])
def test_the_last_step_of_a_maximum_is_no_clipping(share):
    """Of the 17 last steps about a quadratic maximum the last holds no larger share than is taken
    for chance, wherever steps begin; one in 17 on a surface, one in sqrt(17) along a line."""
    rng = np.random.default_rng(0)
    r = rng.uniform(-1, 1, 40_000) if share == ON_A_LINE else np.sqrt(rng.uniform(0, 1, 40_000))
    for top in np.linspace(200, 200.9, 10):
        counts = np.floor(top / (1 + r**2) ** 1.5)
        values, held = np.unique(counts, return_counts=True)
        # the last step is narrow where the maximum is just above it
        assert held[-1] / held[-17:].sum() < share
        assert not at_most(counts, 1.0, share).any()
        clipped = np.minimum(counts, values[-20])
        np.testing.assert_array_equal(at_most(clipped, 1.0, share), clipped == values[-20])


def test_full_scale_is_clipped():
    """A single point at 255 of 8 bits may be anything above; at 254 of them it is what it says."""
    q = on_a_floor()
    counts = np.round(q.radiance / q.radiance.max() * 255)
    full = limits_of(q.with_radiance(counts, None), look=True)
    np.testing.assert_array_equal(full.clipped, counts[:, 0] == 255)
    assert (counts >= 254).sum() < 10
    less = limits_of(q.with_radiance(np.minimum(counts, 254), None), look=True)
    assert not less.clipped.any()


def test_symmetry_is_no_clipping():
    """Exact points in a square pattern about a lamp are equal by fours and eights: no maximum."""
    side = np.linspace(-1, 1, 20)
    x = np.stack([*np.meshgrid(side, side), np.zeros((20, 20))], axis=-1).reshape(-1, 3)
    q = Observations(
        positions=x, normals=[[0, 0, 1]] * 400, radiance=np.zeros(400), material=Irradiance()
    )
    B = radiance(q, PointLights([[0, 0, 1]], [1.0]))
    assert np.unique(B, return_counts=True)[1].max() >= 4
    assert not limits_of(q.with_radiance(B, None), look=True).left_out.any()


@pytest.mark.parametrize("share", [0.1, 0.4])
@pytest.mark.parametrize("level", [0.0, 0.01])
def test_a_floor_is_told_from_shadows(share, level, shadows):
    """Where all that is below a level reads 0, B ends with many values just above it, beside dark
    ones: zeros of that kind are left out, all of them; those of the shadows alone are not (above).
    Zeros to which quantization rounded hide nothing."""
    for q in (on_a_floor(), shadows):
        B = noisy(q, level)
        seen = np.where(np.quantile(B, share) > B, 0, B)
        limits = limits_of(q.with_radiance(seen, None), look=True)
        np.testing.assert_array_equal(limits.floored, seen[:, 0] == 0)
        assert f"{(seen == 0).sum()} at the sensor's floor" in str(limits)
        coarse = np.round(B / np.quantile(B, share) / 2)
        assert (coarse == 0).sum() > 20
        assert not limits_of(q.with_radiance(coarse, None), look=True).floored.any()


def test_what_is_said_wins():
    """Named steps, clipped points and floors are taken as they are; without ``look`` nothing else
    is."""
    q = on_a_floor()
    B = np.minimum(np.where(q.radiance < np.median(q.radiance), 0, q.radiance), 1.0)
    q = q.with_radiance(B, None)
    first = np.arange(N) == 0
    told = limits_of(replace(q, saturated=first, floor=0.0, step=0.3), look=True)
    np.testing.assert_array_equal(told.clipped, first)
    assert not told.floored.any() and told.step == 0.3
    named = limits_of(replace(q, floor=0.5), look=False)
    np.testing.assert_array_equal(named.floored, B[:, 0] <= 0.5)
    assert not named.clipped.any()
    assert not limits_of(q, look=False).left_out.any()


@pytest.mark.slow
@pytest.mark.parametrize("cut", ["floor", "top"])
def test_lights_behind_a_sensor_with_limits(cut):
    """40 % zeros, or 10 % clipped: both lamps are found within four standard errors, and it is said
    what was left out. With these values believed, there are others or they lie twice as far off, a
    piece being named that is left out for them, and no answer is sure."""
    q = on_a_floor()
    B = noisy(q, 0.01)
    low = np.where(np.quantile(B, 0.4) > B, 0, B)
    q = q.with_radiance(low if cut == "floor" else np.minimum(B, np.quantile(B, 0.9)), None)
    box = [[-2, -2, 0.1], [2, 2, 2.5]]
    found = localize(q, bounds=box)
    assert len(found.lights) == 2
    off = np.abs(found.lights.positions - LAMPS.positions)
    assert (off <= 4 * found.position_error).all()
    hidden = found.limits.floored if cut == "floor" else found.limits.clipped
    assert hidden.sum() == {"floor": 0.4 * N, "top": 0.1 * N}[cut]
    assert np.isnan(found.residual[hidden]).all() and not np.isnan(found.residual[~hidden]).any()
    assert str(found.limits) in str(found)
    nobody = np.zeros(N, bool)
    nobody[np.argmin(np.abs(B - np.median(B)))] = True
    believed = localize(replace(q, floor=0.0, saturated=nobody), bounds=box)
    assert believed.reason is not Reason.CONVERGED
    wrong = len(believed.lights) != 2
    assert wrong or np.abs(believed.lights.positions - LAMPS.positions).max() > 2 * off.max()


@pytest.mark.slow
def test_given_errors_are_believed():
    """With a sigma that is right, values are what they say; with one that is to be scaled, not."""
    q = on_a_floor()
    B = np.minimum(q.radiance, np.quantile(q.radiance, 0.9))
    box = [[-2, -2, 0.1], [2, 2, 2.5]]
    few = Options(most_lights=1)
    given = localize(q.with_radiance(B, 0.01 * B), bounds=box, options=few)
    assert not given.limits.left_out.any()
    scaled = localize(replace(q.with_radiance(B, 0.01 * B), relative_sigma=True), bounds=box)
    assert scaled.limits.clipped.sum() == 0.1 * N


def test_a_sentence_for_each():
    """Nothing where nothing is hidden."""
    none = np.zeros(4, bool)
    assert str(Limits(none, none)) == ""
    assert str(Limits(~none, none)) == "Left out of 4 observations: 4 clipped."
    both = Limits(np.arange(4) == 1, np.arange(4) > 1, 0.25)
    assert str(both) == (
        "Left out of 4 observations: 1 clipped, 2 at the sensor's floor. "
        "Values are in steps of 0.25."
    )
