"""What an answer rests on: what was taken for noise, what else was tried, what was assumed."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from lightloc.given import PointLights


class NoiseLaw(Enum):
    """Where the standard errors came from; the value is the sentence that a user reads."""

    GIVEN = "the standard errors as given"
    ESTIMATED = "the standard errors as given, or those of shot noise, times an estimated factor"


class Assumption(Enum):
    """What the answer takes for granted and the observations were not asked about."""

    ISOTROPIC = "each light shines alike in all directions"
    MATERIALS = "the BRDFs are as given"
    NO_AMBIENT = "no light comes from elsewhere"
    ERRORS = "the standard errors are as given"


class Way(Enum):
    """How interreflected light was treated."""

    DIRECT = "the observations hold none"
    GATHERED = "gathered from the observations and subtracted (footnote 1)"
    RENDERED = "rendered for the lights found, subtracted, and found again"


@dataclass(frozen=True, eq=False)
class Noise:
    """What was taken for noise.

    Parameters
    ----------
    law : NoiseLaw
        Where the standard errors came from.
    scale : float
        Factor on those that were given or presumed; 1 where they hold as given.
    scale_error : float
        Its standard error; 0 where nothing was estimated.
    outliers : (n, c) array of bool
        Residuals beyond the robust loss's scale.
    """

    law: NoiseLaw
    scale: float
    scale_error: float
    outliers: NDArray[np.bool_] = field(repr=False)

    @property
    def share(self) -> float:
        """Of the residuals: how many are outliers."""
        return float(self.outliers.mean())


@dataclass(frozen=True, eq=False)
class Count:
    """The best lights of one number of lights.

    Parameters
    ----------
    lights : PointLights
        The best that were found, over the observations that the search looks at first.
    chi2 : float
        Per residual.
    likely : float
        How likely that number is beside the likeliest, if the model and the standard errors are
        right: ``exp(-d / 2)`` with d the difference in chi-square, each light being charged what
        it must gain.
    """

    lights: PointLights
    chi2: float
    likely: float
