"""What an answer hangs on: other models that explain as well, and say something else of the lights.

A point that explains all may still be a lamp: over a floor alone, a lamp straight above looks like
a point that hangs lower. So each light found, and all alike, are asked whether they shine alike in
all directions. A score test answers first: the derivative of B by a dipole of the emission, beside
all that the lights can adapt. Only where that excludes no lamp is one fitted, and only where the
fit is as good as the points' are the errors widened.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from lightloc.answer import Kind, Verdict
from lightloc.diagnosis.covered import Alternative
from lightloc.diagnosis.departure import Array, Evidence
from lightloc.diagnosis.joint import left, lost, whitened
from lightloc.diagnosis.lamp_search import directions
from lightloc.diagnosis.lamps import Freedom, LampFit, Lamps, errors_of, refined
from lightloc.diagnosis.score import Score
from lightloc.fit import covariance_of
from lightloc.given import PointLights
from lightloc.units import length

AS_WELL = 6.0
"""Chi-square by which another model may be worse and still not be excluded."""

FAR_OFF = 400.0
"""The same to first order: a lamp that is worse by so much is not fitted."""

LUCK = 1e-5
"""Chance that noise gains what a lamp must, to be told in place of a point."""

EXPONENTS = (1.0, 2.0, 4.0, 8.0)
"""Of the lamps that are asked for, one after the other until one is excluded."""

BEST, STEPS = 2, 40
"""Axes from which a lamp is fitted, and the most evaluations."""

AMBIENT = 0.1
"""Of the mean radiance: an ambient light that is no surprise."""


def alternatives(
    evidence: Evidence, lights: PointLights, ambient: bool
) -> tuple[list[Alternative], LampFit | None]:
    """What explains the observations as well as the lights do, and lamps that explain far better.

    ``ambient`` says whether an ambient light is among the models already.
    """
    plain = evidence.lit(lights).plain
    z = left(evidence, plain.B)
    cost, weight = lost(evidence, z)
    score = Score.of(evidence, lights, z, weight)
    found, better = [], None
    limit = float(chi2.isf(LUCK / max(1, len(lights)), len(evidence.problem.axes)))
    for which in score.groups:
        here, free = lamps(evidence, lights, which, score, cost, limit)
        found += here
        if free and free.cost < cost - limit and (better is None or free.cost < better.cost):
            better = free
    if not ambient:
        found += dimly_lit(evidence, lights, score)
    return found, better


def lamps(
    evidence: Evidence,
    lights: PointLights,
    which: tuple[int, ...],
    score: Score,
    cost: float,
    limit: float,
) -> tuple[list[Alternative], LampFit | None]:
    """Lamps in place of some lights: those as good as the points, and the best of any exponent."""
    problem, scale = evidence.problem, evidence.criterion.likelihood.scale
    axes = directions(problem.axes)
    off = score.lost(which, axes[:, problem.axes])
    if off.min() > FAR_OFF and score.gain(which) < limit:
        return [], None
    kept = list[Alternative]()
    starts = [start(lights, which, axes[i]) for i in np.argsort(off, kind="stable")[:BEST]]
    best = None
    for m in EXPONENTS:
        starts = [replace(one, exponents=np.where(one.exponents > 0, m, 0.0)) for one in starts]
        freedom = Freedom.of(starts[0], score.d, exponents=False)
        fits = [refined(problem, one, freedom, scale, STEPS) for one in starts]
        fit = min(fits, key=lambda one: one.cost)
        best = fit if best is None or fit.cost < best.cost else best
        if fit.cost > min(cost, best.cost) + AS_WELL:
            break
        kept.append(lamp_like(evidence, which, fit, freedom, m))
        starts = [fit.lamps]
    assert best is not None
    if best.cost < cost:
        freedom = Freedom.of(best.lamps, score.d, alike=len(which) > 1)
        best = refined(problem, best.lamps, freedom, scale, STEPS)
    return kept, best


def start(lights: PointLights, which: tuple[int, ...], axis: Array) -> Lamps:
    """Some lights as lamps about an axis, the others as they are."""
    m = np.zeros(len(lights))
    m[list(which)] = 1.0
    return Lamps.of(lights, axis, m)


def lamp_like(
    evidence: Evidence, which: tuple[int, ...], fit: LampFit, freedom: Freedom, m: float
) -> Alternative:
    """Lamps that explain as well."""
    bound, _ = errors_of(evidence.problem, fit, freedom)
    axis = ", ".join(f"{a:.2f}" for a in fit.lamps.axes[which[0]])
    about = f" about ({axis})" if len(which) == 1 else ""
    return Alternative(
        which, f"cos^{m:.0f}{about}", fit.lamps.lights, bound.covariance, fit.cost, fit.lamps
    )


def dimly_lit(evidence: Evidence, lights: PointLights, score: Score) -> list[Alternative]:
    """An ambient light beside the lights, where one of `AMBIENT` is not excluded."""
    problem = evidence.problem
    n, c = problem.radiance.shape
    mean = np.abs(problem.radiance).mean(axis=0)
    columns = np.zeros((n, c, c))
    for channel in range(c):
        size = max(float(evidence.ambient[:, channel].mean()), 1e-300)
        columns[:, channel, channel] = evidence.ambient[:, channel] / size * mean[channel]
    A = (columns / problem.sigma[:, :, None] * score.root[:, :, None]).reshape(n * c, c)
    own = A - score.basis @ (score.basis.T @ A)
    free = np.square(own).sum(axis=0)
    amount = own.T @ score.left / np.maximum(free, 1e-300)
    if (free * np.square(AMBIENT - amount) > AS_WELL).any() or (amount < 0).any():
        return []
    lit = evidence.lit(lights).plain
    J = np.concatenate([whitened(evidence, lit), columns / problem.sigma[:, :, None]], axis=2)
    J = (J * score.root[:, :, None]).reshape(n * c, -1)
    return [shifted(evidence, lights, J, score)]


def shifted(evidence: Evidence, lights: PointLights, J: Array, score: Score) -> Alternative:
    """The lights with a further column in J, to first order."""
    (k, c), axes = lights.intensities.shape, evidence.problem.axes
    m, d = k * (len(axes) + c), len(axes)
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    step = np.linalg.lstsq(J / size, score.left, rcond=1e-10)[0] / size
    positions = lights.positions.copy()
    positions[:, axes] += step[: k * d].reshape(k, d)
    there = PointLights(
        np.clip(positions, *evidence.problem.bounds),
        np.maximum(lights.intensities + step[k * d : m].reshape(k, c), 0),
    )
    spread = covariance_of(J)[:m, :m]
    return Alternative(tuple(range(k)), "ambient", there, spread, 0.0)


def hangs_on(lights: PointLights, others: list[Alternative], unit: str) -> Iterator[Verdict]:
    """What is assumed and not seen, one sentence for each light and thing."""
    named = set[tuple[tuple[int, ...], bool]]()
    for one in others:
        key = one.lights, one.lamps is None
        same = [a for a in others if (a.lights, a.lamps is None) == key]
        if key in named:
            continue
        named.add(key)
        off = max(
            float(
                np.linalg.norm((a.there.positions - lights.positions)[list(a.lights)], axis=1).max()
            )
            for a in same
        )
        if one.lamps is None:
            said = (
                "That there is no ambient light is assumed, not seen: with one, lights would be "
                f"up to {length(off, unit)} from where they are told; the errors cover that."
            )
        else:
            many = len(one.lights) > 1
            who = "All lights" if many else f"Light {one.lights[0] + 1}"
            them = "they" if many else "it"
            said = (
                f"{who} may as well shine as a lamp does, {one.name}, and {them} would then be up "
                f"to {length(off, unit)} away: isotropic is assumed, not seen; the errors cover "
                "that."
            )
        yield Verdict(Kind.ASSUMED, one.lights, said)
