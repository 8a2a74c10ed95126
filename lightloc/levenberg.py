"""Levenberg-Marquardt for many starts at once: positions and intensities together (section 5.2).

Unbounded, as Ceres Solver's is: a light may leave the room, and an intensity may turn negative.
All starts share their kernel launches, so that a hundred of them cost little more than ten.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.shading import shading_gradient
from lightloc.solve import Problem

FIRST_DAMPING = 1e-3  # of the normal equations' diagonal (Marquardt's scaling)
MOST_DAMPING = 1e12  # beyond it no step goes down any more
SMALLEST_STEP_GAIN = 1e-12  # relative fall of chi-square below which a start has converged
EXACT = 1e-14  # chi-square a residual, in units of the mean B^2 / sigma^2: float32's own error
FLAT = 1e-12  # least diagonal of the normal equations, of the largest: a light that nothing sees


@dataclass(frozen=True, eq=False)
class Descents:
    """Where m starts of k lights have come to.

    Args:
        positions: (m, k, 3) metres.
        intensities: (m, k, c) W/sr, of either sign.
        chi2: (m,) sum of squared residuals in standard errors.
        strayed: (m,) bool, whether a light went further from its start than it was allowed.
    """

    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    chi2: NDArray[np.float64]
    strayed: NDArray[np.bool_]


def descend(
    problem: Problem,
    positions: NDArray[np.float64],
    intensities: NDArray[np.float64],
    *,
    stray: float = np.inf,
    steps: int = 100,
) -> Descents:
    """Minimize sum ((B - sum_i I_i S(q, p_i)) / sigma)^2 from m starts.

    Args:
        positions: (m, k, 3) starts, metres; in 2D only x and y move.
        intensities: (m, k, c) starts, W/sr.
        stray: a start is given up once one of its lights is further from where it began, metres
            ("terminating early if the light positions stray too far", section 5.2).
        steps: the most evaluations a start.

    Damping follows Nielsen's rule: divided by up to 3 after a good step, multiplied by 2, 4, 8...
    while steps fail.

    >>> from lightloc import Lambert, Observations, PointLights, radiance
    >>> rng = np.random.default_rng(0)
    >>> floor, up = rng.uniform(-1, 1, (99, 3)) * [1, 1, 0], np.tile([0.0, 0.0, 1.0], (99, 1))
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(99),
    ...                  material=Lambert(albedo=0.5))
    >>> q = q.with_radiance(radiance(q, PointLights([[0.2, 0.1, 0.7]], [3.0])), 0.0)
    >>> problem = Problem.of(q, np.ones((99, 1)), None, np.array([[-1, -1, 0.0], [1, 1, 1.0]]))
    >>> there = descend(problem, np.array([[[-0.3, 0.4, 0.5]]]), np.array([[[1.0]]]))
    >>> there.positions.round(3).tolist(), there.intensities.round(2).tolist()
    ([[[0.2, 0.1, 0.7]]], [[[3.0]]])
    """
    here = _evaluate(problem, np.asarray(positions, float), np.asarray(intensities, float))
    start, m = here.positions, len(positions)
    strayed = np.zeros(m, bool)
    damping, growth = np.full(m, FIRST_DAMPING), np.full(m, 2.0)
    exact = EXACT * float(np.square(problem.radiance / problem.sigma).sum())
    active = np.flatnonzero(here.chi2 > exact)
    for _ in range(steps):
        if not len(active):
            break
        now = here.rows(active)
        step, promised = _steps(now, damping[active])
        there = _evaluate(problem, *_moved(problem, now, step))
        with np.errstate(invalid="ignore"):
            fall = now.chi2 - there.chi2
            better = np.isfinite(there.chi2) & (fall > 0)
            ratio = np.where(better, fall / np.maximum(promised, np.finfo(float).tiny), 0)
        here = here.replaced(active[better], there.rows(np.flatnonzero(better)))
        shrink = np.maximum(1 / 3, 1 - (2 * np.minimum(ratio, 2) - 1) ** 3)
        damping[active] *= np.where(better, shrink, growth[active])
        growth[active] = np.where(better, 2.0, 2 * growth[active])
        moved = np.linalg.norm(here.positions[active] - start[active], axis=2)
        strayed[active] = moved.max(axis=1, initial=0.0) > stray
        done = strayed[active] | (damping[active] > MOST_DAMPING)
        done |= better & ((fall < SMALLEST_STEP_GAIN * now.chi2) | (there.chi2 < exact))
        active = active[~done]
    return Descents(here.positions, here.intensities, here.chi2, strayed)


@dataclass(frozen=True, eq=False)
class _Place:
    """m points of the search with what a step needs: A = J^T J and g = J^T r."""

    positions: NDArray
    intensities: NDArray
    chi2: NDArray  # (m,)
    A: NDArray  # (m, u, u)
    g: NDArray  # (m, u)

    def rows(self, some: NDArray) -> _Place:
        return _Place(*(getattr(self, name)[some] for name in self.__dataclass_fields__))

    def replaced(self, some: NDArray, by: _Place) -> _Place:
        result = {}
        for name in self.__dataclass_fields__:
            result[name] = getattr(self, name).copy()
            result[name][some] = getattr(by, name)
        return replace(self, **result)


def _steps(place: _Place, damping: NDArray) -> tuple[NDArray, NDArray]:
    """The damped Gauss-Newton steps (m, u) and the fall of chi-square that each promises."""
    diagonal = np.einsum("muu->mu", place.A)
    diagonal = np.maximum(diagonal, FLAT * diagonal.max(axis=1, keepdims=True))
    diagonal = np.maximum(diagonal, np.finfo(float).tiny)
    damped = place.A + (damping[:, None] * diagonal)[:, :, None] * np.eye(place.g.shape[1])
    root = np.sqrt(diagonal)
    scaled = damped / (root[:, :, None] * root[:, None, :])
    step = -np.linalg.solve(scaled, (place.g / root)[:, :, None])[:, :, 0] / root
    promised = damping * (step * step * diagonal).sum(axis=1) - (step * place.g).sum(axis=1)
    return step, promised


def _moved(problem: Problem, place: _Place, step: NDArray) -> tuple[NDArray, NDArray]:
    m, k, _ = place.positions.shape
    d = len(problem.axes)
    positions = place.positions.copy()
    positions[:, :, problem.axes] += step[:, : k * d].reshape(m, k, d)
    return positions, place.intensities + step[:, k * d :].reshape(place.intensities.shape)


def _evaluate(problem: Problem, positions: NDArray, intensities: NDArray) -> _Place:
    """Residuals and normal equations; parameters are all coordinates, then all intensities."""
    m, k, c = intensities.shape
    d = len(problem.axes)
    sane = np.where(np.isfinite(positions), positions, 0).clip(-FAR, FAR)
    S, gradient = shading_gradient(problem.surfels, sane.reshape(m * k, 3), problem.geometry)
    n, weight = len(S), 1 / problem.sigma
    S = np.broadcast_to(S, (n, m * k, c)) * weight[:, None]
    gradient = gradient[..., problem.axes] * weight[:, None, :, None]
    S = S.reshape(n, m, k, c).transpose(1, 3, 0, 2)  # m, c, n, k
    gradient = gradient.reshape(n, m, k, c, d).transpose(1, 3, 0, 2, 4)  # m, c, n, k, d
    by_channel = intensities.transpose(0, 2, 1)  # m, c, k
    r = np.einsum("mcnk,mck->mcn", S, by_channel) - (problem.radiance * weight).T
    moved = (gradient * by_channel[:, :, None, :, None]).reshape(m, c, n, k * d)
    A = np.zeros((m, k * (d + c), k * (d + c)))
    g = np.zeros((m, k * (d + c)))
    for channel in range(c):
        columns = np.concatenate([np.arange(k * d), k * d + np.arange(k) * c + channel])
        J = np.concatenate([moved[:, channel], S[:, channel]], axis=2)
        A[:, columns[:, None], columns] += J.transpose(0, 2, 1) @ J
        g[:, columns] += (r[:, channel, None, :] @ J)[:, 0]
    return _Place(positions, intensities, np.square(r).sum(axis=(1, 2)), A, g)


FAR = 1e6
"""Metres; a light that left for further away is evaluated there, so that kernels stay finite."""
