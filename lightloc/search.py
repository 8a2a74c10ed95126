"""Grow a set of lights: where is one missing, add it, polish all, keep the best hypotheses."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary
from lightloc.certainty import bound_at, inseparable, resolution
from lightloc.certificate import certificate
from lightloc.levenberg import Descents
from lightloc.lights import PointLights
from lightloc.moves import births, deaths, distinct, lights_of, merges, splits, start_at
from lightloc.noise import level_of
from lightloc.options import Options
from lightloc.polish import (
    best_of,
    chosen,
    core_cost,
    cost_at,
    is_explained,
    least_gain,
    noise_level,
    over_edges,
    polished,
    prune,
    sharpened,
    spread_of,
    unmoved,
)
from lightloc.result import Step
from lightloc.solve import Fit, Problem, no_lights, residuals
from lightloc.verdicts import uncertain


@dataclass(eq=False)
class Search:
    """What is searched, and the best fit of each count of lights so far.

    Args:
        tight: some observations with their standard errors.
        loose: the same with wider ones, for the time in which lights are missing.
        dictionary: of ``loose``.
        blurs: widths that shadows' edges get one after the other, metres; (0,) without occluders.
        enough: chi-square a residual below which the search ends at once.
        most: lights beyond which the data only feed an error of the model.
    """

    tight: Problem
    loose: Problem
    dictionary: Dictionary
    blurs: tuple[float, ...]
    o: Options
    enough: float
    watch: Callable[[Step], None] = lambda step: None
    most: int = sys.maxsize
    ladder: dict[int, Fit] = field(default_factory=dict)
    history: list[Step] = field(default_factory=list)
    sure: dict[Fit, bool] = field(default_factory=dict)
    certified: dict[Fit, tuple[Problem, tuple[float, NDArray]]] = field(default_factory=dict)

    @cached_property
    def darkness(self) -> Fit:
        """The fit of no light at all."""
        return no_lights(self.tight, self.o.outlier)

    @property
    def best(self) -> Fit:
        """The fit whose lights are each worth their parameters."""
        fits = [fit for k, fit in self.ladder.items() if k <= self.most]
        return chosen(self.tight, [*fits, self.darkness], self.o)

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to explain."""
        best = self.best
        if best not in self.sure:
            enough = best.cost < self.enough * self.tight.rows
            self.sure[best] = enough or self.is_sure(best)
        return self.sure[best]

    def is_sure(self, fit: Fit) -> bool:
        """Whether no more than noise is left, no place for a light, and no doubt about any."""
        o, problem = self.o, self.tight
        chance = 1 + LUCK * np.sqrt(2 / problem.rows)
        if not len(fit) or o.noise != "given" or core_cost(fit, o) > chance * problem.rows:
            return False
        return self.certificate(problem, fit)[0] ** 2 < least_gain(problem, o)

    def certificate(self, whole: Problem, fit: Fit) -> tuple[float, NDArray[np.float64]]:
        """`certificate` of a fit to ``whole``, in units of what it leaves if that is more."""
        if (known := self.certified.get(fit)) and known[0] is whole:
            return known[1]
        level = max(1.0, level_of(fit.residual)) if len(fit) else 1.0
        own, sampled = (replace(p, sigma=p.sigma * level) for p in (whole, self.tight))
        here = self.dictionary.under(self.loose, sampled)
        found = certificate(own, sampled, here, fit.lights, self.o)
        self.certified[fit] = whole, found
        return found

    def without_errors(self) -> int | None:
        """How many lights explain, where the last ones only adapt to an error of the model.

        What is left is no noise, yet small beside B, and so many lights as `Options.stalled` have
        not quartered it: lights that are there explain more. None where it is not so.
        """
        k, o = max(self.ladder, default=0), self.o
        first = k - o.stalled
        if first not in self.ladder or self.ladder[k].cost < self.tight.rows:
            return None
        B = np.maximum(self.tight.radiance, 0)
        off = np.abs(self.ladder[k].residual) * self.tight.sigma / (B + o.model_error * B.mean())
        if np.median(off) > o.model_error or self.left(k, first) < o.stalled_share:
            return None
        while first - 1 in self.ladder and self.left(first, first - 1) > o.little:
            first -= 1
        return first

    def left(self, more: int, fewer: int) -> float:
        """The share that so many lights leave of the squares that fewer had left.

        Without the largest tenth: outliers stay whatever lights there are.
        """
        squares = [np.sort(np.square(self.ladder[k].residual).ravel()) for k in (more, fewer)]
        kept = round(KEPT * self.tight.rows)
        return float(squares[0][:kept].sum() / squares[1][:kept].sum())

    def start(self, lights: PointLights) -> None:
        """Go on from lights: where they explain what is seen, they are not questioned further."""
        fit = sharpened(self.tight, start_at(lights), self.o)
        if is_explained(fit, self.tight, self.o):
            self.keep("start", fit)
        else:
            self.note("start", self.refined(start_at(lights), 1, self.o.outlier))

    def note(self, action: str, front: Descents) -> None:
        """Judge hypotheses by the observations' own errors, and keep the best.

        Only where the wider errors are met already is it worth refining with the own ones.
        """
        fits, near = [], self.o.near * self.loose.rows
        for one in front.each():
            if one.chi2[0] < near:
                fits.append(sharpened(self.tight, one, self.o, deep=self.tight.surfels.double))
            else:
                fits.append(unmoved(self.tight, one, self.o))
        fit = best_of(fits, self.o)
        if self.blurs[0] and front.chi2.min() < near and self.is_promising(fit):
            fit = over_edges(self.tight, fit, self.o)
        self.keep(action, fit)

    def keep(self, action: str, fit: Fit) -> None:
        """Keep a fit if it is the best of its count."""
        known = self.ladder.get(len(fit), fit)
        self.ladder[len(fit)] = best_of([known, fit], self.o)
        self.history.append(Step(action, len(fit), fit.cost / self.tight.rows))
        self.watch(self.history[-1])

    def is_promising(self, fit: Fit) -> bool:
        """Whether it is not so far behind the best that nothing will bring it before that."""
        best, o = self.best, self.o
        behind = o.promising * least_gain(self.tight, o) * max(1.0, best.cost / self.tight.rows)
        return fit.cost < best.cost + behind

    def refined(self, starts: Descents, most: int, loss: float, below: float = np.inf) -> Descents:
        """The ``most`` best of the starts, polished, if a quick look brings them ``below``."""
        apart = float(np.linalg.norm(self.dictionary.grid.step)) / 2
        tried = polished(self.loose, starts, loss, self.o.quick, self.blurs[:1], self.o)
        kept = distinct(tried.rows(np.flatnonzero(tried.chi2 < below)), most, apart)
        return polished(self.loose, kept, loss, self.o.thorough, self.blurs, self.o)


