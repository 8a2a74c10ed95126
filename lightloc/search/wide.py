"""Lights that are no points: a few found close together that one wide light explains as well.

A light of any shape brings what a point at its centroid does and, to second order in its size,
I/2 H : C on top, where C is the covariance of its shape and H holds the second derivatives of S.
Two points have such a C too: so a wide light is found as two that are not there. Both are compared
here. The wide light is made of points c +- h_a, two for each free axis a, each with the same share
of its intensity; h_a is column a of a triangular matrix T, so that C = T T^T / d can be anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from lightloc.fit import (
    AT_HAND,
    Bound,
    Criterion,
    Descents,
    Fit,
    Likelihood,
    Problem,
    Tie,
    Unknown,
    covariance_of,
    descend,
    jacobian,
    residuals,
)
from lightloc.given import PointLights
from lightloc.search.moves import MERGE
from lightloc.search.polish import THOROUGH

ROUND = 0.1
"""Share of its length that a shape has across the line on which two points lie, to begin with:
with a hundredth it stays flat, since nothing tells a flat shape's width to first order."""

POINT = 1e-6
"""Of the longest side: no shape starts smaller, where lights lie at the same place."""


@dataclass(frozen=True, eq=False)
class Extended:
    """Lights of which some are wide.

    Parameters
    ----------
    fit
        The lights' centroids and whole intensities, with what they leave as wide as they are.
    width : (k,) array
        In the unit of length; two equal points so far apart look the same. 0 for a point.
    errors
        Their standard errors where the widths are unknown too.
    points
        All points that stand for them.
    """

    fit: Fit
    width: NDArray[np.float64]
    errors: Bound
    points: PointLights

    def brightest_first(self) -> Extended:
        """The same lights in the order of what they send."""
        lights = self.fit.lights
        order = lights.order
        k, c = lights.intensities.shape
        d = len(self.errors.covariance) // k - c
        own = [(order[:, None] * each + np.arange(each)).ravel() for each in (d, c)]
        rows = np.concatenate([own[0], k * d + own[1]])
        errors = Bound(
            self.errors.position[order],
            self.errors.intensity[order],
            self.errors.covariance[np.ix_(rows, rows)],
        )
        fit = replace(self.fit, lights=lights.brightest_first())
        return Extended(fit, self.width[order], errors, self.points)


