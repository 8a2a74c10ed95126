"""Localization: the answer, how sure it is, and why the search stopped."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

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

    Args:
        action: what was done, as a reader meets it.
        lights: how many there were then.
        chi2: per residual; of the published method its own measure, the mean squared error of B.
        turn: the published method's iteration, or the round of rendering; None of other steps.
    """

    action: str
    lights: int
    chi2: float
    turn: int | None = None


@dataclass(frozen=True, eq=False)
class Localization:
    """What `localize` found.

    Args:
        lights: brightest first, as the search in direct light left them.
        position_error: (k, 3) standard errors, metres.
        intensity_error: (k, c) standard errors, W/sr.
        covariance: (m, m) over the free coordinates of each light, then the intensities.
        bound: (k, c) D(p) at each light, W/sr: no light there can be brighter.
        residual: (n, c) (B - model) / sigma at the observations.
        direct: (n, c) the direct radiance that was explained, after removal of indirect light.
        sigma: (n, c) the standard errors used, with those of the removal.
        inseparable: pairs of lights that the data can't tell apart.
        resolution: (k,) metres; two lights nearer to each other than that would look like this
            one. NaN where it was not asked, and for a light that has a width.
        width: (k,) metres; 0 for a point. Where the data show a light of some width, or several so
            close together that they can't be told from one: two equal points so far apart look
            the same. The residual is that of lights so wide.
        certificate: the largest normalized correlation of the residual with a further light
            anywhere in the region, in standard errors: about 4 by chance alone. NaN where it was
            not asked.
        ambient: (c,) radiance of the constant ambient term, 0 where none was fitted.
        verdicts: what the data can't decide.
        chi2: robust chi-square per residual, over all; about 1 where the model is right.
        outliers: how many residuals lie beyond the robust loss's scale.
        reason: why the search stopped.
        history: the steps of the search.
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
    outliers: int
    reason: Reason
    history: tuple[Step, ...]

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
            rows.append(f"  ({where}) m   {bright} W/sr")
        rows += [f"  {verdict.sentence}" for verdict in self.verdicts]
        return "\n".join(rows)
