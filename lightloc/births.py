"""Where several lights may be missing at once, each refined alone before it is judged.

A grid over a room steps over a light that stands 5 cm beside a surface: a cell further, others of
the observations are in its shadow. So a peak of the gain is only a start. From it one light alone
is fitted to what is lit in the residual, without shadows: what is dark may lie in one, which costs
nothing there. Fourteen of sixteen starts, up to 4 m away, come to such a light, and no ray is
traced. Then rays judge it, with some places about it, in case it lies behind a thin surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Left, atoms_at, gains_of
from lightloc.levenberg import Descents, descend
from lightloc.solve import Problem
from lightloc.view import Stage

PEAKS, APART = 24, 0.08
"""Peaks of the gain that are starts, and how far apart they are, of the longest side."""

LIT = 1.0
"""Standard errors above the model from which an observation counts as lit by what is missing."""

STEPS, FALL = 30, 1e-3
"""Evaluations of a light alone, and the relative fall of chi-square that ends them."""

NEAR = 0.03
"""Of the longest side: lights nearer than this, alone, are the same."""

CLOUD, REACH = 48, (0.0005, 0.03)
"""Places about a light that are looked at, and how far away they are, of the longest side."""

FAINT = 1e-3
"""Of the brightest that is born: none is born fainter."""

LOT = 0.5
"""Of the gain: how much chance takes of it, at most, where the plain order was in vain."""


def born(
    stage: Stage, one: Descents, loss: float | None, most: int, rng: np.random.Generator | None
) -> Descents | None:
    """One hypothesis with up to ``most`` more lights, each where it alone would gain most.

    Args:
        loss: standard errors beyond which residuals count less and less in the gain; the
            criterion's own where None.
        rng: shuffles the gains; None for their plain order.

    None where nothing gains.
    """
    problem, dictionary = stage.problem, stage.dictionary
    z, scale = stage.residuals(one), stage.criterion.likelihood.scale
    left = Left.robust(problem, one.positions[0], z, scale if loss is None else loss)
    chance = (lambda n: rng.uniform(LOT, 1.0, n)) if rng else np.ones
    gains = dictionary.gains(left)
    peaks = dictionary.peaks(gains * chance(len(gains)), len(gains))
    starts = dictionary.points[spaced(dictionary.points, peaks, PEAKS, APART * problem.size)]
    if not len(starts):
        return None
    found = starts if problem.geometry is None else alone(problem, starts, z, scale)
    atoms = atoms_at(problem, found)
    gains = gains_of(atoms, np.square(atoms), left)
    order = np.argsort(-gains * chance(len(gains)), kind="stable")
    best = spaced(found, order[gains[order] > 0], most, NEAR * problem.size)
    if not len(best):
        return None
    new = np.stack([about(problem, p, left) for p in found[best]])
    atoms = atoms_at(problem, new)
    a = np.stack([one @ r for one, r in zip(atoms, left.residual, strict=True)], axis=1)
    b = np.stack([np.square(one) @ w for one, w in zip(atoms, left.weight, strict=True)], axis=1)
    bright = np.maximum(a / np.maximum(b, np.finfo(np.float32).tiny), 0) / len(new)
    bright = np.maximum(bright, FAINT * bright.max())
    return Descents.of(
        np.concatenate([one.positions, new[None]], axis=1),
        np.concatenate([one.intensities, bright[None]], axis=1),
    )


def alone(
    problem: Problem, places: NDArray[np.float64], z: NDArray[np.float64], scale: float
) -> NDArray[np.float64]:
    """Where one light from each of (m, 3) places explains best what is lit, without shadows."""
    lit = np.flatnonzero((z > LIT).any(axis=1))
    if len(lit) <= len(problem.axes) + 1:
        return places
    left = (z * problem.sigma)[lit]
    bare = replace(problem.rows_of(lit), geometry=None, radiance=left, ambient=None)
    atoms, target = atoms_at(bare, places), z[lit].T[:, None]
    energy = np.maximum(np.square(atoms).sum(axis=2), np.finfo(np.float32).tiny)
    bright = np.maximum((atoms * target).sum(axis=2) / energy, 0).T
    bright = np.maximum(bright, FAINT * bright.max())
    there = descend(bare, places[:, None], bright[:, None], steps=STEPS, loss=scale, fall=FALL)
    return there.positions[:, 0]


def about(problem: Problem, p: NDArray[np.float64], left: Left) -> NDArray[np.float64]:
    """The best of some places about p: it may lie on the wrong side of a thin surface."""
    if problem.geometry is None:
        return p
    axes = problem.axes
    way = np.random.default_rng(0).normal(size=(CLOUD, len(axes)))
    far = np.geomspace(*REACH, CLOUD) * problem.size / np.linalg.norm(way, axis=1)
    places = np.tile(p, (CLOUD + 1, 1))
    places[1:, axes] += way * far[:, None]
    places = np.clip(places, *problem.bounds)
    atoms = atoms_at(problem, places)
    return places[int(np.argmax(gains_of(atoms, np.square(atoms), left)))]


def spaced(
    points: NDArray[np.float64], order: Sequence[int] | NDArray, most: int, apart: float
) -> NDArray[np.intp]:
    """The first ``most`` of ``order`` whose points lie apart from each other, metres."""
    kept: list[int] = []
    for j in order:
        if len(kept) == most:
            break
        if np.linalg.norm(points[kept] - points[j], axis=1).min(initial=np.inf) > apart:
            kept.append(int(j))
    return np.array(kept, int)
