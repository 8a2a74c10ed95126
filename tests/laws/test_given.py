"""What a search is given besides B: errors nobody knows, values that are no values, units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import (
    Irradiance,
    Lambert,
    NoiseLaw,
    Observations,
    Options,
    PointLights,
    Reason,
    cramer_rao,
    localize,
    radiance,
    remove_indirect,
    shading,
)
from lightloc.answer import Kind
from lightloc.brdf import rows_of
from lightloc.fit import working_sigma
from lightloc.interreflection import rendering
from validation.rooms.plane import rooms

ROOM = rooms(2, count=1)[0]


def said(found):
    return [
        found.lights.positions.tolist(),
        found.lights.intensities.tolist(),
        found.position_error.tolist(),
        found.reason,
        [v.sentence for v in found.verdicts],
    ]


def test_an_unknown_sigma_is_estimated():
    """Without a sigma the answer is that of "estimate", and says what the errors came to."""
    q = ROOM.observe(noise=0.02)
    unknown = q.with_radiance(q.radiance, None)
    assert Observations(**fields_without_sigma(q)).sigma is None
    found = localize(unknown)
    assert said(found) == said(
        localize(q.with_radiance(q.radiance, 0.0), options=Options(noise="estimate"))
    )
    assert found.noise.law is NoiseLaw.ESTIMATED
    bright = q.radiance > np.median(q.radiance)
    ratio = np.median(found.sigma[bright] / q.sigma[bright])
    assert abs(ratio - 1) < 5 / np.sqrt(2 * bright.sum())
    assert localize(q).noise.law is NoiseLaw.GIVEN


def fields_without_sigma(q):
    return {
        name: getattr(q, name)
        for name in ("positions", "normals", "directions", "radiance", "material")
    }


def test_what_needs_a_sigma_refuses_without(refuses):
    """Nothing takes an unknown error for none."""
    q = ROOM.observe(noise=0.02)
    q = q.with_radiance(q.radiance, None)
    for need in (
        lambda: localize(q, method="paper"),
        lambda: cramer_rao(q, ROOM.lights),
        lambda: remove_indirect(q, ROOM.geometry),
    ):
        with refuses("Observations.sigma is unknown"):
            need()


FLOOR = np.random.default_rng(0).uniform(-2, 2, (500, 3)) * [1, 1, 0]
UP = np.tile([0.0, 0.0, 1.0], (500, 1))
TWO = PointLights([[0.5, -0.3, 1.2], [-1.0, 0.8, 0.9]], [10.0, 4.0])
ABOVE = [[-2, -2, 0.1], [2, 2, 2.5]]


def floor(lights=TWO):
    """A floor under lights, exact."""
    dark = Observations(
        positions=FLOOR,
        normals=UP,
        directions=UP,
        radiance=np.zeros(500),
        material=Lambert(albedo=0.5),
    )
    return dark.with_radiance(radiance(dark, lights), 0.0)


def test_exact_data_of_an_unknown_sigma():
    """What is estimated is no less than the arithmetic's own error: no ghost explains that."""
    q = floor()
    found = localize(q.with_radiance(q.radiance, None), bounds=ABOVE)
    assert found.reason is Reason.CONVERGED
    np.testing.assert_allclose(found.lights.positions, TWO.positions, atol=1e-4)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_unlit_observations_of_an_unknown_sigma(share, rng):
    """Where B and the model are 0, nothing tells how large the noise is elsewhere."""
    q = floor(PointLights(TWO.positions[:1], [10.0]))
    B = q.radiance * rng.normal(1, 0.02, (500, 1))
    n = np.array(q.normals)
    n[: int(share * 500)] = [0, 0, -1]
    B[: int(share * 500)] = 0
    seen = replace(q, normals=n, directions=n, facets=n).with_radiance(B, None)
    found = localize(seen, bounds=ABOVE)
    assert len(found.lights) == 1
    assert found.reason in (Reason.CONVERGED, Reason.UNDECIDED)


