"""Indirect light beyond footnote 1: rendered for the lights found so far, subtracted, and again.

With positions fixed, all light is linear in the intensities, B = sum I (S + H), where H is what a
light of intensity 1 brings by way of the surfaces. So intensities follow in one step from all of
B: subtracting sum I H with intensities from the direct part alone would overshoot wherever H is
larger than S, as it is among metal walls. Direct light says how many lights there are and about
where; all light together, where exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from lightloc.answer import (
    MARGIN,
    Kind,
    Localization,
    Reason,
    Step,
    Verdict,
    judged,
    mirrored,
    unexplained,
)
from lightloc.checks import number
from lightloc.fields import intensity_distance
from lightloc.fit import (
    Criterion,
    Fit,
    Problem,
    estimated_level,
    inseparable,
    level_of,
    outside,
    resolution,
    working_sigma,
)
from lightloc.given import Geometry, Interreflecting, Observations, Options, PointLights
from lightloc.interreflection.all_light import REFITS, Split, above_zero, spread, straight, together

Columns = tuple[NDArray[np.float64], NDArray[np.float64]]

Indirect = Callable[[NDArray[np.float64]], Columns]
"""From (k, 3) positions to H(q, p) and its standard error, each (n, k, c), m^-2 sr^-1."""

Search = Callable[[Observations, PointLights | None], Localization]
"""Finds lights in direct light, going on from those that are given, if any."""

Certificate = Callable[[Problem, Fit], float]
"""The largest correlation of what a fit leaves with a further light, in standard errors."""

DARKEST = 0.05
"""Share of the readings that are taken for lit by surfaces alone."""

UNEVEN = 0.5
"""How much that light may differ from place to place, as a share."""

MOST_ROUNDS = 8
"""Metal rooms with eight lights settle in three to five (measured)."""

AT_REST = 0.3
"""Standard errors that no light may have moved in the last round."""

NEAR = 3.0
"""Standard errors of movement below which rounds refine what was found and search no more."""


def rendering(
    indirect: Indirect | int,
    geometry: Geometry | None,
    seen: Observations,
    used: NDArray[np.bool_],
    seed: int,
) -> Indirect:
    """H(q, p) at the observations that are used, rendered by the geometry or by a function.

    A function gives it at all n observations, of which the (n,) ``used`` are kept; the geometry is
    asked for those alone, which are ``seen``. Raises ValueError where the geometry can't render.
    """
    if callable(indirect):
        given = indirect

        def of_used(positions: NDArray[np.float64]) -> Columns:
            H, error = given(positions)
            return H[used], error[used]

        return of_used
    if not isinstance(geometry, Interreflecting):
        raise ValueError("this geometry can't render interreflected light; give a function for it")
    number("indirect", indirect, 2, whole=True)
    room, samples = geometry, indirect
    return lambda positions: room.interreflection(positions, seen, samples, seed)


def less_background(q: Observations) -> Observations:
    """A first guess at the direct part of irradiance: without what even the darkest points have.

    Other readings tell nothing of it, since no surface's radiance is known.
    """
    level = np.quantile(q.radiance, DARKEST, axis=0)
    sigma = np.hypot(q.known_sigma, UNEVEN * level)
    return q.with_radiance(q.radiance - level, sigma, interreflected=False)


def rounds(
    q: Observations,
    first: Observations,
    problem: Problem,
    indirect: Indirect,
    search: Search,
    certificate: Certificate,
    o: Options,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Search, render the indirect light of what was found, subtract it, and search again.

    Parameters
    ----------
    q : Observations
        With all interreflected light in them.
    first : Observations
        Q without it as far as that is known before any light is: by footnote 1.
    problem : Problem
        Posed by ``first``.
    indirect : Indirect
        H(q, p) of the room, as `rendering` gives it: from (k, 3) positions to (n, k, c) arrays.
    search : Search
        The search for lights in direct light.
    certificate : Certificate
        Of an answer in direct light.
    o : Options
        The search's options.
    watch : callable
        Called with each round.

    Returns
    -------
    Localization
        The last search's answer, with positions, intensities and errors from direct and indirect
        light together. Where the lights still move after `MOST_ROUNDS`, a verdict says so.
    """

    q = replace(q.with_radiance(q.radiance, working_sigma(q, o), q.interreflected), step=0.0)
    problem = replace(problem, radiance=q.radiance, sigma=np.ones_like(q.sigma), ambient=None)
    found, lights = search(first, None), PointLights(np.zeros((0, 3)), np.zeros((0, q.channels)))
    history, moved = list(found.history), np.inf
    for turn in range(MOST_ROUNDS):
        if moved < AT_REST or not len(found.lights):
            break
        order = order_like(found.lights, lights)
        lights = PointLights(found.lights.positions[order], found.lights.intensities[order])
        split = Split(q, straight(problem, lights), *indirect(lights.positions), o.outlier)
        steps = [Step(f"round {turn + 1}", len(lights), found.chi2, turn + 1)]
        if moved > NEAR or not explains(found):
            I = split.intensities()
            lit = I.any(axis=1)
            found = search(split.direct(I), PointLights(lights.positions[lit], I[lit]))
            steps += found.history
        if len(found.lights) == len(lights):
            order = np.argsort(order_like(found.lights, lights))
            found = whole(found, split.rows(order), problem, certificate, o)
        moved = movement(found, lights)
        steps[0] = replace(steps[0], lights=len(found.lights), chi2=found.chi2)
        history += steps
        watch(steps[0])
    if len(found.lights) and not moved < AT_REST:
        found = unsettled(found)
    return replace(found, history=tuple(history))


