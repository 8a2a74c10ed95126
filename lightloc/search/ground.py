"""What searches over the same observations share, whatever B is: the sample, and S on a grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Step
from lightloc.fields import Grid
from lightloc.fit import Chance, Criterion, Problem, is_exact, working_sigma
from lightloc.given import Geometry, Observations, Options
from lightloc.optics import reflected_ambient, surfels
from lightloc.search.chance import by_chance
from lightloc.search.dictionary import Dictionary, atoms_at
from lightloc.search.view import View

BITS = 10
"""Of each coordinate in a Morton code: a thousand cells along the longest side."""


@dataclass(frozen=True, eq=False)
class Ground:
    """The observations that a search looks at first, and the grid of positions that it asks.

    Parameters
    ----------
    whole
        All observations, with the B and the sigma that it was made of.
    some : (m,) array, optional
        Indices of the sample; None where it is all of them.
    sampled
        The problem that ``dictionary`` was made over, in 32 bits.
    dictionary
        S at the grid's positions.
    is_open
        Whether nothing comes between any of them and any position of the grid.
    chance
        What a light gains by chance alone.
    """

    whole: Problem
    some: NDArray[np.intp] | None
    sampled: Problem
    dictionary: Dictionary
    is_open: bool
    chance: Chance

    @staticmethod
    def of(
        q: Observations,
        geometry: Geometry | None,
        bounds: NDArray[np.float64],
        o: Options,
        seed: int,
    ) -> Ground:
        exact = is_exact(q) and o.noise == "given"
        whole = Problem.of(q, working_sigma(q, o), geometry, bounds, double=exact)
        if o.ambient:
            whole = replace(whole, ambient=reflected_ambient(whole.surfels, q.channels))
        n = len(q)
        some = None
        if o.sample < n:
            some = np.random.default_rng(seed).permutation(n)[: o.sample]
            some = some[morton(q.positions[some])]
        single = replace(whole, surfels=surfels(q, geometry)) if exact else whole
        sampled = single if some is None else single.rows_of(some)
        cells = o.cells_2d if len(whole.axes) == 2 else o.cells
        dictionary = Dictionary.over(sampled, Grid.over(whole.bounds, cells))
        is_open = geometry is None or not occludes(sampled, dictionary)
        chance = by_chance(sampled, dictionary)
        return Ground(whole, some, sampled, dictionary, is_open, chance)

    def at(self, places: NDArray[np.float64] | None) -> Ground:
        """The same with all lights held at (k, 3) places; free where None."""
        return replace(self, whole=replace(self.whole, places=places))

    def of_sample(self) -> Ground:
        """The same with the sample as all that there is."""
        if self.some is None:
            return self
        return replace(self, whole=self.whole.rows_of(self.some), some=None)

    def view(
        self,
        whole: Problem,
        o: Options,
        criterion: Criterion,
        watch: Callable[[Step], None] = lambda step: None,
        *,
        enough: float = 0.0,
        rough: bool = False,
    ) -> View:
        """These observations with the B and the sigma of ``whole``."""
        geometry = None if self.is_open else whole.geometry
        tight = replace(whole if self.some is None else whole.rows_of(self.some), geometry=geometry)
        return View(
            tight=tight,
            single=replace(self.sampled, radiance=tight.radiance, geometry=geometry),
            dictionary=self.dictionary,
            occluded=not self.is_open,
            most_lights=o.most_lights,
            criterion=criterion,
            enough=enough,
            rough=rough,
            watch=watch,
        )


def morton(x: NDArray[np.float64]) -> NDArray[np.intp]:
    """The order of (n, 3) points along a Morton curve, so that rays from neighbours go together.

    Examples
    --------
    >>> morton(np.array([[0.9, 0.9, 0], [0.1, 0, 0], [1, 1, 0], [0, 0, 0]])).tolist()
    [3, 1, 0, 2]
    """
    extent = max(float(np.ptp(x, axis=0).max()), np.finfo(float).tiny)
    cells = ((x - x.min(axis=0)) / extent * (2**BITS - 1)).astype(np.int64)
    code = np.zeros(len(x), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def occludes(problem: Problem, dictionary: Dictionary) -> bool:
    """Whether anything comes between any observation and any position of the grid."""
    free = atoms_at(replace(problem, geometry=None), dictionary.points)
    return bool(((free > 0) & (dictionary.atoms == 0)).any())