def test_darkness_of_an_unknown_sigma(rng):
    """Noise about nothing is dark; light that no lamp explains is not."""
    q = floor()
    dark = q.with_radiance(rng.normal(0, 0.01, (500, 1)), None)
    assert localize(dark, bounds=ABOVE).reason is Reason.DARK
    lit = replace(q, normals=-UP, directions=-UP, facets=-UP).with_radiance(
        rng.uniform(1, 2, (500, 1)), None
    )
    assert localize(lit, bounds=ABOVE).reason is not Reason.DARK


@pytest.mark.parametrize("law", ["shot", "constant"])
def test_the_bound_of_an_unknown_sigma(law):
    """D holds at the true lights, by the errors that were estimated: all but one in ten times."""
    below = 0
    for seed in range(10):
        rng, q = np.random.default_rng(seed), floor()
        size = 0.02 * (np.sqrt(q.radiance * q.radiance.mean()) if law == "shot" else 1.0)
        seen = q.with_radiance(q.radiance + size * rng.normal(size=q.radiance.shape), None)
        found = localize(seen, bounds=ABOVE)
        assert len(found.lights) == 2
        below += bool((found.bound[:, 0] < TWO.intensities[:, 0]).any())
    assert below <= 1


def test_saturated_values_are_left_out():
    """What a sensor clipped says nothing: the answer is that of the other observations."""
    q = ROOM.observe(noise=0.01)
    top = np.quantile(q.radiance, 0.9)
    clipped = q.radiance[:, 0] > top
    B = np.minimum(q.radiance, top)
    seen = replace(q, radiance=B, saturated=clipped)
    found = localize(seen)
    assert said(found) == said(localize(q.at(~clipped)))
    assert np.isnan(found.residual[clipped]).all()
    assert np.isfinite(found.residual[~clipped]).all()
    assert len(found.lights) == len(ROOM.lights)
    # as values, what was clipped is explained by no light, and is told as a piece or not at all
    assert localize(replace(q, radiance=B)).reason is not Reason.CONVERGED


def test_steps_add_the_error_of_rounding():
    """Rounding to steps adds their variance, step^2 / 12, to that of the noise."""
    q = ROOM.observe(noise=0.02)
    step = 2 * float(np.median(q.sigma))
    rounded = replace(q, radiance=step * np.round(q.radiance / step), step=step)
    sigma = working_sigma(rounded, Options())
    np.testing.assert_allclose(sigma**2, q.sigma**2 + step**2 / 12, rtol=1e-6)
    z = (rounded.radiance - radiance(q, ROOM.lights)) / sigma
    assert abs(np.square(z).mean() - 1) < 5 * np.sqrt(2 / z.size)
    coarse = replace(q.with_radiance(rounded.radiance.clip(0), 0.0), step=step)
    assert localize(coarse).noise.law is NoiseLaw.GIVEN  # exact but for its steps


def test_a_meter_reads_irradiance(rng):
    """E = I cos / d^2, of any viewing direction; and lights are found from such readings."""
    x = rng.uniform(-2, 2, (400, 3)) * [1, 1, 0]
    up = np.tile([0.0, 0.0, 1.0], (400, 1))
    lights = PointLights([[0.5, 0.3, 1.2], [-1.0, -0.6, 0.9]], [20.0, 12.0])
    dark = Observations(positions=x, normals=up, radiance=np.zeros(400), material=Irradiance())
    to = lights.positions[None] - x[:, None]
    d = np.linalg.norm(to, axis=2)
    expected = (lights.intensities[:, 0] * to[..., 2] / d**3).sum(axis=1)
    E = radiance(dark, lights)
    np.testing.assert_allclose(E[:, 0], expected, rtol=1e-5)
    assert dark.quantity == "irradiance"
    q = dark.with_radiance(E, 0.0)
    found = localize(q, bounds=[[-2, -2, 0.1], [2, 2, 2]])
    order = np.argsort(-lights.intensities[:, 0])
    np.testing.assert_allclose(found.lights.positions, lights.positions[order], atol=1e-3)


