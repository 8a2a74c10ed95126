"""Localization: the answer, how sure it is, and why the search stopped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.answer.basis import Assumption, Count, Noise, Way
from lightloc.answer.stored import plain, read, write
from lightloc.answer.verdicts import Verdict
from lightloc.given import PointLights


class Reason(Enum):
    """Why a search stopped; the value is the sentence that a user reads."""

    CONVERGED = "The lights explain every observation to within its error."
    UNDECIDED = "The observations can't decide all that was asked; the verdicts say what."
    EXTENDED = (
        "Every observation is explained, by lights of which one is wide, or several close together."
    )
    NO_GAIN = "The model does not explain the data: a residual is left that no light lowers."
    MOST_LIGHTS = "The largest number of lights allowed was reached, and a residual is left."
    DARK = "No light explains these observations better than darkness, which explains them."
    DARKER = "The published method failed: brighter lights would leave less than no light (B' < 0)."
    NO_VOTES = "The published method failed: no position has a vote."


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    action : str
        What was done, as a reader meets it.
    lights : int
        How many there were then.
    chi2 : float
        Per residual; of the published method its own measure, the mean squared error of B.
    turn : int, optional
        The published method's iteration, or the round of rendering; None of other steps.
    """

    action: str
    lights: int
    chi2: float
    turn: int | None = None


@dataclass(frozen=True, eq=False)
class Localization:
    """What `localize` found.

    Attributes
    ----------
    lights : PointLights
        Brightest first, as the search in direct light left them.
    position_error : (k, 3) array
        Standard errors, in the unit of length.
    intensity_error : (k, c) array
        Standard errors, W/sr.
    covariance : (m, m) array
        Over the free coordinates of each light, then the intensities.
    bound : (k, c) array
        D(p) at each light, W/sr: no light there can be brighter (Eq. 6).
    residual : (n, c) array
        (B - model) / sigma at the observations; NaN where an observation was left out.
    direct : (n, c) array
        The direct radiance that was explained, after removal of indirect light.
    sigma : (n, c) array
        The standard errors used, with those of the removal.
    inseparable : tuple of (int, int)
        Pairs of lights that the data can't tell apart.
    resolution : (k,) array
        Unit of length; two lights nearer to each other than that would look like this one. NaN
        where it was not asked, and for a light that has a width.
    width : (k,) array
        Unit of length; 0 for a point. Where the data show a light of some width, or several so
        close together that they can't be told from one: two equal points so far apart look the
        same. The residual is that of lights so wide.
    certificate : float
        The largest normalized correlation of the residual with a further light anywhere in the
        region, in standard errors: about 4 by chance alone. NaN where it was not asked.
    ambient : (c,) array
        Radiance of the constant ambient term, 0 where none was fitted (section 6.3).
    verdicts : tuple of Verdict
        What the data can't decide.
    chi2 : float
        Robust chi-square per residual, over all; about 1 where the model is right.
    reason : Reason
        Why the search stopped.
    history : tuple of Step
        The steps of the search.
    noise : Noise
        What was taken for noise.
    counts : tuple of Count
        The best lights of each number that was tried, and how likely that number is.
    relative : bool
        Whether all intensities have a common unknown factor.
    assumed : tuple of Assumption
        What the answer takes for granted and the observations were not asked about.
    way : Way
        How interreflected light was treated.
    unit : str
        The unit of length of all positions.
    """

    lights: PointLights
    position_error: NDArray[np.float64]
    intensity_error: NDArray[np.float64]
    covariance: NDArray[np.float64]
    bound: NDArray[np.float64]
    residual: NDArray[np.float64]
    direct: NDArray[np.float64]
    sigma: NDArray[np.float64]
    inseparable: tuple[tuple[int, int], ...]
    resolution: NDArray[np.float64]
    width: NDArray[np.float64]
    certificate: float
    ambient: NDArray[np.float64]
    verdicts: tuple[Verdict, ...]
    chi2: float
    reason: Reason
    history: tuple[Step, ...]
    noise: Noise
    counts: tuple[Count, ...] = ()
    relative: bool = False
    assumed: tuple[Assumption, ...] = ()
    way: Way = Way.DIRECT
    unit: str = "m"

    @property
    def outliers(self) -> int:
        """How many residuals lie beyond the robust loss's scale."""
        return int(self.noise.outliers.sum())

    def to_dict(self) -> dict[str, Any]:
        """The answer without what it says of each observation, as JSON has it.

        Returns
        -------
        dict
            ``format``, ``unit``, ``lights`` (a dict each, which `PointLights.load` reads),
            ``reason``, ``verdicts``, ``chi2``, ``certificate``, ``ambient``, ``noise``,
            ``counts``, ``relative``, ``assumed`` and ``way``; None where a number is unknown.
        """
        return plain(vars(self))

    def save(self, path: str | Path) -> None:
        """Write one ``.npz``, whole or not at all.

        Parameters
        ----------
        path : path
            The file to be written.

        Raises
        ------
        OSError
            The folder is missing or can't be written to.
        """
        write(vars(self), path)

    @staticmethod
    def load(path: str | Path) -> Localization:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        Localization

        Raises
        ------
        ValueError
            Names the file and the field: there is none, it is broken, or of another format.

        Examples
        --------
        >>> Localization.load("nowhere.npz")
        Traceback (most recent call last):
            ...
        ValueError: nowhere.npz: no such file
        """
        try:
            fields = read(path)
            fields["reason"] = Reason[fields["reason"]]
            fields["history"] = tuple(Step(**step) for step in fields["history"])
            return Localization(**fields)
        except KeyError as missing:
            raise ValueError(f"{path}: field {missing} is missing or unknown") from None

    def __str__(self) -> str:
        rows = [f"{len(self.lights)} light(s). {self.reason.value}"]
        for p, I, dp, dI in zip(
            self.lights.positions,
            self.lights.intensities,
            self.position_error,
            self.intensity_error,
            strict=True,
        ):
            where = ", ".join(f"{a:.4f} ± {e:.1g}" for a, e in zip(p, dp, strict=True))
            bright = ", ".join(f"{a:.4f} ± {e:.1g}" for a, e in zip(I, dI, strict=True))
            rows.append(f"  ({where}) {self.unit}   {bright} W/sr")
        rows += [f"  {verdict.sentence}" for verdict in self.verdicts]
        return "\n".join(rows)


def among(found: Localization, used: NDArray[np.bool_]) -> Localization:
    """The answer over (n,) observations of which only those ``used`` were looked at.

    Its arrays over the observations have NaN where one was not.
    """
    if used.all():
        return found

    def spread(value: NDArray[Any], rest: float) -> NDArray[Any]:
        rows = np.full((len(used), value.shape[1]), rest, value.dtype)
        rows[used] = value
        return rows

    return replace(
        found,
        residual=spread(found.residual, np.nan),
        direct=spread(found.direct, np.nan),
        sigma=spread(found.sigma, np.nan),
        noise=replace(found.noise, outliers=spread(found.noise.outliers, False)),
    )
