"""The best fit of each count of lights so far, and whether that is enough."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lightloc.answer import Step
from lightloc.fit import MOST_OUTLIERS, Fit
from lightloc.search.view import View

STALLED, SHARE = 6, 0.25
"""Lights that must lower what is left to this share, where a wrong model could leave that."""

WRONG, LITTLE = 0.15, 0.45
"""Of B, in the median: what a wrong model could leave; the share that the last light before those
must not leave."""

KEPT = (0.9, 1 - MOST_OUTLIERS)
"""Share of the residuals that tell what lights leave; the same where errors follow a law, outliers
apart."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """What a search has found.

    Parameters
    ----------
    view
        What it was searched over.
    fits
        The best of each count, from darkness on.
    best
        The one whose lights are each worth their parameters.
    most
        Lights beyond which the data only feed an error of the model; None where it is none.
    enough
        Whether there is nothing left to explain, and no place for another light.
    astray
        Whether its lights were seen to adapt to an error of the model.
    history
        The steps so far.
    """

    view: View
    fits: tuple[Fit, ...]
    best: Fit
    most: int | None = None
    enough: bool = False
    astray: bool = False
    history: tuple[Step, ...] = ()

    @staticmethod
    def on(view: View) -> Ladder:
        """An empty ladder: no lights."""
        return Ladder(view, (view.darkness,), view.darkness, enough=view.is_enough(view.darkness))

    @property
    def ended(self) -> bool:
        """Whether no further light is to be looked for."""
        return self.enough or self.astray or self.most is not None

    def with_(self, action: str, fit: Fit) -> Ladder:
        """The same with a fit on it, if it is the best of its count."""
        view, criterion = self.view, self.view.criterion
        step = Step(action, len(fit), fit.cost / view.tight.rows)
        view.watch(step)
        same = [one for one in self.fits if len(one) == len(fit)]
        others = [one for one in self.fits if len(one) != len(fit)]
        fits = tuple(sorted([*others, criterion.best([*same, fit])], key=len))
        return replace(self, fits=fits, history=(*self.history, step)).judged()

    def judged(self, stalled: int = STALLED) -> Ladder:
        """The same with what is best, where so many lights in vain show an error of the model."""
        view, criterion, fits = self.view, self.view.criterion, self.fits
        most = adapted(view, fits, stalled)
        best = criterion.chosen(view.tight, [f for f in fits if most is None or len(f) <= most])
        enough = self.enough if best is self.best else view.is_enough(best)
        return replace(self, best=best, most=most, enough=enough)


def adapted(view: View, fits: tuple[Fit, ...], stalled: int) -> int | None:
    """How many lights explain, where the last ones only adapt to an error of the model.

    What is left is no noise, yet small beside B, and some of the last lights, ``stalled`` or more,
    have not lowered it as `STALLED` would that quarter it: lights that are there explain more.
    The last that counts leaves `LITTLE` of what one fewer did, and the square of that of what two
    fewer did: a light may look good beside a poor fit of one fewer. None where it is not so.
    """
    last, tight, lawful = fits[-1], view.tight, view.criterion.likelihood.lawful
    before = [fit for fit in fits[1:] if len(fit) <= len(last) - stalled]
    if view.rough or not before or min(view.criterion.squares(fit) for fit in fits) < tight.rows:
        return None
    B = np.maximum(tight.radiance, 0)
    off = np.abs(last.residual) * tight.sigma / (B + WRONG * B.mean())
    fed = (left(last, f, lawful) > SHARE ** ((len(last) - len(f)) / STALLED) for f in before)
    if np.median(off) > WRONG or not any(fed):
        return None
    while any(
        left(before[-1], fit, lawful) > LITTLE**i for i, fit in enumerate(before[-2:-4:-1], 1)
    ):
        before.pop()
    return len(before[-1])


def left(more: Fit, fewer: Fit, lawful: bool) -> float:
    """The share that so many lights leave of the squares that fewer had left.

    Without the largest: outliers stay whatever lights there are.
    """
    squares = [np.sort(np.square(fit.residual).ravel()) for fit in (more, fewer)]
    kept = round(KEPT[lawful] * squares[0].size)
    return float(squares[0][:kept].sum() / squares[1][:kept].sum())
