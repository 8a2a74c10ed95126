"""The published method as an answer: section 5 run to its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Localization, Reason, Step, localization
from lightloc.fit import Problem, errors_at, fit_of, working_sigma
from lightloc.given import Geometry, Observations, Options, PointLights
from lightloc.paper.geodesic import Geodesic
from lightloc.paper.optimization import (
    LOW_ERROR,
    LOWERING_OF_NOISE,
    OF_THE_TRUTH,
    RADIUS_OF_NOISE,
    Paper,
    iterate,
)
from lightloc.paper.surface import Perimeter, Surface
from lightloc.plane import is_in_plane


def published(
    q: Observations,
    geometry: Geometry | None,
    region: NDArray[np.float64],
    o: Paper,
    surface: Surface | None,
    watch: Callable[[Step], None],
) -> Localization:
    """Run `iterate` to its end. The history's chi2 is the MSE of B, as in section 6.1.

    Parameters
    ----------
    q
        Observations of one channel.
    geometry
        What occludes; nothing does where None.
    region : (2, 3) array
        Corners of the region that may hold lights, in the unit of length.
    o
        The method's parameters.
    surface
        Distances between the observations; `along_surface` where None.
    watch
        Is called with each step.

    Raises
    ------
    ValueError
        If there are three channels.
    """
    if q.channels != 1:
        raise ValueError("method 'paper' takes one channel; give it one of the three at a time")
    scene_radius = q.diagonal / 2
    if surface is None:
        surface = along_surface(q, region, o.threshold * scene_radius)
    noisy = bool((q.known_sigma > 0).any())
    low_error = OF_THE_TRUTH * float(np.square(q.known_sigma).mean()) if noisy else LOW_ERROR
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
    for state in iterate(problem, surface, scene_radius, low_error, o):
        if state.tried is not None:
            turn = state.iteration
            history.append(Step(f"iteration {turn}", len(state.tried), state.mse, turn))
            watch(history[-1])
            if state.mse < least:
                lights, least = state.tried, state.mse
        reason = state.reason or reason
    whole = replace(problem, sigma=own)
    fit = fit_of(whole, lights.brightest_first(), np.inf)
    errors = errors_at(whole, fit.lights)
    return localization(q, whole, fit, Options(), reason, history, errors)


def along_surface(q: Observations, region: NDArray[np.float64], reach: float) -> Surface:
    """Distances between the observations: along the walls of a 2D scene, else up to a reach."""
    if all(is_in_plane(points) for points in (q.positions, q.normals, region)):
        return Perimeter.of(q.positions, q.normals)
    return Geodesic.of(q.positions, q.normals, reach)
