"""RGB is three greys, a mixture is its parts, a sum adds them up, a parameter per point is a
point's own."""

from dataclasses import replace

import numpy as np
import pytest

from lightloc import (
    Conductor,
    Lambert,
    Mixed,
    Observations,
    Plastic,
    PointLights,
    Sum,
    radiance,
    shading,
    shading_gradient,
)

LIGHT = np.array([0.4, -0.3, 1.1])
LIGHTS = PointLights([LIGHT, [-1.2, 0.8, 0.4]], [[5.0, 2.0, 7.0], [1.0, 4.0, 3.0]])
FEW_ULPS = 1e-6  # eight float32 spacings: the compiler may fuse multiply and add differently

COLOURED = {
    "lambert": (Lambert, {"albedo": [0.6, 0.4, 0.1]}),
    "gold": (Conductor, {"alpha": 0.2, "eta": [0.2, 0.9, 1.1], "k": [3.9, 2.4, 2.1]}),
    "tinted": (Conductor, {"alpha": 0.2, "specular": [0.9, 0.5, 0.2]}),
    "plastic": (
        Plastic,
        {"alpha": 0.3, "ior": 1.5, "diffuse": [0.8, 0.5, 0.1], "nonlinear": True},
    ),
}


def painted(q: Observations, brdf, channels: int) -> Observations:
    """The same points with another BRDF."""
    black = np.zeros((len(q), channels))
    return replace(q, material=brdf, radiance=black, sigma=0.0)


@pytest.mark.parametrize("name", COLOURED)
def test_rgb_is_three_greys(name, facing):
    """Each channel of a coloured surface under coloured lights is a grey scene of its own."""
    model, values = COLOURED[name]
    q = facing(model(**values), LIGHT)
    B = radiance(q, LIGHTS)
    for c in range(3):
        grey = {key: v[c] if isinstance(v, list) else v for key, v in values.items()}
        alone = radiance(
            painted(q, model(**grey), 1),
            PointLights(LIGHTS.positions, LIGHTS.intensities[:, c]),
        )
        np.testing.assert_allclose(B[:, c], alone[:, 0], rtol=FEW_ULPS)


def test_grey_surface_in_coloured_light(facing):
    """One channel of S serves all three of the lights'; the result has three."""
    q = facing(Lambert(albedo=0.5), LIGHT)
    S = shading(q, LIGHTS.positions)
    assert S.shape == (len(q), 2, 1)
    np.testing.assert_allclose(radiance(q, LIGHTS), S[:, :, 0] @ LIGHTS.intensities, rtol=1e-13)


def test_mixture_is_its_parts(facing, rng):
    """Point i of a mixture shades as BRDF index[i] alone does."""
    brdfs = tuple(model(**values) for model, values in COLOURED.values())
    q = facing(Lambert(albedo=[0.5, 0.5, 0.5]), LIGHT)
    index = rng.integers(0, len(brdfs), len(q))
    S = shading(painted(q, Mixed(brdfs, index), 3), [LIGHT])
    for b, brdf in enumerate(brdfs):
        alone = shading(painted(q, brdf, 3), [LIGHT])
        np.testing.assert_allclose(S[index == b], alone[index == b], rtol=FEW_ULPS)


HALVES = {
    "lambert": (Lambert(albedo=[0.6, 0.4, 0.1]), Lambert(albedo=[0.3, 0.2, 0.05])),
    "lobe": (Conductor(alpha=0.2, specular=0.8), Conductor(alpha=0.2, specular=0.4)),
}


@pytest.mark.parametrize("name", HALVES)
def test_two_halves_are_the_whole(name, facing):
    """f / 2 + f / 2 shades as f does, and so does its slope; half of it does not."""
    whole, half = HALVES[name]
    q = facing(whole, LIGHT)
    S, slope = shading_gradient(q, LIGHTS.positions)
    twice = shading_gradient(painted(q, Sum([half, half]), q.channels), LIGHTS.positions)
    np.testing.assert_allclose(twice[0], S, rtol=FEW_ULPS)
    np.testing.assert_allclose(twice[1], slope, rtol=FEW_ULPS, atol=FEW_ULPS * np.abs(slope).max())
    assert not np.allclose(shading(painted(q, half, q.channels), LIGHTS.positions), S, rtol=0.1)


def test_sum_adds_its_parts(facing, rng):
    """S of a sum is the sum of each part's, grey parts in all channels; mixtures may be parts."""
    base, lobe = Lambert(albedo=0.3), Conductor(alpha=0.3, specular=[0.9, 0.5, 0.2])
    q = facing(Lambert(albedo=[0.5, 0.5, 0.5]), LIGHT)
    mixed = Mixed((base, Sum([lobe])), rng.integers(0, 2, len(q)))
    for parts in ([base, lobe], [mixed, base], [lobe, Sum([base, mixed])]):
        alone = [shading(painted(q, part, 3), LIGHTS.positions) for part in parts]
        S = shading(painted(q, Sum(parts), 3), LIGHTS.positions)
        np.testing.assert_allclose(S, sum(alone), rtol=FEW_ULPS)


def test_some_points_of_a_sum(facing):
    """Points that are picked keep the parameters that they had."""
    q = facing(Lambert(albedo=np.linspace(0.1, 0.9, 96)), LIGHT)
    q = replace(q, material=Sum([q.material, Conductor(alpha=np.linspace(0.2, 0.6, 96))]))
    some = [17, 3, 60]
    np.testing.assert_allclose(shading(q.at(some), [LIGHT]), shading(q, [LIGHT])[some], rtol=1e-6)


@pytest.mark.parametrize(
    ("model", "name", "low", "high", "rest"),
    [
        (Lambert, "albedo", 0.1, 0.9, {}),
        (Conductor, "alpha", 0.1, 0.9, {"eta": 1.2, "k": 7.0}),
        (Conductor, "k", 1.0, 9.0, {"alpha": 0.3, "eta": 1.2}),
        (Conductor, "specular", 0.1, 0.9, {"alpha": 0.3}),
        (Plastic, "diffuse", 0.1, 0.9, {"alpha": 0.3, "ior": 1.5}),
        (Plastic, "specular", 0.1, 0.9, {"alpha": 0.3, "ior": 1.5}),
    ],
)
def test_parameter_per_point(model, name, low, high, rest, facing, rng):
    """A parameter given one per point shades each point as that value alone does."""
    q = facing(Lambert(albedo=0.5), LIGHT)
    which = rng.integers(0, 2, len(q))
    per_point = model(**rest, **{name: np.where(which, high, low)})
    S = shading(painted(q, per_point, 1), [LIGHT])
    for side, value in enumerate((low, high)):
        alone = shading(painted(q, model(**rest, **{name: value}), 1), [LIGHT])
        np.testing.assert_allclose(S[which == side], alone[which == side], rtol=FEW_ULPS)
    assert np.abs(S / alone - 1).max() > 0.01  # the two values do differ
