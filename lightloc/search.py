"""Grow a set of lights: where is one missing, add it, polish all, keep the best hypotheses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary
from lightloc.lights import PointLights
from lightloc.result import Step
from lightloc.shading import shading
from lightloc.solve import Fit, Problem, intensities, no_lights, refine


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
    outlier: float = 5.0  # standard errors beyond which a residual counts less and less
    significant: float = 12.0  # least gain in chi-square a new parameter, in units of the noise
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
        grown = [
            add(loose, fit, p, o)
            for fit in hypotheses
            for p in candidates(loose, dictionary, fit, o)
        ]
        if not grown:
            break
        hypotheses = distinct(grown, beam, dictionary)
        polished = [refine(tight, fit.lights, o.outlier, o.thorough) for fit in hypotheses]
        sharp = min(polished, key=lambda fit: fit.cost)
        history.append(Step("add", len(sharp), sharp.cost / tight.rows))
        if not significant(best, sharp, o):
            break
        best = sharp
        if is_explained(best, tight, o):
            break
    return best, history


def candidates(problem: Problem, dictionary: Dictionary, fit: Fit, o: Options) -> NDArray:
    """(m, 3) positions where one more light would gain most."""
    weight = 1 / (1 + np.square(fit.residual / o.outlier))  # Cauchy's
    S = shading(problem.surfels, fit.lights.positions, problem.geometry) if len(fit) else None
    n, c = problem.radiance.shape
    columns = (
        np.zeros((n, 0, c))
        if S is None
        else np.broadcast_to(S, (n, len(fit), c)) / problem.sigma[:, None, :]
    )
    return dictionary.peaks(dictionary.gains(fit.residual, columns, weight), o.candidates)


def add(problem: Problem, fit: Fit, position: NDArray, o: Options) -> Fit:
    """One more light: all intensities linearly, then everything by a few steps."""
    positions = np.concatenate([fit.lights.positions, position[None]])
    lights = PointLights(positions, intensities(problem, positions))
    return refine(problem, lights, o.outlier, o.quick)


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
    for position in fit.lights.brightest_first().positions[::-1]:
        if len(fit) == 1:
            break
        keep = np.linalg.norm(fit.lights.positions - position, axis=1) > 0
        rest = fit.lights.positions[keep]
        without = refine(
            problem, PointLights(rest, intensities(problem, rest)), o.outlier, o.thorough
        )
        if not significant(without, fit, o):
            fit = without
    return fit


def significant(fewer: Fit, more: Fit, o: Options) -> bool:
    """Whether ``more`` lowers chi-square by more than its new parameters would by chance."""
    noise = max(1.0, more.cost / more.residual.size)
    parameters = (len(more) - len(fewer)) * (3 + more.residual.shape[1])
    return fewer.cost - more.cost > o.significant * noise * max(parameters, 1)


def is_explained(fit: Fit, problem: Problem, o: Options) -> bool:
    """Whether the residual has come down to the noise."""
    return fit.cost < o.explained * problem.rows
