"""The opening: several lights at once, more than needed and then fewer, as errors tighten.

Each stage widens the observations' errors and the edges of shadows, so that what one light does
is seen from afar. In it lights are born where the residual's gain peaks, several at once; all are
refined together; and then as many are dropped or joined as the stage's errors can't tell. After
each such round what was found is refined with the observations' own errors: it is enough as soon
as these are met.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.births import born
from lightloc.candidates import Dictionary
from lightloc.criterion import Criterion
from lightloc.levenberg import FIRST_DAMPING, NEARBY, Descents, descend, normal_equations
from lightloc.moves import MERGE
from lightloc.polish import over_edges, prune, sharpened
from lightloc.search import Search
from lightloc.shading import shading_gradient
from lightloc.solve import Problem

STAGES = ((0.2, 0.01), (0.05, 0.005), (0.02, 0.002))
"""Errors, of B, and the width of shadows' edges, of the longest side. Edges three times as wide
hide a light 5 cm beside a surface of an 11 m room; hard ones hold lights where they were born."""

DIM = 0.4
"""Of the mean radiance: nothing darker is given a smaller error than this would have."""

BIRTHS, MORE = 6, 4
"""Lights born at once, and how many more after a round in vain."""

VAIN, ROUNDS = 2, 12
"""Rounds of births in vain that end a stage; rounds at most."""

LIKELY = 1.3
"""Loss a residual, in a stage's errors, at which it is explained."""

STEPS, SHORT, FALL = 30, 10, 1e-4
"""Evaluations of a refinement, and of a look at it; relative fall of chi-square that ends both."""

TRIED = 2
"""Lights that are dropped, and pairs that are joined, before the best of these is taken."""

STIFF = 0.1
"""First damping after a light is gone: the others are to fill its place."""

RIDGE = 1e-9
"""Of the normal equations' diagonal, so that lights at one place can be inverted."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A view of the problem through wider errors.

    Args:
        problem: with the stage's errors.
        dictionary: over it.
        blur: of shadows' edges, metres.
        most_lights: that may be tried.
    """

    problem: Problem
    dictionary: Dictionary
    blur: float
    criterion: Criterion
    most_lights: int

    @staticmethod
    def of(s: Search, level: float, blur: float) -> Stage:
        B = np.maximum(s.tight.radiance, 0)
        wide = np.maximum(s.tight.sigma, level * (B + DIM * B.mean(axis=0)))
        problem = replace(s.loose, sigma=wide)
        blur = blur * problem.size if s.blurs[0] else 0.0
        dictionary = s.dictionary.under(s.loose, problem)
        return Stage(problem, dictionary, blur, s.criterion, s.most_lights)

    def explains(self, one: Descents) -> bool:
        return bool(one.chi2[0] < LIKELY * self.problem.rows)

    def price(self, one: Descents) -> float:
        """Loss that a further light must gain, in units of what is left."""
        left = float(one.chi2[0]) / self.problem.rows
        return self.criterion.price(self.problem) * max(1.0, left)

    def descended(
        self, starts: Descents, damping: float, steps: int = STEPS, loss: float | None = None
    ) -> Descents:
        return descend(
            self.problem,
            starts.positions,
            starts.intensities,
            steps=steps,
            damping=damping,
            loss=self.criterion.likelihood.scale if loss is None else loss,
            blur=self.blur,
            fall=FALL,
        )

    def residuals(self, one: Descents) -> NDArray[np.float64]:
        """(n, c) with shadows as soft as the stage's."""
        problem, p, I = self.problem, one.positions[0], one.intensities[0]
        model: NDArray = np.zeros_like(problem.radiance)
        if len(p):
            S, _ = shading_gradient(problem.surfels, p, problem.geometry, self.blur, problem.axes)
            model = np.einsum("nkc,kc->nc", np.broadcast_to(S, (*S.shape[:2], I.shape[1])), I)
        return problem.without_ambient((problem.radiance - model) / problem.sigma)


def opened(s: Search) -> None:
    """Open a search: through all stages, or until what is found is enough."""
    if s.criterion.is_likely(s.tight, s.darkness):
        return
    one = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, s.tight.radiance.shape[1])))
    rng = np.random.default_rng(0)
    for level, blur in STAGES:
        one, enough = through(Stage.of(s, level, blur), one, rng, lambda found: told(s, found))
        if enough or not one.positions.shape[1]:
            return


