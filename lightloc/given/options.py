"""What a user may want to set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from lightloc.checks import number

NoiseGiven = Literal["given", "scaled", "estimate"]
Free = Literal["albedo", "ambient", "gamma"]


@dataclass(frozen=True)
class Options:
    """Options of the search of `localize`; the published method has `Paper` in their place.

    Parameters
    ----------
    most_lights : int
        Largest number of lights.
    outlier : float
        Standard errors beyond which a residual counts less and less (Cauchy's loss); infinite for
        plain least squares. At 5, one part in a hundred of the efficiency is lost where the noise
        is Gaussian.
    noise : {"given", "scaled", "estimate"}
        "given" takes the observations' sigma as right; "scaled" as right but for a factor, which is
        estimated. "estimate" does not look at it: the variance is read^2 + shot B + (relative B)^2
        at the model's B, and the three are estimated together with the lights. Where sigma is None,
        that is always done, and it is as well where sigma is 0 and a factor was asked for.
    ambient : bool
        Whether a constant ambient term is fitted too (section 6.3).
    sample : int
        Number of observations that the search looks at; the last polish sees all.
    cells, cells_2d : int
        Number of positions at which the search asks whether a light is missing there, in 3D and in
        2D.
    relative, absolute : float
        Standard errors of the arithmetic, as a share of B and as a share of the mean radiance.
    false_alarm : float
        Probability that a light is claimed which is not there, in the whole search: above 0 and
        below 1. What chance gains is simulated in the room at hand.
    unlikely : float
        Standard deviations by which chi-square may exceed its mean and still be explained by noise.
    sure_position, sure_intensity : float
        Largest half-width of a 95 % interval at which a position counts as known, as a share of the
        region's longest side, and an intensity, as a share of itself (section 6.1).
    cluster : float
        A light counts as a possible cluster where two lights further apart than this, as a share of
        the region's longest side, might look the same (section 6.1).
    free : tuple of {"albedo", "ambient", "gamma"}
        What is fitted together with the lights, with its errors, and told in
        ``Localization.departures``: a factor on the albedo of each region, or of what faces each
        side where there are no regions, beside that of the largest (a factor on all of them is one
        on all intensities); light from everywhere; the power of radiance that values are.

    Raises
    ------
    ValueError
        If a value is none that the field can have.

    Examples
    --------
    >>> from lightloc import Options
    >>> Options(most_lights=4).most_lights
    4
    """

    most_lights: int = 24
    outlier: float = 5.0
    noise: NoiseGiven = "given"
    ambient: bool = False
    sample: int = 1024
    cells: int = 4096  # 0.3 m apart in a room of 100 m^3: what a cell steps over is found alone
    cells_2d: int = 2304  # 48 x 48
    relative: float = 1e-6  # float32 shading agrees with Mitsuba's to 2e-6 at worst (measured)
    absolute: float = 1e-7
    false_alarm: float = 0.001
    unlikely: float = 5.0
    sure_position: float = 0.01
    sure_intensity: float = 0.05
    cluster: float = 0.05
    free: tuple[Free, ...] = ()

    def __post_init__(self) -> None:
        if self.noise not in get_args(NoiseGiven):
            raise ValueError(
                f"Options.noise is {self.noise!r}; expected 'given', 'scaled' or 'estimate'"
            )
        for name in ("most_lights", "sample", "cells", "cells_2d"):
            number(f"Options.{name}", getattr(self, name), 1, whole=True)
        for name in ("relative", "absolute"):
            number(f"Options.{name}", getattr(self, name))
        number("Options.false_alarm", self.false_alarm, above=True)
        if self.false_alarm >= 1:
            raise ValueError(f"Options.false_alarm is {self.false_alarm:g}; expected less than 1")
        for name in ("outlier", "unlikely", *SURE):
            number(f"Options.{name}", getattr(self, name), above=True)
        if isinstance(self.free, str) or not set(self.free) <= set(get_args(Free)):
            raise ValueError(
                f"Options.free is {self.free!r}; expected some of 'albedo', 'ambient' and 'gamma'"
            )
        object.__setattr__(self, "free", tuple(dict.fromkeys(self.free)))


SURE = ("sure_position", "sure_intensity", "cluster")
"""What counts as known."""