def explains(found: Localization) -> bool:
    """Whether no more than noise is left."""
    return found.reason in (Reason.CONVERGED, Reason.UNDECIDED, Reason.EXTENDED)


def movement(found: Localization, before: PointLights) -> float:
    """How far the lights have changed, in standard errors; infinite where their number has."""
    if len(found.lights) != len(before):
        return np.inf
    order = order_like(found.lights, before)
    step = np.linalg.norm(found.lights.positions[order] - before.positions, axis=1)
    error = np.linalg.norm(found.position_error[order], axis=1)
    brighter = np.abs(found.lights.intensities[order] - before.intensities)
    return max(
        float((step / above_zero(error)).max()),
        float((brighter / above_zero(found.intensity_error[order])).max()),
    )


def order_like(lights: PointLights, like: PointLights) -> NDArray[np.intp]:
    """Indices of the lights in the order of those that they are nearest to; new ones last.

    Examples
    --------
    >>> like = PointLights([[0, 0, 0], [5, 0, 0]], [1.0, 2.0])
    >>> order_like(PointLights([[9, 0, 0], [5.1, 0, 0], [0.1, 0, 0]], [3.0, 2.0, 1.0]), like)
    array([2, 1, 0])
    """
    apart = np.linalg.norm(like.positions[:, None] - lights.positions, axis=2)
    _, nearest = linear_sum_assignment(apart)
    others = np.setdiff1d(np.arange(len(lights)), nearest)
    return np.concatenate([nearest, others]).astype(np.intp)


def whole(
    found: Localization, split: Split, problem: Problem, certificate: Certificate, o: Options
) -> Localization:
    """The answer refined on all of B, with all that follows from it, brightest first.

    Where a light is wide, the answer of the search in direct light stands.
    """
    if found.width.any():
        return found
    lights, split, _ = together(split, found.lights, problem)
    noise = found.noise
    if o.noise != "given":
        split, level = scaled(split, lights, len(lights) * (len(problem.axes) + lights.channels))
        lights, split, _ = together(split, lights, problem)
        scale = np.full(lights.channels, level)
        noise = replace(noise, scale=scale, scale_error=noise.scale_error / noise.scale * scale)
    lights, split = lights.brightest_first(), split.rows(lights.order)
    errors = spread(split, lights, problem)
    criterion, direct = Criterion.of(o), split.direct(lights.intensities)
    z, cost = split.residual(lights.intensities), split.cost(lights.intensities)
    k = len(lights)
    posed = replace(problem, radiance=direct.radiance, sigma=direct.known_sigma)
    fit = Fit(lights, z, cost, posed)
    top, _ = intensity_distance(direct, lights.positions, problem.geometry, margin=MARGIN)
    level = max(1.0, level_of(z))
    verdicts = [verdict for verdict in found.verdicts if verdict.kind is not Kind.MIRROR]
    verdicts += mirrored(posed, lights, level, criterion, o)
    reason = found.reason
    if explains(found) and not criterion.is_explained(problem, fit):
        reason, verdicts = Reason.NO_GAIN, [unexplained(fit, problem, k), *verdicts]
    now = replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=errors.covariance,
        bound=top,
        direct=direct.radiance,
        sigma=direct.known_sigma,
        residual=z,
        chi2=cost / problem.rows,
        noise=replace(noise, outliers=outside(z)[1] < 0.5, share=outside(z)[0]),
        counts=tuple(
            replace(one, lights=lights, chi2=cost / problem.rows) if len(one.lights) == k else one
            for one in found.counts
        ),
        inseparable=inseparable(lights, errors.position),
        resolution=resolution(posed, lights),
        certificate=certificate(posed, fit),
        reason=reason,
        verdicts=tuple(verdicts),
    )
    return judged(now, problem, o)


def scaled(split: Split, lights: PointLights, parameters: int) -> tuple[Split, float]:
    """The split with the standard errors of B times a factor that its residuals ask for.

    The rendering's own error is known, and is no part of that factor.
    """
    q, scale = split.q, 1.0
    for _ in range(REFITS):
        scale *= estimated_level(split.residual(lights.intensities), parameters)
        split = replace(split, q=q.with_radiance(q.radiance, q.known_sigma * scale))
    return split, scale


def unsettled(found: Localization) -> Localization:
    """The answer where the lights still move: a verdict says so."""
    said = f"The lights still move after {MOST_ROUNDS} rounds of rendering their indirect light."
    verdict = Verdict(Kind.UNEXPLAINED, tuple(range(len(found.lights))), said)
    return replace(found, reason=Reason.NO_GAIN, verdicts=(verdict, *found.verdicts))
