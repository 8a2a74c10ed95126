"""What is better, and when it is enough: the one place that judges fits.

How probable residuals are is a value, the `Likelihood`; the search asks the `Criterion` and does
not know which likelihood that has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.fit.errors import Errors
from lightloc.fit.law import MOST_OUTLIERS, RATHER, outside
from lightloc.fit.loss import cauchy, robust
from lightloc.fit.noise import estimated_level, level_of
from lightloc.fit.pattern import clustering, correlation
from lightloc.fit.problem import Fit, Problem
from lightloc.given import Options

FEW = 0.02
"""Of the residuals: so many may lie anywhere. Where a shadow's edge is not quite where a ray test
says it is, an observation on its wrong side is off by all of a light: one in two hundred is, in
rooms that another renderer made."""

SHARED = 0.08
"""Least gain in chi-square per residual where errors are shared by neighbours and do not average
out: once indirect light was removed, and where the model proves wrong."""

ESTIMATED = 1.3
"""Chi-square per residual that noise is allowed where the errors are estimates themselves."""

COUNTED = 0.05
"""Probability that a count of lights is not among those that are allowed."""

LUCK = 2.0
"""Standard deviations of chi-square above its mean at which a fit is looked at again."""


@dataclass(frozen=True)
class Likelihood:
    """How far off observations are.

    Parameters
    ----------
    scale
        Standard errors beyond which a residual counts less and less (Cauchy's loss).
    known
        Whether sigma is right; else it is right but for a factor.
    lawful
        Whether sigma follows a law of the model's B that is to be estimated.
    few
        Share of the residuals that may lie anywhere beyond ``scale``.
    typical
        Chi-square per residual that noise alone leaves, at most.
    """

    scale: float = 5.0
    known: bool = True
    lawful: bool = False
    few: float = FEW
    typical: float = 1.0

    def cost(self, residual: NDArray[np.float64], level: float = 1.0) -> float:
        """Robust chi-square of (n, c) residuals, standard errors being ``level`` times as large."""
        return robust(residual / level, self.scale)

    def core(self, fit: Fit) -> float:
        """The robust chi-square without the few residuals that may lie anywhere."""
        z = np.sort(np.abs(fit.residual).ravel())[::-1]
        wild = z[: round(self.few * z.size)]
        return fit.cost - robust(wild[wild > self.scale], self.scale)

    def trust(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """The weight of each of (n, c) residuals when one more light is asked for; 0 of the few."""
        _, weight = cauchy(z, self.scale)
        if self.lawful:
            return np.where(outside(z)[1] < RATHER, 0.0, weight)
        far, few = np.abs(z), round(self.few * z.size)
        least = np.sort(far, axis=None)[z.size - few - 1] if few else np.inf
        return np.where(far > max(self.scale, least), 0.0, weight)


@dataclass(frozen=True)
class Chance:
    """The largest gain in chi-square that a light has where there is none: Gumbel's law.

    Parameters
    ----------
    middle, width
        Its mode and its scale. A search simulates them in the room at hand; these are typical.

    Examples
    --------
    >>> round(Chance().gain(0.001), 1), round(Chance().gain(0.05), 1)
    (20.1, 13.8)
    """

    middle: float = 9.0
    width: float = 1.6

    def gain(self, probability: float) -> float:
        """What is gained, or more, with so small a probability."""
        return float(self.middle - self.width * np.log(-np.log1p(-probability)))


TYPICAL = Chance()


@dataclass(frozen=True)
class Criterion:
    """What decides.

    Parameters
    ----------
    likelihood
        Of the residuals.
    gain
        Least gain in chi-square that no noise leaves, in units of the noise.
    unlikely
        Standard deviations by which chi-square may exceed its mean and still be explained by noise.
    lenient
        The same for a light that is thought possible.
    shared
        Least gain in chi-square per residual.
    """

    likelihood: Likelihood
    gain: float
    unlikely: float
    lenient: float
    shared: float = 0.0

    @staticmethod
    def of(o: Options, chance: Chance = TYPICAL) -> Criterion:
        """The one that a user's options ask for."""
        known = o.noise == "given"
        typical = 1.0 if known else ESTIMATED
        likelihood = Likelihood(
            scale=o.outlier, known=known, lawful=o.noise == "estimate", typical=typical
        )
        gain, lenient = chance.gain(o.false_alarm), chance.gain(max(o.false_alarm, COUNTED))
        return Criterion(likelihood, gain, o.unlikely, lenient)

    def after_removal(self) -> Criterion:
        """The same for what is left once indirect light was removed."""
        estimated = replace(self.likelihood, typical=ESTIMATED)
        return replace(self.doubting(), likelihood=estimated)

    def knowing(self) -> Criterion:
        """The same where sigma follows the law that was found."""
        return replace(self, likelihood=replace(self.likelihood, known=True))

    def doubting(self) -> Criterion:
        """The same where errors are shared by neighbours."""
        return replace(self, shared=max(self.shared, SHARED))

    def errors(self, fits: Sequence[Fit]) -> Errors:
        """What the best of the fits leaves, taken for noise; no less than the standard errors say.

        Where these follow a law: that of the likeliest fit.
        """
        scale = self.likelihood.scale
        if self.likelihood.lawful:
            likeliest = min(fits, key=self.by_law)
            return Errors.of_law(likeliest, scale)
        if self.likelihood.known:
            return Errors(max(1.0, min(level_of(fit.residual) for fit in fits)), scale)
        return Errors(min(estimated_level(fit.residual) for fit in fits), scale)

    def by_law(self, fit: Fit) -> float:
        """How unlikely a fit is by the law of what it leaves, each light charged its least gain."""
        return fit.law.cost * fit.residual.size + len(fit) * self.gain

    def best(self, fits: Sequence[Fit]) -> Fit:
        """The fit of least cost at the level of noise that the best leaves."""
        errors = self.errors(fits)
        return min(fits, key=lambda fit: errors.cost(fit.residual))

    def price(self, problem: Problem) -> float:
        """Chi-square that a further light must gain, in units of the noise."""
        return max(self.gain, self.shared * problem.rows)

    def is_worth(self, problem: Problem, fewer: Fit, more: Fit, errors: Errors) -> bool:
        """Whether further lights gain what they must, and not on a handful of observations alone.

        A light can always explain as many observations as it has unknowns. Without those that
        gain most, half of the least gain must be left; so that no outlier is taken for a light.
        """
        lights = len(more) - len(fewer)
        price = lights * self.price(problem)
        gains = np.sort((errors.loss(fewer.residual) - errors.loss(more.residual)).ravel())
        unknowns = lights * (len(problem.axes) + problem.radiance.shape[1])
        return gains.sum() > price and gains[: max(0, len(gains) - unknowns)].sum() > price / 2

    def chosen(self, problem: Problem, fits: Sequence[Fit]) -> Fit:
        """The fit whose lights are each worth their parameters."""
        fits = sorted(fits, key=len)
        errors, best = self.errors(fits), fits[0]
        for fit in fits[1:]:
            if self.is_worth(problem, best, fit, errors):
                best = fit
        return best

    def allowed(self, problem: Problem, fits: Sequence[Fit], claimed: int) -> range:
        """The counts of lights from what is claimed to what is thought possible."""
        easy = replace(self, gain=self.lenient)
        return range(claimed, max(claimed, len(easy.chosen(problem, fits))) + 1)

    def likely(self, problem: Problem, fits: Sequence[Fit]) -> list[float]:
        """How likely each fit's count of lights is beside the likeliest of all.

        If the model and the errors are right: exp(-d / 2), with d the difference in chi-square at
        the level of noise that the best leaves, each light being charged what it must gain.
        """
        errors, price = self.errors(fits), self.price(problem)
        costs = [errors.cost(fit.residual) + len(fit) * price for fit in fits]
        return [float(np.exp((min(costs) - cost) / 2)) for cost in costs]

    def is_explained(self, problem: Problem, fit: Fit) -> bool:
        """Whether the residual is no more than noise, but for the few that may lie anywhere."""
        share, core = outside(fit.residual)
        wild = np.asarray(core < RATHER)
        if share >= MOST_OUTLIERS or self.is_outshone(problem, fit):
            return False
        most = self.likelihood.typical + self.unlikely * np.sqrt(2 / problem.rows)
        if np.square(fit.residual)[~wild].sum() > most * problem.rows:
            return False
        pairs = problem.neighbours
        if (
            wild.mean() > self.likelihood.few
            and clustering(fit.residual, wild, pairs) > self.unlikely
        ):
            return False
        if self.shared or problem.surfels.double:  # exact data leave rounding, which has a pattern
            return True
        return correlation(beyond_rounding(problem, fit) * ~wild, pairs) < self.unlikely

    def is_clean(self, problem: Problem, fit: Fit) -> bool:
        """The same, with none left out: what is systematic does not hide among the few.

        Where errors follow a law, outliers are part of it.
        """
        most = self.likelihood.typical + self.unlikely * np.sqrt(2 / problem.rows)
        return bool(self.squares(fit) < most * problem.rows)

    def trusted(self, problem: Problem, fit: Fit) -> Problem:
        """The observations that are no outliers, where errors follow a law; else all of them."""
        if not self.likelihood.lawful:
            return problem
        _, core = outside(fit.residual)
        return problem.rows_of(np.flatnonzero((core > RATHER).all(axis=1)))

    def squares(self, fit: Fit) -> float:
        """Robust chi-square; where errors follow a law, without the outliers."""
        if not self.likelihood.lawful:
            return fit.cost
        _, core = outside(fit.residual)
        return float(np.square(fit.residual)[core > RATHER].sum())

    def is_outshone(self, problem: Problem, fit: Fit) -> bool:
        """Whether more observations are far brighter than the lights make them than are far from
        dark by them.

        Then these are no few that may lie anywhere: a narrow spotlight lights no more. As many as
        a light has unknowns may be, whatever is lit.
        """
        far = self.likelihood.scale
        brighter = (fit.residual > far).any(axis=1).sum()
        unknowns = len(problem.axes) + problem.radiance.shape[1]
        if brighter <= unknowns:
            return False
        model = problem.radiance / problem.sigma - fit.residual
        return bool(brighter > (model > far).any(axis=1).sum())

    def is_likely(self, problem: Problem, fit: Fit) -> bool:
        """Whether noise leaves as much: the stricter question, before a search may end early."""
        most = 1 + LUCK * np.sqrt(2 / problem.rows)
        left = self.squares(fit) if self.likelihood.lawful else self.likelihood.core(fit)
        likely = self.likelihood.known and left < most * problem.rows
        return bool(likely and not self.is_outshone(problem, fit))


def beyond_rounding(problem: Problem, fit: Fit) -> NDArray[np.float64]:
    """(n, c) residuals without what the rounding of values may be: neighbours share that."""
    half = problem.step / problem.sigma / 2
    return np.sign(fit.residual) * np.maximum(np.abs(fit.residual) - half, 0)
