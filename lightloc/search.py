"""Climb: the best fit of each count of lights so far, and what makes it better."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary
from lightloc.certificate import certificate_of
from lightloc.criterion import Criterion
from lightloc.levenberg import Descents
from lightloc.lights import PointLights
from lightloc.moves import births, deaths, distinct, lights_of, merges, splits, start_at
from lightloc.polish import QUICK, THOROUGH, over_edges, polished, sharpened, spread_of
from lightloc.result import Step
from lightloc.solve import Fit, Problem, fit_of, no_lights, residuals

NEAR = 4.0
"""Loss a residual, in the wider errors, from which the own ones are tried."""

PROMISING = 20.0
"""Times the least gain that a fit may stay behind the best and still be refined."""

CANDIDATES, EXCHANGED = 4, 2
"""Peaks of the gain that are refined before one is chosen; the same for each light that is taken
out and put elsewhere."""

FRONT = 3
"""Hypotheses of a move that are refined to their end."""

PATIENCE = 2
"""Lights that may be added in vain, beyond those of the best so far."""

EXCHANGES, WORTHWHILE = 12, 1.0
"""Rounds of exchanging, adding and dropping; chi-square that one must gain for another."""

STALLED, SHARE = 6, 0.25
"""Lights that must lower what is left to this share, where a wrong model could leave that."""

WRONG, LITTLE = 0.15, 0.45
"""Of B, in the median: what a wrong model could leave; the share that the last light before those
must not leave."""

KEPT = 0.9
"""Share of the residuals that tell what lights leave."""


@dataclass(eq=False)
class Search:
    """What is searched, and the best fit of each count of lights so far.

    Args:
        tight: some observations with their standard errors.
        loose: the same with wider ones, for the time in which lights are missing.
        dictionary: of ``loose``.
        blurs: widths that shadows' edges get one after the other, metres; (0,) without occluders.
        criterion: decides what is better and when it is enough.
        enough: chi-square a residual below which the search ends at once.
        rough: the answer is only to be searched on from.
        most: lights beyond which the data only feed an error of the model.
    """

    tight: Problem
    loose: Problem
    dictionary: Dictionary
    blurs: tuple[float, ...]
    most_lights: int
    criterion: Criterion
    enough: float
    rough: bool = False
    watch: Callable[[Step], None] = lambda step: None
    most: int = sys.maxsize
    ladder: dict[int, Fit] = field(default_factory=dict)
    history: list[Step] = field(default_factory=list)
    sure: dict[Fit, bool] = field(default_factory=dict)
    certified: dict[Fit, tuple[Problem, tuple[float, NDArray]]] = field(default_factory=dict)

    @property
    def scale(self) -> float:
        """Standard errors beyond which a residual counts less and less."""
        return self.criterion.likelihood.scale

    @cached_property
    def darkness(self) -> Fit:
        """The fit of no light at all."""
        return no_lights(self.tight, self.scale)

    @property
    def best(self) -> Fit:
        """The fit whose lights are each worth their parameters."""
        fits = [fit for k, fit in self.ladder.items() if k <= self.most]
        return self.criterion.chosen(self.tight, [*fits, self.darkness])

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to explain, and no place for another light."""
        best = self.best
        if best not in self.sure:
            enough = best.cost < self.enough * self.tight.rows
            self.sure[best] = enough or self.is_sure(best)
        return self.sure[best]

    def is_sure(self, fit: Fit) -> bool:
        """Whether no more than noise is left, and no place for a light."""
        if not len(fit) or not self.criterion.is_likely(self.tight, fit):
            return False
        return self.certificate(self.tight, fit)[0] ** 2 < self.criterion.price(self.tight)

    def certificate(self, whole: Problem, fit: Fit) -> tuple[float, NDArray[np.float64]]:
        """`certificate` of a fit to ``whole``, in units of what it leaves if that is more."""
        if (known := self.certified.get(fit)) and known[0] is whole:
            return known[1]
        likelihood = self.criterion.likelihood
        found = certificate_of(fit, whole, self.tight, self.dictionary, self.loose, likelihood)
        self.certified[fit] = whole, found
        return found

    def without_errors(self) -> int | None:
        """How many lights explain, where the last ones only adapt to an error of the model.

        What is left is no noise, yet small beside B, and so many lights as `STALLED` have not
        quartered it: lights that are there explain more. None where it is not so.
        """
        counts = sorted(self.ladder)
        before = [k for k in counts if k <= counts[-1] - STALLED]
        last = self.ladder[counts[-1]]
        if self.rough or not before or last.cost < self.tight.rows:
            return None
        B = np.maximum(self.tight.radiance, 0)
        off = np.abs(last.residual) * self.tight.sigma / (B + WRONG * B.mean())
        if np.median(off) > WRONG or self.left(counts[-1], before[-1]) < SHARE:
            return None
        while len(before) > 1 and self.left(before[-1], before[-2]) > LITTLE:
            before.pop()
        return before[-1]

    def left(self, more: int, fewer: int) -> float:
        """The share that so many lights leave of the squares that fewer had left.

        Without the largest tenth: outliers stay whatever lights there are.
        """
        squares = [np.sort(np.square(self.ladder[k].residual).ravel()) for k in (more, fewer)]
        kept = round(KEPT * self.tight.rows)
        return float(squares[0][:kept].sum() / squares[1][:kept].sum())

    def start(self, lights: PointLights) -> None:
        """Go on from lights: where they explain what is seen, they are not questioned further."""
        fit = sharpened(self.tight, start_at(lights), self.criterion)
        if self.criterion.is_explained(self.tight, fit):
            self.keep("start", fit)
        else:
            self.note("start", self.refined(start_at(lights), 1, self.scale))

    def note(self, action: str, front: Descents) -> None:
        """Judge hypotheses by the observations' own errors, and keep the best.

        Only where the wider errors are met already is it worth refining with the own ones.
        """
        fits, near = [], NEAR * self.loose.rows
        deep = self.tight.surfels.double
        for one in front.each():
            if one.chi2[0] < near:
                fits.append(sharpened(self.tight, one, self.criterion, deep=deep))
            else:
                fits.append(fit_of(self.tight, lights_of(one), self.scale))
        fit = self.criterion.best(fits)
        if self.blurs[0] and front.chi2.min() < near and self.is_promising(fit):
            fit = over_edges(self.tight, fit, self.criterion)
        self.keep(action, fit)

    def keep(self, action: str, fit: Fit) -> None:
        """Keep a fit if it is the best of its count."""
        known = self.ladder.get(len(fit), fit)
        self.ladder[len(fit)] = self.criterion.best([known, fit])
        self.history.append(Step(action, len(fit), fit.cost / self.tight.rows))
        self.watch(self.history[-1])

    def behind(self, cost: float, rows: int) -> float:
        """The cost up to which a fit may still come to be the best."""
        price = self.criterion.price(self.tight)
        return cost + PROMISING * price * max(1.0, cost / rows)

    def is_promising(self, fit: Fit) -> bool:
        """Whether it is not so far behind the best that nothing will bring it before that."""
        return fit.cost < self.behind(self.best.cost, self.tight.rows)

    def refined(self, starts: Descents, most: int, loss: float, below: float = np.inf) -> Descents:
        """The ``most`` best of the starts, polished, if a quick look brings them ``below``."""
        apart = float(np.linalg.norm(self.dictionary.grid.step)) / 2
        tried = polished(self.loose, starts, loss, QUICK, self.blurs[:1])
        kept = distinct(tried.rows(np.flatnonzero(tried.chi2 < below)), most, apart)
        return polished(self.loose, kept, loss, THOROUGH[self.tight.surfels.double], self.blurs)


