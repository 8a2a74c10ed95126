"""The defaults of the search, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Options:
    """Every default of the search, each with its reason. Lengths in parts of the longest side.

    Args:
        most_lights: the search stops at so many.
        outlier: standard errors beyond which a residual counts less and less (Cauchy's loss);
            infinite for plain least squares. At 5, one part in a hundred of the efficiency is
            lost where the noise is Gaussian.
        noise: "given" by the observations' sigma, or to "estimate": sigma is then right but for
            a factor, or, where it is 0, sqrt(B) but for a factor.
        ambient: whether a constant ambient term is fitted too (section 6.3).
    """

    most_lights: int = 24
    outlier: float = 5.0
    noise: Literal["given", "estimate"] = "given"
    ambient: bool = False

    # what is seen
    relative: float = 1e-6  # float32 shading agrees with Mitsuba's to 2e-6 at worst (measured)
    absolute: float = 1e-7  # of the mean radiance
    dark: float = 0.1  # of the median standard error: none is smaller (no sensor is exact)
    sample: int = 1024  # observations that the search looks at; the last polish sees all
    search_noise: float = 0.02  # k of section 6.1, added while lights are still missing

    # where a light may be missing
    cells: int = 12_000  # 0.2 m apart in a room of 100 m^3: under a glossy lobe's width
    cells_2d: int = 2304  # 48 x 48
    candidates: int = 4  # peaks of the gain that are refined before one is chosen
    exchanged: int = 2  # the same, for each light that is taken out and put elsewhere
    zooms: int = 2  # finer grids about a peak, so that a shadow's edge starts on its right side
    zoom: int = 5  # cells along each axis of such a grid

    # hypotheses, and their refinement
    beam: int = 3  # kept when the first pass leaves a residual
    quick: int = 12  # evaluations to judge a candidate
    thorough: int = 30  # evaluations to polish a hypothesis
    thorough_exact: int = 60  # the same for exact observations: 15 lights need it (measured)
    settled_exact: float = 1e-6
    deep: int = 400  # evaluations where an exact answer is near: its valleys are narrow
    settled: float = 1e-5  # relative fall of chi-square at which a polish ends
    settled_deep: float = 1e-9
    blurs: tuple[float, ...] = (0.02, 0.005, 0.0)  # of shadows' edges, one after the other
    typical: float = 0.95  # share of the residuals that the loss takes as they are meanwhile
    near: float = 4.0  # loss a residual, in the wider errors, from which the own ones are tried
    asides: tuple[float, float] = (0.001, 0.03)  # steps across shadows' edges, least and most
    tries: int = 2  # times that such steps may be taken in vain; 0 to take none
    each_aside: int = 5  # such steps a light, at once; twice as many of all lights together,
    errors_aside: float = 4.0  # by so many standard errors
    sharpenings: int = 6  # times that the loss is narrowed, each time at least by half
    promising: float = 20.0  # times the least gain that a quick look may stay behind the best
    exchanges: int = 12  # rounds of exchanging, adding and dropping
    worthwhile: float = 1.0  # chi-square that a round must gain for another
    rough: bool = False  # a first guess to search on from: neither exchanged nor settled nor judged
    patience: int = 2  # lights that may be added in vain, beyond those of the best so far

    # when it ends
    stalled: int = 6  # lights that must lower what is left, where a wrong model could leave that,
    stalled_share: float = 0.25  # to this share,
    model_error: float = 0.15  # of B, in the median
    little: float = 0.45  # share that the last light before those must not leave
    significant: float = 5.0  # least gain in chi-square a new parameter, in units of the noise
    shared: float = 0.0  # least gain in chi-square a residual, where errors are shared by
    # neighbours and do not average out; `after_removal` once indirect light was removed, and
    # where the model proves wrong
    after_removal: float = 0.08
    unlikely: float = 5.0  # standard deviations of chi-square above what noise explains
    slack: float = 1.0  # chi-square a residual that noise is allowed; `slack_after_removal`
    slack_after_removal: float = 1.3  # where the errors are estimates themselves
    silent: float = 0.03  # chi-square a residual of exact observations: float32's own, measured

    # what counts as known
    sure_position: float = 0.01  # of the longest side: 95 % intervals up to this (section 6.1)
    sure_intensity: float = 0.05  # of the intensity, likewise
    cluster: float = 0.05  # lights that could be two so far apart are a cluster (section 6.1)
