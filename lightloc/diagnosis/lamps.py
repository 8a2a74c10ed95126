"""Lamps that shine into a half space, the more the nearer to their axis: I(w) = I max(a . w, 0)^m.

They are fitted as points are, with an axis and an exponent m each on top. A light whose m is 0 is a
point that shines alike in all directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.fit import Bound, Problem, cauchy, covariance_of, robust
from lightloc.given import PointLights
from lightloc.optics import shading_gradient

EXPONENTS = (0.5, 100.0)
"""The least m that counts as a lamp's, and the largest."""

TOUCHING = 1e-4
"""Of the longest side, that lamps keep from the region's border."""

TINY = np.finfo(float).tiny

TURN = 0.5
"""Most that an axis turns in one step, radians; also the most that log m changes."""

FALL = 1e-5
"""Relative fall of chi-square that ends a fit."""

FIRST, MOST = 1e-2, 1e8
"""Damping, of the normal equations' diagonal: the first, and where no step goes down any more."""


@dataclass(frozen=True, eq=False)
class Lamps:
    """Lights of which some are lamps.

    Parameters
    ----------
    positions : (k, 3) array
        In the unit of length.
    intensities : (k, c) array
        Along the axes, W/sr.
    axes : (k, 3) array
        Unit vectors.
    exponents : (k,) array
        m; 0 of a light that shines alike in all directions.
    """

    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    axes: NDArray[np.float64]
    exponents: NDArray[np.float64]

    @staticmethod
    def of(lights: PointLights, axis: NDArray[np.float64], exponents: NDArray[np.float64]) -> Lamps:
        """Points as lamps with axes (3,) or (k, 3) and exponents (k,)."""
        axes = np.broadcast_to(axis, lights.positions.shape).astype(float)
        return Lamps(lights.positions, lights.intensities, axes, np.asarray(exponents, float))

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def lights(self) -> PointLights:
        """Where they are, with the intensities along their axes."""
        return PointLights(self.positions, self.intensities)


@dataclass(frozen=True, eq=False)
class Freedom:
    """Which unknowns of k lamps a fit may change, and which go together.

    All unknowns are, light by light: d coordinates each, c intensities each, d - 1 angles each, and
    log m each.

    Parameters
    ----------
    matrix : (all, free) array
        From the unknowns that are free to all.
    """

    matrix: NDArray[np.float64]

    @staticmethod
    def of(lamps: Lamps, d: int, *, exponents: bool = True, alike: bool = False) -> Freedom:
        """All of the lamps; without their ``exponents``, or with one exponent for all."""
        k, c = lamps.intensities.shape
        which = lamps.exponents > 0
        points = k * (d + c)
        every = np.eye(points + k * d)
        own = np.concatenate([np.ones(points, bool), np.repeat(which, d - 1), np.zeros(k, bool)])
        m = every[:, points + k * (d - 1) :][:, which]
        m = m.sum(axis=1, keepdims=True) if alike else m
        return Freedom(np.concatenate([every[:, own], *[m] * exponents], axis=1))

    @property
    def unknowns(self) -> int:
        """How many are free."""
        return self.matrix.shape[1]


@dataclass(frozen=True, eq=False)
class LampFit:
    """Lamps that were fitted, with what they leave: (n, c) in standard errors, and its loss."""

    lamps: Lamps
    residual: NDArray[np.float64]
    cost: float


