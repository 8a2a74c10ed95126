"""What a search looks at: observations with their own errors, and the same through wider ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.answer import Step
from lightloc.fit import Criterion, Descents, Fit, Problem, descend, level_of, no_lights
from lightloc.optics import shading_gradient
from lightloc.search.certificate import certificate
from lightloc.search.dictionary import Dictionary

DIM = 0.4
"""Of the mean radiance: nothing darker is given a smaller error than this would have."""

FALL = 1e-4
"""Relative fall of chi-square that ends a descent through wider errors."""


@dataclass(frozen=True, eq=False)
class View:
    """The observations that a search is made over, and what it is asked.

    Parameters
    ----------
    tight
        Some observations with their standard errors.
    single
        The same in 32 bits, whatever their errors.
    dictionary
        Over ``single``.
    occluded
        Whether anything comes between some of them and some position.
    most_lights
        Number of lights, at most.
    criterion
        Decides what is better and when it is enough.
    enough
        Chi-square per residual below which the search ends at once.
    rough
        Whether the answer is only to be searched on from.
    watch
        Is told each step.
    astray
        Whether many lights, the best of the fits of each count, only adapt to an error of the
        model.
    """

    tight: Problem
    single: Problem
    dictionary: Dictionary
    occluded: bool
    most_lights: int
    criterion: Criterion
    enough: float = 0.0
    rough: bool = False
    watch: Callable[[Step], None] = lambda step: None
    astray: Callable[[Sequence[Fit], Fit], bool] = lambda fits, best: False

    @cached_property
    def darkness(self) -> Fit:
        """The fit of no light at all."""
        return no_lights(self.tight, self.criterion.likelihood.scale)

    def through(self, level: float, blur: float) -> Stage:
        """A stage: errors of at least ``level`` of B, shadows' edges ``blur`` of the region."""
        B = np.maximum(self.tight.radiance, 0)
        wide = np.maximum(self.tight.sigma, level * (B + DIM * B.mean(axis=0)))
        problem = replace(self.single, sigma=wide)
        dictionary = self.dictionary.under(self.single, problem)
        soft = blur * problem.size if self.occluded and not self.rough else 0.0
        return Stage(problem, dictionary, soft, self.criterion)

    def is_enough(self, fit: Fit) -> bool:
        """Whether there is nothing left to explain, and no place for another light."""
        if fit.cost < self.enough * self.tight.rows:
            return True
        if not self.criterion.is_likely(self.tight, fit):
            return False
        return self.certificate(self.tight, fit)[0] ** 2 < self.criterion.price(self.tight)

    def certificate(self, whole: Problem, fit: Fit) -> tuple[float, NDArray[np.float64]]:
        """`certificate` of a fit to ``whole``, in units of what it leaves if that is more."""
        level = max(1.0, level_of(fit.residual)) if len(fit) else 1.0
        own, sampled = (replace(p, sigma=p.sigma * level) for p in (whole, self.tight))
        dictionary = self.dictionary.under(self.single, sampled)
        return certificate(own, sampled, dictionary, fit.lights, self.criterion.likelihood)


@dataclass(frozen=True, eq=False)
class Stage:
    """A view through wider errors.

    Parameters
    ----------
    problem
        With the stage's errors.
    dictionary
        Over it.
    blur
        Of shadows' edges, in the unit of length.
    criterion
        The view's.
    """

    problem: Problem
    dictionary: Dictionary
    blur: float
    criterion: Criterion

    def descended(
        self, starts: Descents, damping: float, steps: int, loss: ArrayLike | None = None
    ) -> Descents:
        """Refined, all lights of each hypothesis together."""
        return descend(
            self.problem,
            starts,
            steps=steps,
            damping=damping,
            loss=self.criterion.likelihood.scale if loss is None else loss,
            blur=self.blur,
            fall=FALL,
        )

    def residuals(self, one: Descents) -> NDArray[np.float64]:
        """(n, c) with shadows as soft as the stage's."""
        problem, p, I = self.problem, one.positions[0], one.intensities[0]
        model: NDArray[np.float64] = np.zeros_like(problem.radiance)
        if len(p):
            S, _ = shading_gradient(problem.surfels, p, problem.geometry, self.blur, problem.axes)
            model = np.einsum("nkc,kc->nc", np.broadcast_to(S, (*S.shape[:2], I.shape[1])), I)
        return problem.without_ambient((problem.radiance - model) / problem.sigma)
