"""Grow a set of lights: where is one missing, add it, polish all, keep the best hypotheses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary
from lightloc.fields import Grid
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
    zooms: int = 2  # finer grids about a peak, so that a shadow's edge starts on its right side
    zoom: int = 5  # cells along each axis of such a grid
    beam: int = 3  # hypotheses kept when the first pass leaves a residual
    quick: int = 12  # evaluations to judge a candidate
    thorough: int = 60  # evaluations to polish a hypothesis
    relative: float = 1e-4  # float32 shading, grazing plastic included, agrees to a few 1e-6
    absolute: float = 1e-5  # of the mean radiance
    search_noise: float = 0.02  # k of section 6.1, added while lights are still missing
    typical: float = 0.95  # share of the residuals that the loss takes as they are meanwhile
    outlier: float = 5.0  # standard errors beyond which a residual counts less and less
    dark: float = 0.1  # of the median standard error: none is smaller (no sensor is exact)
    shared: float = 0.0  # least gain in chi-square a residual, where errors are shared by
    # neighbours and do not average out; `after_removal` once indirect light was removed
    after_removal: float = 0.08
    significant: float = 12.0  # least gain in chi-square a new parameter, in units of the noise
    silent: float = 0.1  # robust chi-square a residual below which nothing is left to find
    explained: float = 1.3  # robust chi-square a residual that counts as the noise's floor


def grow(
    loose: Problem,
    tight: Problem,
    dictionary: Dictionary,
    o: Options,
    beam: int,
    watch: Callable[[Step], None],
) -> tuple[Fit, list[Step]]:
    """Add lights one by one, keeping the ``beam`` best hypotheses, until nothing is left.

    Args:
        loose: the sampled observations with standard errors widened for the search.
        tight: the same with their own.
        watch: is told each step as it is done.

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
        watch(history[-1])
        gain = before - hypotheses[0].cost
        if gain < least_gain(1, hypotheses[0], o) and not significant(best, sharp, o):
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
    columns = whitened(problem, fit.lights)
    weight = 1 / (1 + np.square(fit.residual / scale))  # Cauchy's
    gains = dictionary.gains(fit.residual, columns, weight)
    for peak in dictionary.peaks(gains, o.candidates):
        p = zoomed(problem, peak, dictionary.grid.step, fit.residual, columns, weight, o)
        positions = np.concatenate([fit.lights.positions, p[None]])
        yield PointLights(positions, intensities(problem, positions))


def whitened(problem: Problem, lights: PointLights) -> NDArray:
    """S / sigma of lights: (n, k, c)."""
    n, c = problem.radiance.shape
    if not len(lights):
        return np.zeros((n, 0, c))
    S = shading(problem.surfels, lights.positions, problem.geometry)
    return np.broadcast_to(S, (n, len(lights), c)) / problem.sigma[:, None, :]


def zoomed(
    problem: Problem,
    p: NDArray,
    reach: NDArray,
    residual: NDArray,
    columns: NDArray,
    weight: NDArray,
    o: Options,
) -> NDArray:
    """The position of largest gain within ``reach`` of p, on grids that grow finer."""
    for _ in range(o.zooms):
        grid = Grid.around(p, reach, problem.bounds, o.zoom)
        near = Dictionary.over(problem, grid)
        p = near.points[np.argmax(near.gains(residual, columns, weight))]
        reach = grid.step
    return p


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


def significant(fewer: Fit, more: Fit, o: Options) -> bool:
    """Whether ``more`` lowers chi-square by more than its new parameters would by chance."""
    return fewer.cost - more.cost > least_gain(max(1, len(more) - len(fewer)), more, o)


def least_gain(lights: int, fit: Fit, o: Options) -> float:
    """Chi-square that so many further lights must gain."""
    rows, channels = fit.residual.size, fit.residual.shape[1]
    noise = max(1.0, fit.cost / rows)
    return lights * noise * max(o.significant * (3 + channels), o.shared * rows)


def is_explained(fit: Fit, problem: Problem, o: Options) -> bool:
    """Whether the residual has come down to the noise."""
    return fit.cost < o.explained * problem.rows
