"""Grow a set of lights: where is one missing, add it, polish all, keep the best hypotheses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightloc.candidates import Dictionary
from lightloc.lights import PointLights
from lightloc.result import Step
from lightloc.shading import shading
from lightloc.solve import Fit, Problem, intensities, no_lights, refine, robust


@dataclass(frozen=True)
class Options:
    """Every default of the search, each with its reason."""

    most_lights: int = 12
    cells: int = 12_000  # 0.2 m apart in a room of 100 m^3: under a glossy lobe's width
    sample: int = 1024  # observations that the search looks at; the last polish sees all
    candidates: int = 4  # peaks of the gain that are refined before one is chosen
    beam: int = 3  # hypotheses kept when the first pass leaves a residual
    quick: int = 12  # evaluations to judge a candidate
    thorough: int = 60  # evaluations to polish a hypothesis
    relative: float = 1e-4  # float32 shading, grazing plastic included, agrees to a few 1e-6
    absolute: float = 1e-5  # of the mean radiance
    search_noise: float = 0.02  # k of section 6.1, added while lights are still missing
    typical: float = 0.95  # share of the residuals that the loss takes as they are meanwhile
    outlier: float = 5.0  # standard errors beyond which a residual counts less and less
    significant: float = 12.0  # least gain in chi-square a new parameter, in units of the noise
    silent: float = 0.1  # robust chi-square a residual below which nothing is left to find
    explained: float = 1.3  # robust chi-square a residual that counts as the noise's floor


def grow(
    loose: Problem, tight: Problem, dictionary: Dictionary, o: Options, beam: int
) -> tuple[Fit, list[Step]]:
    """Add lights one by one, keeping the ``beam`` best hypotheses, until nothing is left.

    Args:
        loose: the sampled observations with standard errors widened for the search.
        tight: the same with their own.

    Returns the best fit to ``tight`` and the steps that led to it.
    """
    hypotheses = [no_lights(loose, o.outlier)]
    best = no_lights(tight, o.outlier)
    history: list[Step] = []
    while len(hypotheses[0]) < o.most_lights:
        scale = unexplained_scale(hypotheses[0], o)
        before = robust(hypotheses[0].residual, scale)
        grown = [
            refine(loose, start, scale, o.quick)
            for fit in hypotheses
            for start in starts(loose, dictionary, fit, scale, o)
        ]
        if not grown:
            break
        hypotheses = [
            refine(loose, fit.lights, scale, o.thorough)
            for fit in distinct(grown, beam, dictionary)
        ]
        hypotheses.sort(key=lambda fit: fit.cost)
        sharp = min(
            (refine(tight, fit.lights, o.outlier, o.thorough) for fit in hypotheses),
            key=lambda fit: fit.cost,
        )
        history.append(Step("add", len(sharp), sharp.cost / tight.rows))
        worse = before - hypotheses[0].cost < o.significant * parameters(1, sharp)
        if worse and not significant(best, sharp, o):
            break
        if sharp.cost < best.cost:
            best = sharp
        if best.cost < o.silent * tight.rows:
            break
    return best, history


def unexplained_scale(fit: Fit, o: Options) -> float:
    """Where the loss begins to flatten while lights are missing: most residuals lie below it."""
    return max(o.outlier, float(np.quantile(np.abs(fit.residual), o.typical)))


def starts(
    problem: Problem, dictionary: Dictionary, fit: Fit, scale: float, o: Options
) -> Iterator[PointLights]:
    """The present lights with one more where it gains most; all intensities solved linearly."""
    n, c = problem.radiance.shape
    columns = np.zeros((n, 0, c))
    if len(fit):
        S = shading(problem.surfels, fit.lights.positions, problem.geometry)
        columns = np.broadcast_to(S, (n, len(fit), c)) / problem.sigma[:, None, :]
    weight = 1 / (1 + np.square(fit.residual / scale))  # Cauchy's
    gains = dictionary.gains(fit.residual, columns, weight)
    for p in dictionary.peaks(gains, o.candidates):
        positions = np.concatenate([fit.lights.positions, p[None]])
        yield PointLights(positions, intensities(problem, positions))


def distinct(fits: list[Fit], most: int, dictionary: Dictionary) -> list[Fit]:
    """The best of the fits, leaving out those that are the same lights again."""
    apart = np.linalg.norm(dictionary.grid.step)
    kept: list[Fit] = []
    for fit in sorted(fits, key=lambda f: f.cost):
        same = any(
            max(
                np.linalg.norm(other.lights.positions - p, axis=1).min()
                for p in fit.lights.positions
            )
            < apart
            for other in kept
        )
        if not same:
            kept.append(fit)
        if len(kept) == most:
            break
    return kept


def prune(problem: Problem, fit: Fit, o: Options) -> Fit:
    """Drop lights, faintest first, without which the fit is not significantly worse."""
    for light in np.argsort(fit.lights.intensities.mean(axis=1)):
        if len(fit) == 1:
            break
        rest = np.delete(fit.lights.positions, light, axis=0)
        start = PointLights(rest, intensities(problem, rest))
        without = refine(problem, start, o.outlier, o.thorough)
        if not significant(without, fit, o):
            return prune(problem, without, o)
    return fit


def parameters(lights: int, fit: Fit) -> int:
    """Free numbers of that many lights: a position, and an intensity a channel."""
    return lights * (3 + fit.residual.shape[1])


def significant(fewer: Fit, more: Fit, o: Options) -> bool:
    """Whether ``more`` lowers chi-square by more than its new parameters would by chance."""
    noise = max(1.0, more.cost / more.residual.size)
    new = parameters(max(1, len(more) - len(fewer)), more)
    return fewer.cost - more.cost > o.significant * noise * new


def is_explained(fit: Fit, problem: Problem, o: Options) -> bool:
    """Whether the residual has come down to the noise."""
    return fit.cost < o.explained * problem.rows