@dataclass(frozen=True)
class Unknowns:
    """The order of unknowns x: d coordinates a light, c intensities a light, T of each wide one.

    Parameters
    ----------
    points, wide
        How many lights of each kind; those that are wide come last.
    axes : (d,) array
        Coordinates that lights may move along.
    channels
        c.
    home : (3,) array
        Where they are along the others, in the unit of length.
    """

    points: int
    wide: int
    axes: NDArray[np.intp]
    channels: int
    home: NDArray[np.float64]

    @property
    def lights(self) -> int:
        return self.points + self.wide

    @property
    def of_points(self) -> int:
        """How many unknowns there are beside the shapes."""
        return self.lights * (len(self.axes) + self.channels)

    @cached_property
    def linear(self) -> NDArray[np.float64]:
        """From x to coordinates and intensities of all points, in the order of `jacobian`."""
        d, c, k, each = len(self.axes), self.channels, self.lights, 2 * len(self.axes)
        row, column = np.tril_indices(d)
        m = self.points + self.wide * each
        p = np.zeros((m, d, self.of_points + self.wide * len(row)))
        I = np.zeros((m, c, p.shape[2]))
        for i in range(m):
            light, part = i, None
            if i >= self.points:
                wide, part = divmod(i - self.points, each)
                light = self.points + wide
                entries = np.flatnonzero(column == part // 2)
                shape = self.of_points + wide * len(row) + entries
                p[i, row[entries], shape] = 1 if part % 2 else -1
            p[i, range(d), light * d + np.arange(d)] = 1
            I[i, range(c), k * d + light * c + np.arange(c)] = 1 if part is None else 1 / each
        return np.concatenate([p.reshape(m * d, -1), I.reshape(m * c, -1)])

    def expanded(self, x: NDArray[np.float64]) -> PointLights:
        """All points that stand for the lights."""
        return self._lights(self.linear @ x, self.points + self.wide * 2 * len(self.axes))

    def x_of(self, points: Descents) -> NDArray[np.float64]:
        """x of points that stand for the lights."""
        p = points.positions[0][:, self.axes].ravel()
        full = np.concatenate([p, points.intensities[0].ravel()])
        return np.linalg.lstsq(self.linear, full)[0]

    def centroids(self, x: NDArray[np.float64]) -> PointLights:
        """The lights' centroids with their whole intensities."""
        return self._lights(x[: self.of_points], self.lights)

    def width(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) twice the largest standard deviation of each light's shape."""
        T = np.zeros((self.lights, len(self.axes), len(self.axes)))
        row, column = np.tril_indices(len(self.axes))
        T[self.points :, row, column] = x[self.of_points :].reshape(self.wide, -1)
        return 2 * np.linalg.norm(T, 2, axis=(1, 2)) / np.sqrt(len(self.axes))

    def _lights(self, x: NDArray[np.float64], m: int) -> PointLights:
        d = len(self.axes)
        p = np.tile(self.home, (m, 1))
        p[:, self.axes] = x[: m * d].reshape(m, d)
        I = np.maximum(x[m * d :], 0)  # least squares round what is dark to below 0
        return PointLights(p, I.reshape(m, self.channels))


def extended(problem: Problem, fit: Fit, criterion: Criterion, widest: float) -> Extended | None:
    """The lights with those joined that one wide light explains as well; None where none is so.

    What is joined is as wide as ``widest`` at most, of the longest side, and loses less
    chi-square than a further light would have to gain.
    """
    best, groups = None, [[i] for i in range(len(fit))]
    errors, price = criterion.errors([fit]), criterion.price(problem)
    for close in gathered(problem, fit.lights, widest):
        tried = [group for group in groups if group[0] not in close] + [close]
        wide = joined(problem, fit.lights, sorted(tried, key=len), criterion.likelihood)
        lost = errors.cost(wide.fit.residual) - errors.cost(fit.residual)
        if lost < price and wide.width.max() < widest * problem.size:
            best, groups = wide, tried
    return best.brightest_first() if best else None


def gathered(problem: Problem, lights: PointLights, widest: float) -> list[list[int]]:
    """Groups of lights whose spread is small for what they send."""
    p, I = lights.positions, lights.intensities.mean(axis=1)
    apart = np.linalg.norm(p[:, None] - p, axis=2)
    power = np.maximum(np.add.outer(I, I), np.finfo(float).tiny)
    width = 2 * np.sqrt(np.outer(I, I)) / power * apart
    close = (width < widest * problem.size) & (apart < MERGE * problem.size)
    close &= np.multiply.outer(I, I) > 0
    count, group = connected_components(close, directed=False)
    groups = [np.flatnonzero(group == i).tolist() for i in range(count)]
    return [group for group in groups if len(group) > 1]


def joined(
    problem: Problem,
    lights: PointLights,
    groups: Sequence[Sequence[int]],
    likelihood: Likelihood,
) -> Extended:
    """Refine with each group of several lights as one wide light; groups of one come first."""
    x, unknowns = start(problem, lights, groups)
    first = unknowns.expanded(x)
    there = descend(
        problem,
        Descents.at(first),
        steps=THOROUGH[0],
        unknown=Unknown.POSITIVE,
        damping=AT_HAND,
        loss=likelihood.scale,
        tie=Tie(unknowns.linear, unknowns.lights),
    )
    x, points = unknowns.x_of(there), there.lights
    z = residuals(problem, points)
    J = jacobian(problem, points) @ unknowns.linear
    spread = covariance_of(J.reshape(-1, J.shape[2]))[: unknowns.of_points, : unknowns.of_points]
    return Extended(
        Fit(unknowns.centroids(x), z, likelihood.cost(z), problem),
        unknowns.width(x),
        Bound.of(spread, problem.axes, len(groups), lights.channels),
        points,
    )


def start(
    problem: Problem, lights: PointLights, groups: Sequence[Sequence[int]]
) -> tuple[NDArray[np.float64], Unknowns]:
    """Each group's sum, centroid and covariance as the unknowns."""
    d, p, I, shapes = len(problem.axes), [], [], []
    for group in groups:
        some = lights.intensities[group]
        power = some.mean(axis=1) + np.finfo(float).tiny
        share = power / power.sum()
        center = share @ lights.positions[group]
        p.append(center[problem.axes])
        I.append(some.sum(axis=0))
        if len(group) > 1:
            off = (lights.positions[group] - center)[:, problem.axes]
            C = (off * share[:, None]).T @ off
            C += (ROUND**2 * np.trace(C) + (POINT * problem.size) ** 2) * np.eye(d)
            shapes.append(np.linalg.cholesky(d * C)[np.tril_indices(d)])
    unknowns = Unknowns(
        len(groups) - len(shapes), len(shapes), problem.axes, lights.channels, lights.positions[0]
    )
    return np.concatenate([np.ravel(p), np.ravel(I), *shapes]), unknowns
