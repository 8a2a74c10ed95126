"""Grow a set of lights: where is one missing, add it, polish all, keep the best hypotheses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from lightloc.candidates import Dictionary
from lightloc.levenberg import Descents
from lightloc.moves import births, deaths, distinct, lights_of, merges, splits, start_at
from lightloc.options import Options
from lightloc.polish import (
    best_of,
    chosen,
    cost_at,
    least_gain,
    noise_level,
    over_edges,
    polished,
    sharpened,
    spread_of,
    unmoved,
)
from lightloc.result import Step
from lightloc.solve import Fit, Problem, no_lights, residuals


@dataclass(frozen=True, eq=False)
class Search:
    """What is searched, and the best fit of each count of lights so far.

    Args:
        tight: some observations with their standard errors.
        loose: the same with wider ones, for the time in which lights are missing.
        dictionary: of ``loose``.
        blurs: widths that shadows' edges get one after the other, metres; (0,) without occluders.
        enough: chi-square a residual below which the search ends at once.
    """

    tight: Problem
    loose: Problem
    dictionary: Dictionary
    blurs: tuple[float, ...]
    o: Options
    enough: float
    watch: Callable[[Step], None] = lambda step: None
    ladder: dict[int, Fit] = field(default_factory=dict)
    history: list[Step] = field(default_factory=list)

    @property
    def best(self) -> Fit:
        """The fit whose lights are each worth their parameters."""
        fits = [no_lights(self.tight, self.o.outlier), *self.ladder.values()]
        return chosen(self.tight, fits, self.o)

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to explain."""
        return self.best.cost < self.enough * self.tight.rows

    def note(self, action: str, front: Descents) -> None:
        """Judge hypotheses by the observations' own errors, and keep the best.

        Only where the wider errors are met already is it worth refining with the own ones.
        """
        fits, near = [], self.o.near * self.loose.rows
        for one in front.each():
            judge = sharpened if one.chi2[0] < near else unmoved
            fits.append(judge(self.tight, one, self.o))
        fit = best_of(fits, self.o)
        if self.blurs[0] and front.chi2.min() < near:
            fit = over_edges(self.tight, fit, self.o)
        known = self.ladder.get(len(fit), fit)
        self.ladder[len(fit)] = best_of([known, fit], self.o)
        self.history.append(Step(action, len(fit), fit.cost / self.tight.rows))
        self.watch(self.history[-1])

    def refined(self, starts: Descents, most: int, loss: float, below: float = np.inf) -> Descents:
        """The ``most`` best of the starts, polished, if a quick look brings them ``below``."""
        apart = float(np.linalg.norm(self.dictionary.grid.step)) / 2
        tried = polished(self.loose, starts, loss, self.o.quick, self.blurs[:1], self.o)
        kept = distinct(tried.rows(np.flatnonzero(tried.chi2 < below)), most, apart)
        return polished(self.loose, kept, loss, self.o.thorough, self.blurs, self.o)


def grow(s: Search, beam: int) -> None:
    """Add lights one by one, keeping the ``beam`` best hypotheses, while there is a gain."""
    o, c = s.o, s.tight.radiance.shape[1]
    front, idle = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, c))), 0
    while front.positions.shape[1] < o.most_lights and idle < o.patience and not s.ended:
        loss = spread_of(residuals(s.loose, lights_of(front)), o)
        starts = births(s.loose, s.dictionary, front, loss, o.candidates, o)
        if not len(starts):
            return
        before = s.best
        front = s.refined(starts, beam, loss)
        s.note("add", front)
        idle = 0 if s.best is not before else idle + 1


def improve(s: Search) -> None:
    """Exchange, add, drop, merge and split lights of the best fit for as long as that helps."""
    o = s.o
    for _ in range(o.exchanges):
        best = s.best
        if s.ended or not len(best):
            return
        loss = spread_of(residuals(s.loose, best.lights), o)
        here = start_at(best.lights)
        now = polished(s.loose, here, loss, 0, s.blurs[:1], o).chi2[0]
        below = now + o.promising * least_gain(s.tight, o) * max(1.0, now / s.loose.rows)
        moves: dict[str, Descents] = {}
        if len(best) > 1:
            fewer = deaths(here)
            moves["exchange"] = births(s.loose, s.dictionary, fewer, loss, o.exchanged, o)
            moves["drop"], moves["merge"] = fewer, merges(s.loose, here)
        if len(best) < o.most_lights:
            moves["add"] = births(s.loose, s.dictionary, here, loss, o.candidates, o)
            moves["split"] = splits(s.loose, here)
        for action, starts in moves.items():
            if len(tried := s.refined(starts, o.beam, loss, below)):
                s.note(action, tried)
        better = s.best
        level = noise_level([better], o)
        gain = cost_at(level, best, o) - cost_at(level, better, o)
        if len(better) == len(best) and gain < o.worthwhile:
            return