def seen_from(
    problem: Problem, positions: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions (n, k, 3) from (k, 3) positions to the observations, and (n, k) distances."""
    x = np.stack([np.array(v, np.float64) for v in problem.surfels.x], axis=1)
    way = x[:, None] - positions
    far = np.maximum(np.linalg.norm(way, axis=2), TINY)
    return way / far[:, :, None], far


def tangents(axes: NDArray[np.float64], free: NDArray[np.intp]) -> NDArray[np.float64]:
    """(k, d - 1, 3) the directions that (k, 3) axes may turn to."""
    if len(free) == 2:
        a, b = free
        turned = np.zeros((len(axes), 1, 3))
        turned[:, 0, a], turned[:, 0, b] = -axes[:, b], axes[:, a]
        return turned
    least = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    first = np.cross(axes, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(axes, first)], axis=1)


def shone(
    problem: Problem, lamps: Lamps, S: NDArray[np.float64], slope: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """B of lamps, (n, c), and its derivatives by all their unknowns, (n, c, all).

    S (n, k, c) and its slope (n, k, c, d) are those of points where they are.
    """
    (n, k, c), axes = S.shape, problem.axes
    w, far = seen_from(problem, lamps.positions)
    m, turns = lamps.exponents, tangents(lamps.axes, axes)
    t = np.einsum("nkx,kx->nk", w, lamps.axes)
    lit = t > 0
    log_t = np.log(np.where(lit, t, 1.0))
    g = np.where(m > 0, np.where(lit, np.exp(m * log_t), 0.0), 1.0)
    steep = np.where((m > 0) & lit, m * np.exp((m - 1) * log_t), 0.0)
    moved = -(lamps.axes - t[:, :, None] * w)[:, :, axes] / far[:, :, None]
    I, bright = lamps.intensities, (S * lamps.intensities).swapaxes(1, 2)  # (n, c, k)
    by_place = g[:, :, None, None] * slope + (steep[:, :, None] * moved)[:, :, None] * S[..., None]
    by_place = (by_place * I[:, :, None]).swapaxes(1, 2).reshape(n, c, -1)
    by_intensity = (g[:, None, :, None] * S.swapaxes(1, 2)[..., None] * np.eye(c)[:, None]).reshape(
        n, c, k * c
    )
    along = steep[:, :, None] * np.einsum("nkx,kjx->nkj", w, turns)
    by_angle = (bright[..., None] * along[:, None]).reshape(n, c, -1)
    by_exponent = bright * (m * log_t * g)[:, None]
    every = np.concatenate([by_place, by_intensity, by_angle, by_exponent], axis=2)
    return np.einsum("nk,nkc,kc->nc", g, S, I), every


def model_of(problem: Problem, lamps: Lamps) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What lamps leave, (n, c) standard errors, and the derivatives of their B: (c, n, all)."""
    n, c = problem.radiance.shape
    k, d = len(lamps), len(problem.axes)
    S, slope = shading_gradient(
        problem.surfels, lamps.positions, problem.geometry, axes=problem.axes
    )
    S, slope = np.broadcast_to(S, (n, k, c)), np.broadcast_to(slope, (n, k, c, d))
    B, every = shone(problem, lamps, S, slope)
    J = (every / problem.sigma[:, :, None]).swapaxes(0, 1)
    if problem.nuisance is not None:
        u = problem.nuisance[:, :, None]
        J = J - u * (u * J).sum(axis=1, keepdims=True)
    return problem.without_ambient((problem.radiance - B) / problem.sigma), J


def stepped(problem: Problem, lamps: Lamps, step: NDArray[np.float64]) -> Lamps:
    """Lamps a step (all,) on, within their limits."""
    (k, c), d = lamps.intensities.shape, len(problem.axes)
    parts = np.split(step, np.cumsum([k * d, k * c, k * (d - 1)]))
    positions = lamps.positions.copy()
    edge = TOUCHING * problem.size
    low, high = problem.bounds[:, problem.axes] + np.array([[edge], [-edge]])
    positions[:, problem.axes] = np.clip(
        positions[:, problem.axes] + parts[0].reshape(k, d), low, high
    )
    turn = np.clip(parts[2].reshape(k, d - 1), -TURN, TURN)
    axes = lamps.axes + np.einsum("kj,kjx->kx", turn, tangents(lamps.axes, problem.axes))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    m = np.clip(lamps.exponents * np.exp(np.clip(parts[3], -TURN, TURN)), *EXPONENTS)
    return Lamps(
        positions,
        np.maximum(lamps.intensities + parts[1].reshape(k, c), 0.0),
        axes,
        np.where(lamps.exponents > 0, m, 0.0),
    )


def refined(problem: Problem, start: Lamps, freedom: Freedom, scale: float, steps: int) -> LampFit:
    """Levenberg-Marquardt from a start, under Cauchy's loss."""
    here, damping = start, FIRST
    z, J = model_of(problem, here)
    cost = robust(z, scale)
    for _ in range(steps):
        weight = cauchy(z, scale)[1]
        free = (J @ freedom.matrix).reshape(-1, freedom.matrix.shape[1])
        weighed = free * weight.T.reshape(-1, 1)
        A, g = weighed.T @ free, weighed.T @ z.T.reshape(-1)
        size = np.sqrt(np.maximum(np.diag(A), max(1e-12 * np.diag(A).max(), TINY)))
        scaled = A / np.outer(size, size) + damping * np.eye(len(A))
        step = freedom.matrix @ (np.linalg.solve(scaled, g / size) / size)
        there = stepped(problem, here, step)
        left, slopes = model_of(problem, there)
        new = robust(left, scale)
        if new < cost:
            fall, here, z, J, cost = cost - new, there, left, slopes, new
            damping = max(damping / 5, 1e-9)
            if fall < FALL * cost:
                break
        else:
            damping *= 6
            if damping > MOST:
                break
    return LampFit(here, z, cost)


def sharpened(
    problem: Problem, start: Lamps, freedom: Freedom, scale: float, steps: Sequence[int]
) -> LampFit:
    """`refined` with a loss that narrows to ``scale``, since lamps may begin far off."""
    z, _ = model_of(problem, start)
    wide = max(scale, float(np.quantile(np.abs(z), 0.95)))
    fit = LampFit(start, z, robust(z, scale))
    for most in steps:
        fit = refined(problem, fit.lamps, freedom, wide, most)
        if wide <= scale:
            break
        wide = max(scale, min(wide / 2, float(np.quantile(np.abs(fit.residual), 0.95))))
    return replace(fit, cost=robust(fit.residual, scale))


def errors_of(
    problem: Problem, fit: LampFit, freedom: Freedom
) -> tuple[Bound, NDArray[np.float64]]:
    """Their standard errors with the axes and exponents unknown too, and (k,) those of log m."""
    (k, c), d = fit.lamps.intensities.shape, len(problem.axes)
    _, J = model_of(problem, fit.lamps)
    free = (J @ freedom.matrix).reshape(-1, freedom.matrix.shape[1])
    with np.errstate(invalid="ignore"):  # what nothing tells is infinite, and 0 times that is NaN
        spread = freedom.matrix @ covariance_of(free) @ freedom.matrix.T
    spread[np.isnan(spread)] = np.inf
    points = k * (d + c)
    m = np.sqrt(np.maximum(np.diag(spread)[-k:], 0))
    return Bound.of(spread[:points, :points], problem.axes, k, c), m