def grow(s: Search) -> None:
    """Add lights to the best, one by one, while there is a gain."""
    front, idle = start_at(s.best.lights), 0
    while front.positions.shape[1] < s.most_lights and idle < PATIENCE and not s.ended:
        loss = spread_of(residuals(s.loose, lights_of(front)), s.scale)
        starts = births(s.loose, s.dictionary, front, loss, CANDIDATES)
        if not len(starts):
            return
        before = s.best
        front = s.refined(starts, 1, loss)
        s.note("add", front)
        idle = 0 if s.best is not before else idle + 1
        if (most := s.without_errors()) is not None:
            s.most = most
            return


def improve(s: Search) -> None:
    """Exchange, add, drop, merge and split lights of the best fit for as long as that helps."""
    for _ in range(EXCHANGES):
        best = s.best
        if s.ended or not len(best):
            return
        loss = spread_of(residuals(s.loose, best.lights), s.scale)
        here = start_at(best.lights)
        now = polished(s.loose, here, loss, 0, s.blurs[:1]).chi2[0]
        below = s.behind(now, s.loose.rows)
        moves: dict[str, Descents] = {}
        if len(best) > 1:
            fewer = deaths(here)
            moves["exchange"] = births(s.loose, s.dictionary, fewer, loss, EXCHANGED)
            moves["drop"], moves["merge"] = fewer, merges(s.loose, here)
        if len(best) < min(s.most_lights, s.most):
            moves["add"] = births(s.loose, s.dictionary, here, loss, CANDIDATES)
            moves["split"] = splits(s.loose, here)
        for action, starts in moves.items():
            if len(tried := s.refined(starts, FRONT, loss, below)):
                s.note(action, tried)
        better = s.best
        level = s.criterion.level([better])
        cost = s.criterion.likelihood.cost
        gain = cost(best.residual, level) - cost(better.residual, level)
        if len(better) == len(best) and gain < WORTHWHILE:
            return
