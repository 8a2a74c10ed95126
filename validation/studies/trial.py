"""A trial: one scene, localized and judged. Every study's tables are made from these."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lightloc import Geometry, Localization, Observations, PointLights, cramer_rao
from validation.judge import Comparison, Tolerance, compare, is_solved, within
from validation.studies.solver import found

SIDE = 1.0  # of every room, metres
DIAGONAL = math.sqrt(2) * SIDE  # of its floor: the judge's scale
TIGHT = 0.001  # of the side: what noiseless answers should keep to


SOLVED = Tolerance(0.01, 5.0)  # as in Table 1


@dataclass(frozen=True)
class Trial:
    """One scene: a line of a study's data.

    Parameters
    ----------
    name
        The row and the scene's number, as ``lights-8-017``.
    lights
        How many there are.
    found
        How many the answer has.
    missed
        True lights that no found one lies near, by the judge's own radius.
    ghosts
        Found lights that lie near no true one.
    unflagged
        Of these, how many no verdict names.
    position
        The worst distance of a matched light, percent of the side.
    intensity
        The worst error of a matched light's intensity, percent.
    solved
        Whether the count is right and every light within the study's tolerance.
    tight
        Whether it is solved and within 0.1 % of the side.
    reason
        Why the search stopped.
    verdicts
        The kinds of what the data can't decide.
    certificate
        The largest correlation of the residual with a further light, standard errors.
    chi2
        Chi-square per residual, robust.
    seconds
        Of the search, on one thread.
    ceiling
        Probability of being solved at the Cramér-Rao bound.
    errors
        Distance of each true light from its own, metres; none where the count is wrong.
    bounds
        The bound on their root mean square, metres, in the same order.
    z
        Error over stated error of each light, a list of (coordinates, then intensity).
    """

    name: str
    lights: int
    found: int
    missed: int
    ghosts: int
    unflagged: int
    position: float | None
    intensity: float | None
    solved: bool
    tight: bool
    reason: str
    verdicts: list[str]
    certificate: float
    chi2: float
    seconds: float
    ceiling: float | None
    errors: list[float]
    bounds: list[float]
    z: list[list[float]]


def trial(
    name: str,
    q: Observations,
    truth: PointLights,
    geometry: Geometry | None = None,
    *,
    known: Observations | None = None,
    tolerance: Tolerance = SOLVED,
    diagonal: float | None = None,
    region: ArrayLike | None = None,
) -> Trial:
    """Localize what is seen of a room and judge the answer.

    Parameters
    ----------
    name
        The row and the scene's number.
    q
        What is seen.
    truth
        Its lights, one channel.
    geometry
        What occludes; nothing does where None.
    known
        The same observations without noise, but with the noise's standard error, from which the
        Cramér-Rao bound is taken; there is none where None.
    tolerance
        How near counts as solved.
    diagonal
        Of a room in three dimensions, metres, which then stands for the side in all that is a part
        of it, as in the suite; a 2D room of side 1 where None.
    region : (2, 3) array_like
        Corners of what may hold lights, metres; the `bounds` of `localize`.
    """
    clock = time.perf_counter()
    answer = found(q, geometry, bounds=region)
    seconds = time.perf_counter() - clock
    return judged(
        name,
        answer,
        q,
        truth,
        geometry,
        seconds=seconds,
        known=known,
        tolerance=tolerance,
        diagonal=diagonal,
    )


def judged(
    name: str,
    answer: Localization,
    q: Observations,
    truth: PointLights,
    geometry: Geometry | None = None,
    *,
    seconds: float,
    known: Observations | None = None,
    tolerance: Tolerance = SOLVED,
    diagonal: float | None = None,
) -> Trial:
    """Judge an answer that took so many seconds; all else as of `trial`."""
    side = SIDE if diagonal is None else diagonal
    beside = compare(answer.lights, truth, diagonal=diagonal or DIAGONAL)
    right = is_solved(answer.lights, truth, tolerance, side)
    ceiling, bounds = None, []
    if known is not None:
        bound = cramer_rao(known, truth, geometry)
        share = tolerance.intensity / 100 * truth.intensities[:, 0]
        ceiling = within(bound.covariance, tolerance.position * side, share)
        bounds = np.linalg.norm(bound.position, axis=1).tolist()
    pairs = beside.pairs
    matched = compare(answer.lights, truth, radius=math.inf) if beside.count_right else None
    return Trial(
        name=name,
        lights=len(truth),
        found=len(answer.lights),
        missed=len(beside.missed),
        ghosts=len(beside.ghosts),
        unflagged=len(set(beside.ghosts).difference(*(v.lights for v in answer.verdicts))),
        position=100 * max(pair.distance for pair in pairs) / side if pairs else None,
        intensity=beside.worst_intensity_percent,
        solved=right,
        tight=right
        and is_solved(answer.lights, truth, Tolerance(TIGHT, tolerance.intensity), side),
        reason=answer.reason.name,
        verdicts=sorted({verdict.kind.name for verdict in answer.verdicts}),
        certificate=float(answer.certificate),
        chi2=float(answer.chi2),
        seconds=round(seconds, 3),
        ceiling=ceiling,
        errors=[pair.distance for pair in matched.pairs] if matched else [],
        bounds=bounds,
        z=_z_scores(answer, truth, matched, q) if matched else [],
    )


def _z_scores(
    answer: Localization, truth: PointLights, matched: Comparison, q: Observations
) -> list[list[float]]:
    """Each light's errors over the answer's own, along the axes that it may move along."""
    axes = np.flatnonzero(np.ptp(q.bounds, axis=0) > 0)
    scores = []
    for pair in matched.pairs:
        off = answer.lights.positions[pair.found] - truth.positions[pair.true]
        brighter = answer.lights.intensities[pair.found, 0] - truth.intensities[pair.true, 0]
        error = np.append(off[axes], brighter)
        own = np.append(
            answer.position_error[pair.found, axes], answer.intensity_error[pair.found, 0]
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            scores.append((error / own).tolist())
    return scores
