"""Where a light may be missing: peaks of the gain, and where one light alone comes to from each.

A grid over a room steps over a light that stands 5 cm beside a surface: a cell further, others of
the observations are in its shadow. So a peak of the gain is only a start. From it one light alone
is fitted to what is lit in the residual, without shadows: what is dark may lie in one, which costs
nothing there. Fourteen of sixteen starts, up to 4 m away, come to such a light, and no ray is
traced. Both places are tried: in a room full of small shadows the peak is the better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import Descents, Problem, cauchy, descend
from lightloc.search.dictionary import Left, atoms_at
from lightloc.search.view import Stage

LIT = 1.0
"""Standard errors above the model from which an observation counts as lit by what is missing."""

STEPS, FALL = 30, 1e-3
"""Evaluations of a light alone, and the relative fall of chi-square that ends them."""

FAINT = 1e-3
"""Of the brightest: no light alone begins fainter."""


def places(
    stage: Stage, one: Descents, z: NDArray[np.float64], loss: float, most: int
) -> NDArray[np.float64]:
    """(m, 3) places for a further light: up to ``most`` peaks of the gain, and from each one more.

    Parameters
    ----------
    stage
        The observations through wider errors.
    one
        The lights that are there.
    z : (n, c) array
        What they leave, standard errors.
    loss
        Standard errors beyond which residuals count less and less in the gain.
    most
        Number of peaks, at most.
    """
    problem = stage.problem
    left = Left.beside(problem, one.lights, z, cauchy(z, loss)[1])
    tops = stage.dictionary.tops(problem, left, most)
    if problem.geometry is None or not len(tops):
        return tops
    return np.concatenate([tops, alone(problem, tops, z, stage.criterion.likelihood.scale)])


def alone(
    problem: Problem, starts: NDArray[np.float64], z: NDArray[np.float64], scale: float
) -> NDArray[np.float64]:
    """Where one light from each of (m, 3) starts explains best what is lit, without shadows."""
    lit = np.flatnonzero((z > LIT).any(axis=1))
    if len(lit) <= len(problem.axes) + 1:
        return starts
    left = (z * problem.sigma)[lit]
    bare = replace(problem.rows_of(lit), geometry=None, radiance=left, ambient=None)
    atoms, target = atoms_at(bare, starts), z[lit].T[:, None]
    energy = np.maximum(np.square(atoms).sum(axis=2), np.finfo(np.float32).tiny)
    bright = problem.measure * np.maximum((atoms * target).sum(axis=2) / energy, 0).T
    bright = np.maximum(bright, FAINT * bright.max())
    there = descend(
        bare, Descents.of(starts[:, None], bright[:, None]), steps=STEPS, loss=scale, fall=FALL
    )
    return there.positions[:, 0]
