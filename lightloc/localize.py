"""The method on one page: remove indirect light, search, polish, judge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.candidates import Dictionary
from lightloc.checks import array
from lightloc.fields import Grid, intensity_distance
from lightloc.geometry import Geometry
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
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is."""
    o = options or Options()
    q = observations
    region = array("bounds", q.bounds if bounds is None else bounds, (2, 3))
    some = np.sort(np.random.default_rng(seed).permutation(len(q))[: o.sample])
    whole = Problem.of(q, working_sigma(q, o), geometry, region)
    tight = whole.rows_of(some)
    loose = replace(tight, sigma=search_sigma(tight, o))
    dictionary = Dictionary.over(loose, Grid.over(region, o.cells))
    best, history = grow(loose, tight, dictionary, o, beam=1)
    if not is_explained(best, tight, o):
        wider, more = grow(loose, tight, dictionary, o, beam=o.beam)
        best, history = min(((best, history), (wider, history + more)), key=lambda b: b[0].cost)
    if len(best):
        best = prune(whole, refine(whole, best.lights, o.outlier, o.thorough), o)
    else:
        best = no_lights(whole, o.outlier)
    history.append(Step("polish on all observations", len(best), best.cost / whole.rows))
    return answer(q, whole, best, o, tuple(history))


def working_sigma(q: Observations, o: Options) -> NDArray[np.float64]:
    """The observations' standard errors with the arithmetic's own on top."""
    model = o.relative * np.abs(q.radiance) + o.absolute * np.abs(q.radiance).mean()
    return np.maximum(np.hypot(q.sigma, model), np.finfo(float).tiny)


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
        intensity_error=errors[k * d :].reshape(k, -1),
        covariance=spread,
        bound=bound,
        residual=fit.residual,
        direct=q.radiance,
        sigma=problem.sigma,
        inseparable=inseparable(lights, position_error),
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
