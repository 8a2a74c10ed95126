"""What a user may want to set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Options:
    """The search's options. Lengths in parts of the longest side.

    Parameters
    ----------
    most_lights : int
        Maximum number of lights.
    outlier : float
        Standard errors beyond which a residual counts less and less (Cauchy's loss); infinite for
        plain least squares. At 5, one part in a hundred of the efficiency is lost where the noise
        is Gaussian.
    noise : {"given", "estimate"}
        By the observations' sigma, or sigma is right but for a factor, or, where it is 0 or
        unknown, the square root of B but for a factor.
    ambient : bool
        Whether a constant ambient term is fitted too (section 6.3).
    sample : int
        Observations that the search looks at; the last polish sees all.
    cells, cells_2d : int
        Positions that are asked whether a light is missing there.
    relative, absolute : float
        Errors of the arithmetic, of B and of the mean radiance.
    significant : float
        Least gain in chi-square per new parameter, in units of the noise.
    unlikely : float
        Standard deviations of chi-square above what noise explains.
    sure_position, sure_intensity : float
        What counts as known: 95 % intervals up to this, of the longest side and of the intensity
        (section 6.1).
    cluster : float
        Lights that could be two so far apart are a cluster (section 6.1).

    Examples
    --------
    >>> Options(most_lights=4).most_lights
    4
    """

    most_lights: int = 24
    outlier: float = 5.0
    noise: Literal["given", "estimate"] = "given"
    ambient: bool = False
    sample: int = 1024
    cells: int = 4096  # 0.3 m apart in a room of 100 m^3: what a cell steps over is found alone
    cells_2d: int = 2304  # 48 x 48
    relative: float = 1e-6  # float32 shading agrees with Mitsuba's to 2e-6 at worst (measured)
    absolute: float = 1e-7
    significant: float = 5.0
    unlikely: float = 5.0
    sure_position: float = 0.01
    sure_intensity: float = 0.05
    cluster: float = 0.05
