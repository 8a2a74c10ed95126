"""Where no lights explain what is lit: the one light that explains most of it.

A search by the observations' own errors is at a loss there. Each residual is far beyond its error,
Cauchy's loss is nearly flat, and what explains a few dark observations exactly beats what explains
most of the light. So B is looked at as if its errors were as large as B itself: what a light leaves
is then compared by its squares.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import (
    MARGIN,
    Kind,
    Localization,
    Reason,
    Step,
    judged,
    mirrored,
    unexplained,
)
from lightloc.fields import intensity_distance
from lightloc.fit import (
    FIRST_DAMPING,
    MOST_OUTLIERS,
    Criterion,
    Descents,
    Fit,
    amounts,
    errors_at,
    fit_of,
    intensities,
    resolution,
    robust,
)
from lightloc.given import Geometry, Observations, Options
from lightloc.search.births import places
from lightloc.search.climb import STAGE
from lightloc.search.ground import Ground
from lightloc.search.moves import distinct
from lightloc.search.polish import polished
from lightloc.search.view import View

POOR = 0.25
"""Share of the squares of B that lights leave, from which a single one is asked for."""

MUCH = 2 / 3
"""Share of what the lights found leave that a single one must not exceed, to be told instead."""

STARTS, QUICK, THOROUGH = 8, 12, 60
"""Places that are tried, evaluations to judge each, and to refine the best."""


def best_one(
    found: Localization,
    q: Observations,
    geometry: Geometry | None,
    bounds: NDArray[np.float64],
    o: Options,
    seed: int,
) -> Localization:
    """The answer, with one light in place of those found if that explains far more of B.

    Only where those explain neither the observations nor most of B; outliers apart, where they are
    few of what is lit. ``q`` are the observations that ``found`` is of, (2, 3) ``bounds`` the
    region.
    """
    if found.reason not in (Reason.NO_GAIN, Reason.MOST_LIGHTS):
        return found
    size = size_of(found.direct, few=3 + found.direct.shape[1])
    off = found.residual * found.sigma / size
    left = robust(off, o.outlier)
    lit = np.abs(found.direct) > o.outlier * found.sigma
    few = (lit & found.noise.outliers).sum() < MOST_OUTLIERS * lit.sum()
    most = ~(found.noise.outliers & few)
    if robust(off * most, o.outlier) < POOR * robust(found.direct / size * most, o.outlier):
        return found
    wide = np.broadcast_to(size, found.direct.shape)
    q = q.with_radiance(found.direct, wide)
    o_wide = replace(o, noise="given", most_lights=1)
    ground = Ground.of(q, geometry, bounds, o_wide, seed)
    view = ground.view(ground.whole, o_wide, Criterion.of(o_wide, ground.chance))
    one = single(view)
    if one is None:
        return found
    there = polished(ground.whole, one, o.outlier, THOROUGH)
    fit = fit_of(ground.whole, there.lights, o.outlier)
    return told(found, ground, fit, q, o) if fit.cost < MUCH * left else found


def size_of(B: NDArray[np.float64], few: int) -> NDArray[np.float64]:
    """(c,) the root of the mean square of (n, c) radiances, without the ``few`` largest."""
    squares = np.sort(np.square(B), axis=0)
    typical = np.sqrt(squares[: max(1, len(B) - few)].mean(axis=0))
    return np.where(typical > 0, typical, np.where(squares[-1] > 0, np.sqrt(squares[-1]), 1.0))


def single(view: View) -> Descents | None:
    """The light that explains most, roughly; None where no position lights anything."""
    stage = view.through(0.0, STAGE[1])
    z, loss = stage.problem.radiance / stage.problem.sigma, view.criterion.likelihood.scale
    none = Descents.at(view.darkness.lights)
    found = places(stage, none, stage.problem.without_ambient(z), loss, STARTS)
    if not len(found):
        return None
    lit = np.stack([intensities(stage.problem, p[None]) for p in found])
    tried = stage.descended(Descents.of(found[:, None], lit), FIRST_DAMPING, QUICK, loss)
    return distinct(stage.descended(tried, FIRST_DAMPING, THOROUGH, loss), 1, 0.0)


def told(
    found: Localization, ground: Ground, fit: Fit, q: Observations, o: Options
) -> Localization:
    """The answer with a fit's one light, whose errors are as large as what it leaves."""
    lights, problem = fit.lights, ground.whole
    off = np.sqrt(np.square(fit.residual).mean(axis=0))
    doubtful = replace(problem, sigma=problem.sigma * np.maximum(off, np.finfo(float).tiny))
    errors = errors_at(doubtful, lights)
    own = replace(problem, sigma=found.sigma)
    fit = fit_of(own, lights, o.outlier)
    top, _ = intensity_distance(
        q.with_radiance(found.direct, found.sigma), lights.positions, problem.geometry, MARGIN
    )
    kept = [v for v in found.verdicts if v.kind is Kind.HIDDEN]
    explained = 1 - float(
        np.square(off).sum() / np.square(found.direct / problem.sigma).mean(axis=0).sum()
    )
    verdicts = [
        unexplained(fit, own, max(len(count.lights) for count in found.counts), explained),
        *kept,
        *mirrored(doubtful, lights, 1.0, Criterion.of(o), o),
    ]
    answer = replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity.reshape(lights.intensities.shape),
        covariance=errors.covariance,
        bound=top,
        residual=fit.residual,
        inseparable=(),
        resolution=resolution(doubtful, lights),
        width=np.zeros(1),
        certificate=np.nan,
        ambient=found.ambient if problem.ambient is None else amounts(problem, lights.positions)[1],
        verdicts=tuple(verdicts),
        chi2=fit.cost / own.rows,
        history=(*found.history, Step("the one light that explains most", 1, fit.cost / own.rows)),
        noise=found.noise.leaving(fit.residual),
    )
    return judged(answer, doubtful, o)
