"""The method on one page: remove indirect light, search, polish, judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.candidates import Dictionary
from lightloc.checks import array
from lightloc.fields import Grid, intensity_distance
from lightloc.geometry import Geometry
from lightloc.indirect import remove_indirect
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.result import Localization, Reason, Step
from lightloc.search import Options, grow, is_explained, prune
from lightloc.solve import Fit, Problem, covariance, no_lights, refine


def localize(
    observations: Observations,
    geometry: Geometry | None = None,
    *,
    bounds: ArrayLike | None = None,
    options: Options | None = None,
    seed: int = 0,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is.

    Args:
        observations: what is seen; where they hold interreflected light, it is removed first.
        geometry: what occludes; None where nothing does.
        bounds: (2, 3) corners of the region that may hold lights, metres; the observations'
            bounding box where None.
        options: the search's defaults, replaced.
        seed: of the sample of observations and of the gathering rays.
        watch: is told each step of the search as it is done.

    Raises:
        ValueError: the bounds are not a box, or interreflected light is to be removed and there
            is no geometry to gather it with.

    >>> import numpy as np
    >>> from lightloc import Lambert, PointLights, radiance
    >>> floor = np.random.default_rng(0).uniform(-2, 2, (500, 3)) * [1, 1, 0]
    >>> up = np.tile([0.0, 0.0, 1.0], (500, 1))
    >>> dark = Observations(positions=floor, normals=up, directions=up,
    ...                     radiance=np.zeros(500), material=Lambert(albedo=0.5))
    >>> B = radiance(dark, PointLights([[0.5, -0.3, 1.2]], [10.0]))
    >>> found = localize(dark.with_radiance(B, 0.0), bounds=[[-2, -2, 0.1], [2, 2, 2]])
    >>> found.lights.positions.round(3).tolist(), found.reason.name
    ([[0.5, -0.3, 1.2]], 'CONVERGED')
    """
    o = options or Options()
    q = observations
    if q.interreflected:
        if geometry is None:
            raise ValueError("interreflected light can't be removed without the geometry")
        q = remove_indirect(q, geometry, seed)
        o = replace(o, shared=o.after_removal)
    region = array("bounds", q.bounds if bounds is None else bounds, (2, 3))
    some = np.sort(np.random.default_rng(seed).permutation(len(q))[: o.sample])
    whole = Problem.of(q, working_sigma(q, o), geometry, region)
    tight = whole.rows_of(some)
    loose = replace(tight, sigma=search_sigma(tight, o))
    dictionary = Dictionary.over(loose, Grid.over(region, o.cells))
    best, history = grow(loose, tight, dictionary, o, 1, watch)
    if not is_explained(best, tight, o):
        wider, more = grow(loose, tight, dictionary, o, o.beam, watch)
        best, history = min(best, wider, key=lambda fit: fit.cost), history + more
    if len(best):
        best = prune(whole, refine(whole, best.lights, o.outlier, o.thorough), o)
    else:
        best = no_lights(whole, o.outlier)
    history.append(Step("polish on all observations", len(best), best.cost / whole.rows))
    return answer(q, whole, best, o, tuple(history))


def working_sigma(q: Observations, o: Options) -> NDArray[np.float64]:
    """The observations' standard errors with the arithmetic's own on top."""
    mean = np.abs(q.radiance).mean() or 1.0  # all dark: any unit serves
    model = o.relative * np.abs(q.radiance) + o.absolute * mean
    floor = np.maximum(o.dark * np.median(q.sigma, axis=0), np.finfo(float).tiny)
    return np.maximum(np.hypot(q.sigma, model), floor)


def search_sigma(problem: Problem, o: Options) -> NDArray[np.float64]:
    """Wider errors while lights are missing: shot noise, so that no dark corner dominates."""
    B = np.maximum(problem.radiance, 0)
    shot = o.search_noise * np.sqrt(B.mean(axis=0) * (B + o.search_noise * B.mean(axis=0)))
    return np.hypot(problem.sigma, shot)


def answer(
    q: Observations, problem: Problem, fit: Fit, o: Options, history: tuple[Step, ...]
) -> Localization:
    """Standard errors, bounds and the reason, for the lights that were found."""
    lights = fit.lights.brightest_first()
    k, d = len(lights), len(problem.axes)
    spread = covariance(problem, lights) if k else np.zeros((0, 0))
    errors = np.sqrt(np.maximum(np.diag(spread), 0))
    position_error = np.zeros((k, 3))
    position_error[:, problem.axes] = errors[: k * d].reshape(k, d)
    bound, _ = intensity_distance(q, lights.positions, problem.geometry, margin=3.0)
    if not k:
        reason = Reason.DARK
    elif is_explained(fit, problem, o):
        reason = Reason.CONVERGED
    elif k >= o.most_lights:
        reason = Reason.MOST_LIGHTS
    else:
        reason = Reason.NO_GAIN
    return Localization(
        lights=lights,
        position_error=position_error,
        intensity_error=errors[k * d :].reshape(k, q.channels),
        covariance=spread,
        bound=bound,
        residual=fit.residual,
        direct=q.radiance,
        sigma=problem.sigma,
        inseparable=inseparable(lights, position_error),
        chi2=fit.cost / problem.rows,
        outliers=int((np.abs(fit.residual) > o.outlier).sum()),
        reason=reason,
        history=history,
    )


def inseparable(lights: PointLights, error: NDArray) -> tuple[tuple[int, int], ...]:
    """Pairs of lights nearer to each other than twice their joint standard error."""
    pairs = []
    for a in range(len(lights)):
        for b in range(a + 1, len(lights)):
            apart = np.linalg.norm(lights.positions[a] - lights.positions[b])
            if apart < 2 * np.hypot(np.linalg.norm(error[a]), np.linalg.norm(error[b])):
                pairs.append((a, b))
    return tuple(pairs)
