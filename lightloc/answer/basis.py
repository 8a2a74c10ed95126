"""What an answer rests on: what was taken for noise, what else was tried, what was assumed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import RATHER, outside
from lightloc.given import PointLights
from lightloc.reprs import short


class NoiseLaw(Enum):
    """Where the standard errors came from; the value is the sentence that a user reads.

    Examples
    --------
    >>> from lightloc import NoiseLaw
    >>> NoiseLaw.GIVEN.value
    'the standard errors as given'
    """

    GIVEN = "the standard errors as given"
    SCALED = "the standard errors as given times an estimated factor"
    ESTIMATED = "the variance is read^2 + shot B + (relative B)^2, estimated with the lights"


class Assumption(Enum):
    """What an answer takes for granted; the value is the sentence that a user reads.

    Examples
    --------
    >>> from lightloc import Assumption
    >>> Assumption.MATERIALS.value
    'the BRDFs are as given'
    """

    ISOTROPIC = "each light shines alike in all directions"
    MATERIALS = "the BRDFs are as given"
    KNOWN_LIGHT = "the light of known emitters is as rendered, and was subtracted"
    NO_AMBIENT = "no unknown light comes from elsewhere"
    ERRORS = "the standard errors are as given"


class Way(Enum):
    """How interreflected light was treated; the value is the sentence that a user reads.

    Examples
    --------
    >>> from lightloc import Way
    >>> Way.DIRECT.value
    'the observations hold none'
    """

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
    scale : (c,) array
        The factor on standard errors that were given, or presumed where none were; 1 where they
        were taken as given.
    scale_error : (c,) array
        Standard error of that factor; 0 where it was not estimated.
    outliers : (n, c) array of bool
        Which residuals are rather outliers than noise: beyond about four standard errors.
    share : float
        The share of the observations that are outliers, 0 to 0.2, as estimated: some outliers look
        like noise.
    read, shot, relative : (c,) array
        The law of the noise where it was estimated: B has the variance read^2 + shot B +
        (relative B)^2, in units of B. NaN where it was not.
    read_error, shot_error, relative_error : (c,) array
        Their standard errors.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Noise, NoiseLaw
    >>> far = np.array([[False], [False], [True], [False]])
    >>> nan = [np.nan]
    >>> Noise(NoiseLaw.SCALED, [1.2], [0.1], far, 0.2, nan, nan, nan, nan, nan, nan).scale
    [1.2]
    """

    law: NoiseLaw
    scale: NDArray[np.float64]
    scale_error: NDArray[np.float64]
    outliers: NDArray[np.bool_] = field(repr=False)
    share: float
    read: NDArray[np.float64]
    shot: NDArray[np.float64]
    relative: NDArray[np.float64]
    read_error: NDArray[np.float64]
    shot_error: NDArray[np.float64]
    relative_error: NDArray[np.float64]

    __repr__ = short

    def leaving(self, residual: NDArray[np.float64]) -> Noise:
        """The same with the outliers among (n, c) residuals, in standard errors.

        Parameters
        ----------
        residual : (n, c) array
            What the lights leave, in standard errors.

        Returns
        -------
        Noise
            The same, with other ``outliers`` and ``share``.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Noise, NoiseLaw
        >>> one, nan, z = np.ones(1), np.full(1, np.nan), np.zeros((50, 1))
        >>> noise = Noise(NoiseLaw.GIVEN, one, 0 * one, z > 0, 0.0, nan, nan, nan, nan, nan, nan)
        >>> z[7] = 30.0
        >>> np.flatnonzero(noise.leaving(z).outliers).tolist()
        [7]
        """
        share, core = outside(residual)
        return replace(self, outliers=core < RATHER, share=share)


@dataclass(frozen=True, eq=False)
class Count:
    """The best lights of one number of lights.

    Parameters
    ----------
    lights : PointLights
        The best that were found, over the observations that the search looks at first.
    chi2 : float
        The robust chi-square that they leave, per residual.
    likely : float
        How likely that number is beside the likeliest, if the model and the standard errors are
        right: ``exp(-d / 2)`` with d the difference in chi-square, each light being charged what
        it must gain.
    allowed : bool
        Whether the observations allow that number: from the lights that are claimed to those that
        gain what chance gains once in twenty searches.

    Examples
    --------
    >>> from lightloc import Count, PointLights
    >>> one = Count(PointLights([[0, 0, 2]], [10.0]), chi2=1.02, likely=1.0, allowed=True)
    >>> len(one.lights)
    1
    """

    lights: PointLights
    chi2: float
    likely: float
    allowed: bool

    __repr__ = short