LUCK = 2.0
"""Standard deviations of chi-square above its mean at which a fit is looked at again."""

KEPT = 0.9
"""Share of the residuals that tell what lights leave."""


def open_with(s: Search, ground) -> None:
    """The opening."""
    from lightloc.opening import opened

    def told(one: Descents) -> bool:
        fit = sharpened(s.tight, one, s.o, deep=s.tight.surfels.double, patient=False)
        if is_explained(fit, s.tight, s.o):
            fit = prune(s.tight, fit, s.o)
            if s.blurs[0] and not s.tight.surfels.double:
                fit = over_edges(s.tight, fit, s.o)
        s.keep("open", fit)
        return s.ended

    opened(s.tight, ground.sampled, ground.dictionary, s.o, told)


def grow(s: Search, beam: int, front=None) -> None:
    """Add lights one by one, keeping the ``beam`` best hypotheses, while there is a gain.

    A later growth goes on to as many lights as the best has.
    """
    o, c = s.o, s.tight.radiance.shape[1]
    front, idle = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, c))), 0
    if len(s.best): front = start_at(s.best.lights)
    while front.positions.shape[1] < o.most_lights and idle < o.patience and not s.ended:
        loss = spread_of(residuals(s.loose, lights_of(front)), o)
        starts = births(s.loose, s.dictionary, front, loss, o.candidates, o)
        if not len(starts):
            return
        before = s.best
        front = s.refined(starts, beam, loss)
        s.note("add", front)
        new = s.best is not before or front.positions.shape[1] <= len(before)
        idle = 0 if new else idle + 1
        if (most := s.without_errors()) is not None:
            s.most = most
            return


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
        if len(best) < min(o.most_lights, s.most):
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
