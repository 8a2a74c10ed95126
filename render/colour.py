"""What the numbers of a picture mean as colours: its primaries, and the way to linear Rec. 709."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

D65, ACES_WHITE = (0.3127, 0.3290), (0.32168, 0.33767)
PRIMARIES = {  # chromaticities x, y of red, green, blue and white
    "linear Rec. 709": ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), D65),
    "ACEScg": ((0.713, 0.293), (0.165, 0.830), (0.128, 0.044), ACES_WHITE),
    "ACES2065-1": ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.0770), ACES_WHITE),
    "linear Rec. 2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), D65),
    "linear P3-D65": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060), D65),
    "linear Adobe RGB": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), D65),
}
REC_709 = "linear Rec. 709"
ALIKE = 1e-3  # chromaticities are given with three digits or more

SPELLED = {  # letters and digits of the names in use, without "scene"
    **dict.fromkeys(("linrec709", "linearrec709", "linearrec709srgb"), REC_709),
    **dict.fromkeys(("linsrgb", "linearsrgb", "utilitylinearsrgb"), REC_709),
    **dict.fromkeys(("acescg", "linap1", "acesacescg", "linearap1"), "ACEScg"),
    **dict.fromkeys(("aces20651", "linap0", "acesaces20651", "linearap0"), "ACES2065-1"),
    **dict.fromkeys(("linrec2020", "linearrec2020"), "linear Rec. 2020"),
    **dict.fromkeys(("linp3d65", "linearp3d65"), "linear P3-D65"),
    **dict.fromkeys(("linadobergb", "linearadobergb"), "linear Adobe RGB"),
}
ENCODED = ("srgb", "gamma", "g18", "g22", "g24", "g26", "acescc", "log", "pq", "hlg", "display")
NAMED_BY = ("colorInteropID", "oiio:ColorSpace")

BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
"""From XYZ to the cones' responses in which a change of white is a change of scale."""


@dataclass(frozen=True)
class Colours:
    """A linear colour space.

    Parameters
    ----------
    name
        As a user reads it.
    chromaticities
        (4, 2) x and y of red, green, blue and white.
    assumed
        Whether nothing in the file says so.
    """

    name: str
    chromaticities: NDArray[np.float64]
    assumed: bool = False

    @staticmethod
    def of(attributes: Mapping[str, Any]) -> Colours:
        """What the attributes of an EXR file say; linear Rec. 709 where they say nothing.

        Raises ValueError, its sentence beginning with the attribute, where values are encoded or
        the chromaticities are none of any colours.
        """
        given = attributes.get("chromaticities")
        if given is not None:
            return _measured(given)
        for attribute in NAMED_BY:
            said = attributes.get(attribute)
            if said:
                word = re.sub("[^a-z0-9]", "", str(said).lower()).removesuffix("scene")
                if "lin" not in word and any(part in word for part in ENCODED):
                    raise ValueError(
                        f"attribute {attribute} is '{said}', whose values are encoded for display "
                        "or storage; save linear ones"
                    )
                if word in SPELLED:
                    return Colours.named(SPELLED[word])
        if attributes.get("acesImageContainerFlag") == 1:
            return Colours.named("ACES2065-1")
        return Colours.named(REC_709, assumed=True)

    @staticmethod
    def named(name: str, assumed: bool = False) -> Colours:
        """One of `PRIMARIES`."""
        return Colours(name, np.array(PRIMARIES[name]), assumed)

    @property
    def to_rec_709(self) -> NDArray[np.float64]:
        """(3, 3) to linear Rec. 709; white stays white."""
        if self.name == REC_709:
            return np.eye(3)
        wanted = np.array(PRIMARIES[REC_709])
        there = adaptation(self.chromaticities[3], wanted[3]) @ to_xyz(self.chromaticities)
        return np.asarray(np.linalg.solve(to_xyz(wanted), there), np.float64)

    def __str__(self) -> str:
        return f"{self.name} (assumed)" if self.assumed else self.name


def to_xyz(chromaticities: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) from linear RGB to XYZ, with Y = 1 for white (1, 1, 1).

    Examples
    --------
    >>> to_xyz(PRIMARIES["linear Rec. 709"])[1].round(4).tolist()  # the luminance of RGB
    [0.2126, 0.7152, 0.0722]
    """
    xy = np.asarray(chromaticities, float)
    axes = np.column_stack([xy, 1 - xy.sum(axis=1)]).T
    white = axes[:, 3] / xy[3, 1]
    return axes[:, :3] * np.linalg.solve(axes[:, :3], white)


def adaptation(old: ArrayLike, new: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) from XYZ to XYZ: what looks alike under another white (x, y), after Bradford."""
    cones = [BRADFORD @ [x / y, 1.0, (1 - x - y) / y] for x, y in (np.array(old), np.array(new))]
    return np.linalg.solve(BRADFORD, (cones[1] / cones[0])[:, None] * BRADFORD)


def _measured(given: Any) -> Colours:
    xy = np.array(given, float)
    bad = f"attribute chromaticities is {given}; expected x and y of red, green, blue and white"
    if xy.shape != (8,) or not np.isfinite(xy).all() or not xy[7] > 0:
        raise ValueError(bad)
    xy = xy.reshape(4, 2)
    for name, known in PRIMARIES.items():
        if np.abs(xy - known).max() <= ALIKE:
            return Colours.named(name)
    try:
        usable = np.abs(np.linalg.inv(to_xyz(xy))).max() < 1 / ALIKE
    except np.linalg.LinAlgError:
        usable = False
    if not usable:
        raise ValueError(bad)
    return Colours("RGB of its own chromaticities", xy)