def test_the_unit_is_a_word():
    """Nothing depends on it but what is printed."""
    q = ROOM.observe(noise=0.02)
    found = localize(q), localize(replace(q, unit="cm"))
    np.testing.assert_array_equal(*(f.lights.positions for f in found))
    rows = [str(f).splitlines() for f in found]
    assert "position (m)" in rows[0][1] and "intensity (W/sr)" in rows[0][1]
    assert "position (cm)" in rows[1][1] and "W/sr" not in rows[1][1]
    count = len(found[0].lights)
    assert [row.split()[0] for row in rows[1][2 : count + 2]] == [str(i + 1) for i in range(count)]
    assert "  Intensities are in units of 0.0001 W/sr." in rows[1]


def test_rows_of_a_material(sample, facing, rng):
    """Some observations have the materials of those, whatever the material."""
    q = facing(sample.brdf, [0.3, 0.2, 0.9])
    some = rng.permutation(len(q))[: len(q) // 2]
    S = shading(q, [[0.3, 0.2, 0.9]])
    np.testing.assert_array_equal(shading(q.at(some), [[0.3, 0.2, 0.9]]), S[some])


def test_rows_of_a_material_that_is_not_ours():
    """A BSDF that lightloc can't take apart is asked for its own rows."""

    class Own:
        channels = 1

        def bind(self, n):
            return Lambert(albedo=np.linspace(0.1, 0.9, n)).bind(n)

    x = np.zeros((5, 3))
    up = np.tile([0.0, 0.0, 1.0], (5, 1))
    q = Observations(positions=x, normals=up, directions=up, radiance=np.zeros(5), material=Own())
    S = shading(q, [[0, 0, 1]])
    np.testing.assert_array_equal(shading(q.at([4, 1]), [[0, 0, 1]]), S[[4, 1]])
    with pytest.raises(ValueError, match="has 2 points"):
        rows_of(Own(), np.array([4, 1]), 5).bind(3)


def test_a_function_is_asked_for_the_used_rows(rng):
    """H of a function is that of all observations; of those used it is their rows."""
    H = rng.random((6, 2, 1))
    used = np.array([False, True, True, False, True, False])
    seen = ROOM.observe().at(np.arange(3))
    own = rendering(lambda positions: (H, 2 * H), None, seen, used, seed=0)
    mean, error = own.columns(np.zeros((2, 3)), np.arange(2))
    np.testing.assert_array_equal(mean, H[used])
    np.testing.assert_array_equal(error, 2 * H[used])
    np.testing.assert_array_equal(own.columns(np.zeros((2, 3)), [1])[0], H[used][:, 1:])


def test_two_observations(refuses):
    """Too few are said to be too few."""
    q = floor().at([3, 4])
    found = localize(q, bounds=ABOVE)
    assert Kind.TOO_FEW in {v.kind for v in found.verdicts}


def test_refusals(refuses):
    """One sentence each."""
    q = ROOM.observe(noise=0.02)
    n = len(q)
    for name, wrong in {
        "Observations.regions[0]": {"regions": np.ones(n)},
        "Observations.regions holds": {"regions": np.full(n, 0.5), "region_names": ("a", "b")},
        "Observations.saturated[0]": {"saturated": np.full(n, 2)},
        "Observations.step": {"step": -1.0},
        "Observations.floor": {"floor": -1.0},
        "Observations.unit": {"unit": " "},
        "Observations.region_names": {"region_names": None},
        "Observations.interreflected": {"interreflected": "no"},
    }.items():
        with refuses(name):
            replace(q, **wrong)
    with refuses("Observations.directions are missing"):
        Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], radiance=[1], material=Lambert(1))
    with refuses("Observations are empty"):
        q.at([])
    with refuses("all observations are saturated"):
        localize(replace(q, saturated=np.ones(n)))
    for bounds in ([[0.5, 0.5, 0], [0.5, 0.5, 0]], [[1, 1, 0], [0, 0, 0]]):
        with refuses("bounds are no box"):
            localize(q, bounds=bounds)
    with refuses("rows have shape (1, 2)"):
        q.at([[0, 1]])
