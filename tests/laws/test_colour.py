"""Colour spaces: published matrices, white stays white, and names as programs write them."""

from __future__ import annotations

import numpy as np
import pytest

from render.colour import ALIKE, PRIMARIES, Colours, adaptation, to_xyz

PUBLISHED = {  # to linear Rec. 709, as printed to five decimals by those who define the spaces
    "ACEScg": [
        [1.70505, -0.62179, -0.08326],
        [-0.13026, 1.14080, -0.01055],
        [-0.02400, -0.12897, 1.15297],
    ],
    "ACES2065-1": [
        [2.52169, -1.13413, -0.38756],
        [-0.27648, 1.37272, -0.09624],
        [-0.01538, -0.15298, 1.16835],
    ],
    "linear Rec. 2020": [
        [1.66049, -0.58764, -0.07285],
        [-0.12455, 1.13290, -0.00835],
        [-0.01815, -0.10058, 1.11873],
    ],
}
BAD = [
    (0.64, 0.33),
    (np.nan,) * 8,
    (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.0),
    (0.64, 0.33, 0.64, 0.33, 0.15, 0.06, 0.3127, 0.329),
    (0.0,) * 8,
]


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_matrices(name):
    """To the last printed digit, and not without Bradford's adaptation where the white differs."""
    ours = Colours.named(name).to_rec_709
    np.testing.assert_allclose(ours, PUBLISHED[name], atol=1.01e-5)
    plain = np.linalg.solve(to_xyz(PRIMARIES["linear Rec. 709"]), to_xyz(PRIMARIES[name]))
    off = np.abs(plain - PUBLISHED[name]).max()
    assert (off > 1e-3) == name.startswith("ACES")  # negative control


@pytest.mark.parametrize("name", PRIMARIES)
def test_white_stays_white(name):
    """Equal amounts of the primaries are white in both, whatever the white is."""
    there = Colours.named(name)
    np.testing.assert_allclose(there.to_rec_709 @ np.ones(3), 1, atol=1e-12)
    assert to_xyz(there.chromaticities)[1].sum() == pytest.approx(1, abs=1e-12)
    old, new = there.chromaticities[3], np.array([0.44757, 0.40745])
    both = adaptation(new, old) @ adaptation(old, new)
    np.testing.assert_allclose(both, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("name", PRIMARIES)
def test_chromaticities_tell_the_space(name, rng):
    """Rounded to four digits they are known; moved further, they are converted as they are."""
    exact = np.array(PRIMARIES[name])
    said = Colours.of({"chromaticities": tuple(exact.ravel().round(4))})
    assert (said.name, str(said)) == (name, name)
    other = exact + 5 * ALIKE
    own = Colours.of({"chromaticities": tuple(other.ravel())})
    assert own.name not in PRIMARIES
    np.testing.assert_allclose(own.chromaticities, other, rtol=1e-12)


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ({}, "linear Rec. 709 (assumed)"),
        ({"oiio:ColorSpace": "linear"}, "linear Rec. 709 (assumed)"),
        ({"oiio:ColorSpace": "a studio's own"}, "linear Rec. 709 (assumed)"),
        ({"oiio:ColorSpace": "ACES - ACEScg"}, "ACEScg"),
        ({"oiio:ColorSpace": "lin_rec709"}, "linear Rec. 709"),
        ({"colorInteropID": "lin_ap1_scene"}, "ACEScg"),
        ({"colorInteropID": "lin_ap0_scene", "oiio:ColorSpace": "linear"}, "ACES2065-1"),
        ({"acesImageContainerFlag": 1}, "ACES2065-1"),
        ({"acesImageContainerFlag": 0, "whiteLuminance": 100.0}, "linear Rec. 709 (assumed)"),
    ],
)
def test_names(attributes, said):
    """What a file's attributes say is said again; nothing is Rec. 709, and assumed."""
    assert str(Colours.of(attributes)) == said


@pytest.mark.parametrize("name", ["srgb_rec709_scene", "sRGB", "g22_ap1_scene", "ACEScct", "HLG"])
def test_encoded_values_are_refused(name, refuses):
    """Values that are no light are refused, by the attribute's name."""
    with refuses("attribute oiio:ColorSpace is "):
        Colours.of({"oiio:ColorSpace": name})


@pytest.mark.parametrize("chromaticities", BAD)
def test_chromaticities_of_no_colours(chromaticities, refuses):
    """Too few, not finite, without a white, or two primaries alike."""
    with refuses("attribute chromaticities is "):
        Colours.of({"chromaticities": chromaticities})
