"""Levenberg-Marquardt for many starts at once: positions and intensities together (section 5.2).

Unbounded unless told otherwise, as Ceres Solver's is: a light may leave the room, and an intensity
may turn negative. All starts share their kernel launches, so that a hundred of them cost little
more than ten.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.shading import shading_gradient
from lightloc.solve import Problem

FIRST_DAMPING = 1e-3  # of the normal equations' diagonal (Marquardt's scaling)
MOST_DAMPING = 1e12  # beyond it no step goes down any more
SMALLEST_FALL = 1e-12  # relative fall of chi-square below which a start has converged
EXACT = (1e-14, 1e-26)  # chi-square in units of the sum of B^2 / sigma^2: the reals' own error
FLAT = 1e-12  # least diagonal of the normal equations, of the largest: a light that nothing sees


@dataclass(frozen=True, eq=False)
class Descents:
    """Where m starts of k lights have come to.

    Args:
        positions: (m, k, 3) metres.
        intensities: (m, k, c) W/sr, of either sign.
        chi2: (m,) sum of squared residuals in standard errors, or of Cauchy's loss of them.
        strayed: (m,) bool, whether a light went further from its start than it was allowed.
    """

    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    chi2: NDArray[np.float64]
    strayed: NDArray[np.bool_]

    @staticmethod
    def of(positions: NDArray[np.float64], intensities: NDArray[np.float64]) -> Descents:
        """Starts that have not moved yet."""
        m = len(positions)
        return Descents(positions, intensities, np.full(m, np.inf), np.zeros(m, bool))

    def __len__(self) -> int:
        return len(self.positions)

    def rows(self, some: NDArray[np.intp]) -> Descents:
        """Some of them."""
        return Descents(
            self.positions[some], self.intensities[some], self.chi2[some], self.strayed[some]
        )

    def with_(self, more: Descents) -> Descents:
        """These and more."""
        names = ("positions", "intensities", "chi2", "strayed")
        return Descents(*(np.concatenate([getattr(self, n), getattr(more, n)]) for n in names))

    def each(self) -> Iterator[Descents]:
        """One at a time."""
        for i in range(len(self)):
            yield self.rows(np.array([i]))


def descend(
    problem: Problem,
    positions: NDArray[np.float64],
    intensities: NDArray[np.float64],
    *,
    stray: float = np.inf,
    steps: int = 100,
    loss: ArrayLike = np.inf,
    inside: bool = False,
    blur: float = 0.0,
    fall: float = SMALLEST_FALL,
) -> Descents:
    """Minimize sum ((B - sum_i I_i S(q, p_i)) / sigma)^2 from m starts.

    Args:
        positions: (m, k, 3) starts, metres; in 2D only x and y move.
        intensities: (m, k, c) starts, W/sr.
        stray: a start is given up once one of its lights is further from where it began, metres
            ("terminating early if the light positions stray too far", section 5.2).
        steps: the most evaluations a start.
        loss: standard errors beyond which a residual counts less and less (Cauchy's loss); a
            number, or one a start; infinite for plain least squares.
        inside: lights stay within the problem's bounds, and intensities stay above zero.
        blur: shadows' edges are this wide, metres (`shading_gradient`).
        fall: relative fall of chi-square below which a start has converged.

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
    scale = np.broadcast_to(np.asarray(loss, float), (len(positions),))
    model = _Model(problem, blur, inside)
    positions, intensities = np.asarray(positions, float), np.asarray(intensities, float)
    if not len(positions):
        return Descents.of(positions, intensities)
    here = model.place(*model.kept(positions, intensities), scale)
    start, m = here.positions, len(positions)
    strayed = np.zeros(m, bool)
    damping, growth = np.full(m, FIRST_DAMPING), np.full(m, 2.0)
    exact = EXACT[problem.surfels.double] * float(np.square(problem.radiance / problem.sigma).sum())
    active = np.flatnonzero(here.chi2 > exact)
    for _ in range(steps):
        if not len(active):
            break
        now = here.rows(active)
        step, promised = _steps(now, damping[active])
        there = model.place(*model.moved(now, step), scale[active])
        with np.errstate(invalid="ignore"):
            gain = now.chi2 - there.chi2
            better = np.isfinite(there.chi2) & (gain > 0)
            ratio = np.where(better, gain / np.maximum(promised, np.finfo(float).tiny), 0)
        here = here.replaced(active[better], there.rows(np.flatnonzero(better)))
        shrink = np.maximum(1 / 3, 1 - (2 * np.minimum(ratio, 2) - 1) ** 3)
        damping[active] *= np.where(better, shrink, growth[active])
        growth[active] = np.where(better, 2.0, 2 * growth[active])
        moved = np.linalg.norm(here.positions[active] - start[active], axis=2)
        strayed[active] = moved.max(axis=1, initial=0.0) > stray
        done = strayed[active] | (damping[active] > MOST_DAMPING)
        done |= better & ((gain < fall * now.chi2) | (there.chi2 < exact))
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


@dataclass(frozen=True)
class _Model:
    """Residuals, and the normal equations of a step."""

    problem: Problem
    blur: float
    inside: bool

    def kept(self, positions: NDArray, intensities: NDArray) -> tuple[NDArray, NDArray]:
        """Parameters within their limits."""
        if not self.inside:
            return positions, intensities
        return np.clip(positions, *self.problem.bounds), np.maximum(intensities, 0.0)

    def moved(self, place: _Place, step: NDArray) -> tuple[NDArray, NDArray]:
        m, k, _ = place.positions.shape
        d = len(self.problem.axes)
        positions = place.positions.copy()
        positions[:, :, self.problem.axes] += step[:, : k * d].reshape(m, k, d)
        brighter = step[:, k * d :].reshape(place.intensities.shape)
        return self.kept(positions, place.intensities + brighter)

    def place(self, positions: NDArray, intensities: NDArray, loss: NDArray) -> _Place:
        """Parameters are all coordinates, then all intensities."""
        problem = self.problem
        m, k, c = intensities.shape
        d = len(problem.axes)
        sane = np.where(np.isfinite(positions), positions, 0).clip(-FAR, FAR)
        S, gradient = shading_gradient(
            problem.surfels, sane.reshape(m * k, 3), problem.geometry, self.blur, problem.axes
        )
        n, weight = len(S), 1 / problem.sigma
        S = np.broadcast_to(S, (n, m * k, c)) * weight[:, None]
        gradient = np.broadcast_to(gradient, (n, m * k, c, d)) * weight[:, None, :, None]
        S = S.reshape(n, m, k, c).transpose(1, 3, 0, 2)  # m, c, n, k
        gradient = gradient.reshape(n, m, k, c, d).transpose(1, 3, 0, 2, 4)  # m, c, n, k, d
        by_channel = intensities.transpose(0, 2, 1)[:, :, None]  # m, c, 1, k
        r = (S * by_channel).sum(axis=3) - (problem.radiance * weight).T
        moved = (gradient * by_channel[..., None]).reshape(m, c, n, k * d)
        if problem.nuisance is not None:
            r, moved, S = (_beside(problem.nuisance, v) for v in (r[..., None], moved, S))
            r = r[..., 0]
        chi2, trust = _cauchy(r, loss)
        A = np.zeros((m, k * (d + c), k * (d + c)))
        g = np.zeros((m, k * (d + c)))
        for channel in range(c):
            columns = np.concatenate([np.arange(k * d), k * d + np.arange(k) * c + channel])
            J = np.concatenate([moved[:, channel], S[:, channel]], axis=2)
            weighed = J if trust is None else J * trust[:, channel, :, None]
            A[:, columns[:, None], columns] += weighed.transpose(0, 2, 1) @ J
            g[:, columns] += (r[:, channel, None, :] @ weighed)[:, 0]
        if self.inside:
            self._held(positions, intensities, A, g)
        return _Place(positions, intensities, chi2, A, g)

    def _held(self, positions: NDArray, intensities: NDArray, A: NDArray, g: NDArray) -> None:
        """What is at a limit and would go beyond it stays where it is."""
        low, high = self.problem.bounds[:, self.problem.axes]
        p = positions[:, :, self.problem.axes]
        m = len(p)
        at_low = np.concatenate(
            [(p <= low).reshape(m, -1), (intensities <= 0).reshape(m, -1)], axis=1
        )
        at_high = np.concatenate(
            [(p >= high).reshape(m, -1), np.zeros(intensities.shape, bool).reshape(m, -1)], axis=1
        )
        held = (at_low & (g > 0)) | (at_high & (g < 0))
        g[held] = 0
        A *= np.where(held[:, :, None] | held[:, None, :], np.eye(g.shape[1]), 1.0)


def _beside(u: NDArray, v: NDArray) -> NDArray:
    """Columns v (m, c, n, j) without their part along u (c, n)."""
    return v - u[None, :, :, None] * (u[None, :, None, :] @ v)


def _cauchy(r: NDArray, loss: NDArray) -> tuple[NDArray, NDArray | None]:
    """Cauchy's loss over (m, c, n) residuals, and the weight that each then has; None for 1."""
    if np.isinf(loss).all():
        return np.square(r).sum(axis=(1, 2)), None
    scale = loss[:, None, None]
    with np.errstate(invalid="ignore"):
        far = np.square(r / scale)
        chi2 = np.where(np.isinf(scale), np.square(r), scale**2 * np.log1p(far))
    return chi2.sum(axis=(1, 2)), 1 / (1 + far)


FAR = 1e6
"""Metres; a light that left for further away is evaluated there, so that kernels stay finite."""