def told(s: Search, one: Descents) -> bool:
    """Refine a stage's hypothesis with the observations' own errors; whether that is enough."""
    exact = s.tight.surfels.double
    fit = sharpened(s.tight, one, s.criterion, deep=exact, patient=False)
    if s.criterion.is_explained(s.tight, fit):
        fit = prune(s.tight, fit, s.criterion)
        if s.blurs[0] and not exact:
            fit = over_edges(s.tight, fit, s.criterion)
    s.keep("open", fit)
    if (most := s.without_errors()) is not None:
        s.most = most
    return most is not None or s.ended


def through(
    stage: Stage, one: Descents, rng: np.random.Generator, told: Callable[[Descents], bool]
) -> tuple[Descents, bool]:
    """One stage: the hypothesis that it comes to, and whether it was told to be enough."""
    if one.positions.shape[1]:
        one = stage.descended(one, NEARBY)
        if told(one):
            return one, True
    vain = 0
    for _ in range(ROUNDS):
        if vain == VAIN or stage.explains(one) or one.positions.shape[1] >= stage.most_lights:
            break
        z, scale = stage.residuals(one), stage.criterion.likelihood.scale
        loss = scale if one.positions.shape[1] else np.inf  # at first all is a light's
        most = BIRTHS + MORE * vain
        more = born(
            stage.problem, stage.dictionary, one, z, loss, scale, most, rng if vain else None
        )
        if more is None:
            break
        tried = stage.descended(more, FIRST_DAMPING, loss=loss)
        tried = fewer(stage, stage.descended(tried, NEARBY, STEPS // 2))
        if one.chi2[0] - tried.chi2[0] > stage.price(tried) / 2:
            one, vain = tried, 0
            if told(one):
                return one, True
        else:
            vain += 1
    return one, False


def fewer(stage: Stage, one: Descents) -> Descents:
    """Drop or join lights while that costs less than a light must gain."""
    while one.positions.shape[1] > 1:
        tried = stage.descended(without_one(stage, one), STIFF, SHORT)
        best = tried.rows(np.array([int(np.argmin(tried.chi2))]))
        most = one.chi2[0] + stage.price(one)
        if best.chi2[0] > most:
            best = stage.descended(best, NEARBY)
        if best.chi2[0] > most:
            return one
        one = best
    return one


def without_one(stage: Stage, one: Descents) -> Descents:
    """Hypotheses with a light less: those that matter least dropped, those nearest joined."""
    p, I = one.positions[0], one.intensities[0]
    power = I.mean(axis=1)
    starts = [(np.delete(p, i, 0), np.delete(I, i, 0)) for i in np.argsort(worths(stage, one))]
    starts = starts[:TRIED]
    a, b = np.triu_indices(len(p), 1)
    apart = np.linalg.norm(p[a] - p[b], axis=1)
    spread = np.minimum(power[a], power[b]) * apart**2
    for pair in np.argsort(spread)[:TRIED]:
        if apart[pair] < MERGE * stage.problem.size:
            i, j = a[pair], b[pair]
            q, K = p.copy(), I.copy()
            q[i] = (power[i] * p[i] + power[j] * p[j]) / (power[i] + power[j])
            K[i] = I[i] + I[j]
            starts.append((np.delete(q, j, axis=0), np.delete(K, j, axis=0)))
    positions, intensities = zip(*starts, strict=True)
    return Descents.of(np.stack(positions), np.stack(intensities))


def worths(stage: Stage, one: Descents) -> NDArray[np.float64]:
    """Loss that each light's absence would cost, to first order, all others refitted: (k,)."""
    A = normal_equations(stage.problem, one, stage.criterion.likelihood.scale, stage.blur)
    k, c = one.intensities.shape[1:]
    first = len(A) - k * c
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    spread = np.linalg.inv(A / np.outer(size, size) + RIDGE * np.eye(len(A)))
    cost = np.zeros(k)
    for i in range(k):
        own = first + i * c + np.arange(c)
        cost[i] = size[own] @ np.linalg.inv(spread[np.ix_(own, own)]) @ size[own]
    return cost
