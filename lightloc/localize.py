"""The method on one page: remove indirect light, search, polish, judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.candidates import Dictionary
from lightloc.checks import array
from lightloc.fields import Grid, intensity_distance
from lightloc.geometry import Geometry
from lightloc.indirect import remove_indirect
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.paper import (
    LOW_ERROR,
    LOWERING_OF_NOISE,
    OF_THE_TRUTH,
    RADIUS_OF_NOISE,
    Paper,
    iterate,
)
from lightloc.result import Localization, Reason, Step
from lightloc.search import Options, grow, is_explained, prune
from lightloc.solve import Fit, Problem, covariance, no_lights, refine, residuals
from lightloc.surface import Geodesic, Surface


def localize(
    observations: Observations,
    geometry: Geometry | None = None,
    *,
    method: Literal["search", "paper"] = "search",
    bounds: ArrayLike | None = None,
    options: Options | Paper | None = None,
    surface: Surface | None = None,
    seed: int = 0,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is.

    Args:
        observations: what is seen; where they hold interreflected light, it is removed first.
        geometry: what occludes; None where nothing does.
        method: "search", ours, or "paper", the published one, which takes one channel.
        bounds: (2, 3) corners of the region that may hold lights, metres; the observations'
            bounding box where None.
        options: the method's defaults, replaced: `Options`, or `Paper` for "paper".
        surface: distances along the observed surface, which only "paper" asks for; shortest
            paths over neighbouring observations where None.
        seed: of the sample of observations and of the gathering rays.
        watch: is told each step of the search as it is done.

    Raises:
        ValueError: the bounds are not a box, the method is neither of the two or its options are
            the other's, the paper's is given colours, or interreflected light is to be removed
            and there is no geometry to gather it with.

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
    q = observations
    if method not in METHODS:
        raise ValueError(f"method is '{method}'; expected 'search' or 'paper'")
    o = options or METHODS[method]()
    if not isinstance(o, METHODS[method]):
        raise ValueError(f"method '{method}' takes {METHODS[method].__name__} as its options")
    if q.interreflected:
        if geometry is None:
            raise ValueError("interreflected light can't be removed without the geometry")
        q = remove_indirect(q, geometry, seed)
    region = array("bounds", q.bounds if bounds is None else bounds, (2, 3))
    if isinstance(o, Paper):
        return published(q, geometry, region, o, surface, watch)
    if observations.interreflected:
        o = replace(o, shared=o.after_removal)
    return searched(q, geometry, region, o, seed, watch)


METHODS: dict[str, type[Options] | type[Paper]] = {"search": Options, "paper": Paper}


def searched(
    q: Observations,
    geometry: Geometry | None,
    region: NDArray[np.float64],
    o: Options,
    seed: int,
    watch: Callable[[Step], None],
) -> Localization:
    """Ours: grow the set of lights over some observations, polish over all, drop what is idle."""
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
    if not len(best):
        reason = Reason.DARK
    elif is_explained(best, whole, o):
        reason = Reason.CONVERGED
    else:
        reason = Reason.MOST_LIGHTS if len(best) >= o.most_lights else Reason.NO_GAIN
    return answer(q, whole, best, o.outlier, reason, tuple(history))


def published(
    q: Observations,
    geometry: Geometry | None,
    region: NDArray[np.float64],
    o: Paper,
    surface: Surface | None,
    watch: Callable[[Step], None],
) -> Localization:
    """The paper's: `iterate` to its end. The history's chi2 is the MSE of B, as in section 6.1."""
    if q.channels != 1:
        raise ValueError("method 'paper' takes one channel; give it one of the three at a time")
    radius = q.diagonal / 2
    if surface is None:
        surface = Geodesic.of(q.positions, q.normals, o.threshold * radius)
    noisy = bool((q.sigma > 0).any())
    low_error = OF_THE_TRUTH * float(np.square(q.sigma).mean()) if noisy else LOW_ERROR
    if o.low_error is not None:
        low_error = o.low_error
    o = replace(
        o,
        radius=o.radius or RADIUS_OF_NOISE[noisy],
        lowering=o.lowering or LOWERING_OF_NOISE[noisy],
    )
    own = working_sigma(q, Options())
    problem = Problem.of(q, own if noisy else np.ones_like(own), geometry, region)
    lights, least, history = PointLights(np.zeros((0, 3)), np.zeros((0, 1))), np.inf, []
    reason = Reason.NO_VOTES
    for state in iterate(problem, surface, radius, low_error, o):
        if state.tried is not None:
            history.append(Step(f"iteration {state.iteration}", len(state.tried), state.mse))
            watch(history[-1])
            if state.mse < least:
                lights, least = state.tried, state.mse
        reason = state.reason or reason
    whole = replace(problem, sigma=own)
    z = residuals(whole, lights)
    fit = Fit(lights, z, float(np.square(z).sum()))
    return answer(q, whole, fit, Options().outlier, reason, tuple(history))


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
    q: Observations,
    problem: Problem,
    fit: Fit,
    outlier: float,
    reason: Reason,
    history: tuple[Step, ...],
) -> Localization:
    """Standard errors and bounds for the lights that were found."""
    lights = fit.lights.brightest_first()
    k, d = len(lights), len(problem.axes)
    spread = covariance(problem, lights) if k else np.zeros((0, 0))
    errors = np.sqrt(np.maximum(np.diag(spread), 0))
    position_error = np.zeros((k, 3))
    position_error[:, problem.axes] = errors[: k * d].reshape(k, d)
    bound, _ = intensity_distance(q, lights.positions, problem.geometry, margin=3.0)
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
        outliers=int((np.abs(fit.residual) > outlier).sum()),
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
