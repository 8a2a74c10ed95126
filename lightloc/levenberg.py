"""Levenberg-Marquardt for many starts at once: positions and intensities together (section 5.2).

What decides how much a search must try is the basin of its local solver. Three traps are closed:

- An intensity that is clamped at 0 has no gradient left, and its light never comes back. The
  unknown is its logarithm: a dark light keeps its gradient, relative to what it sends.
- A light on the wall itself mostly sticks there. Lights keep `MARGIN` away from the border.
- A first step that trusts the model throws lights through the room. Damping begins at 1.

Table 1's square rooms, five lights, started anywhere, the count known: a low error in 4 % of the
starts with none of the three, in 29 % with the box kept, in 44 % with all; in 71 % where starts
keep as far from the walls as the lights do. docs/solver.md says what else was measured.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.shading import shadows, slopes
from lightloc.solve import Problem

FIRST_DAMPING = 1.0  # of the normal equations' diagonal (Marquardt's scaling)
NEARBY = 1e-2  # a first damping for starts that are nearly there
MOST_DAMPING = 1e12  # beyond it no step goes down any more
EASED = 1 / 3  # damping after a step that fulfils its promise (Nielsen's rule)
SMALLEST_FALL = 1e-12  # relative fall of chi-square below which a start has converged
EXACT = (1e-14, 1e-26)  # chi-square in units of the sum of B^2 / sigma^2: the reals' own error
FLAT = 1e-12  # least diagonal of the normal equations, of the largest: a light that nothing sees
MARGIN = 1e-3  # of the longest side, that lights keep from the region's border until they are near
TOUCHING = 1e-6  # the same where they are near: S is infinite on an observation itself
BRIGHTER = 2.0  # most that the logarithm of an intensity changes in one step
DARKEST = 1e-9  # of the brightest: a start is given no less
REUSED = 0.5  # of the blur: a light that moved no further keeps its shadows, by their slope


class Unknown(Enum):
    """What stands for an intensity among the unknowns."""

    LOGARITHM = "far from the end: a dark light comes back"
    POSITIVE = "near it: the model is linear in it; held at 0"
    FREE = "the published method's: of either sign"


@dataclass(frozen=True, eq=False)
class Descents:
    """Where m starts of k lights have come to.

    Args:
        positions: (m, k, 3) metres.
        intensities: (m, k, c) W/sr.
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
    unknown: Unknown = Unknown.LOGARITHM,
    blur: float = 0.0,
    fall: float = SMALLEST_FALL,
    damping: float = FIRST_DAMPING,
) -> Descents:
    """Minimize sum ((B - sum_i I_i S(q, p_i)) / sigma)^2 from m starts, within the bounds.

    Args:
        positions: (m, k, 3) starts, metres; in 2D only x and y move.
        intensities: (m, k, c) starts, W/sr.
        stray: a start is given up once one of its lights is further from where it began, metres
            ("terminating early if the light positions stray too far", section 5.2).
        steps: the most evaluations a start.
        loss: standard errors beyond which a residual counts less and less (Cauchy's loss); a
            number, or one a start; infinite for plain least squares.
        unknown: what stands for the intensities.
        blur: shadows' edges are this wide, metres (`shading_gradient`).
        fall: relative fall of chi-square below which a start has converged.
        damping: the first, of the normal equations' diagonal.

    >>> from lightloc import Lambert, Observations, PointLights, radiance
    >>> rng = np.random.default_rng(0)
    >>> floor, up = rng.uniform(-1, 1, (99, 3)) * [1, 1, 0], np.tile([0.0, 0.0, 1.0], (99, 1))
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(99),
    ...                  material=Lambert(albedo=0.5))
    >>> B = radiance(q, PointLights([[0.2, 0.1, 0.7]], [3.0]))
    >>> box = np.array([[-1, -1, 0.1], [1, 1, 1.0]])
    >>> here = descend(Problem.of(q.with_radiance(B, 0.01), np.full((99, 1), 0.01), None, box),
    ...                np.array([[[0.0, 0.0, 0.5]]]), np.array([[[1.0]]]))
    >>> here.positions.round(2).tolist(), here.intensities.round(2).tolist()
    ([[[0.2, 0.1, 0.7]]], [[[3.0]]])
    """
    positions, intensities = np.asarray(positions, float), np.asarray(intensities, float)
    if not len(positions):
        return Descents.of(positions, intensities)
    scale = np.broadcast_to(np.asarray(loss, float), (len(positions),))
    model = _Model(problem, blur if problem.geometry is not None else 0.0, unknown)
    here = model.begun(positions, intensities, scale)
    start, m = here.positions.copy(), len(positions)
    strayed, damp, growth = np.zeros(m, bool), np.full(m, damping), np.full(m, 2.0)
    exact = EXACT[problem.surfels.double] * float(np.square(problem.radiance / problem.sigma).sum())
    active = np.flatnonzero(here.chi2 > exact)
    for _ in range(steps):
        if not len(active):
            break
        now = here.rows(active)
        step, promised = _steps(now, damp[active])
        there = model.moved(now, step, scale[active])
        with np.errstate(invalid="ignore", over="ignore"):  # nothing promised: ratio is infinite
            gain = now.chi2 - there.chi2
            better = np.isfinite(there.chi2) & (gain > 0)
            ratio = np.where(better, gain / np.maximum(promised, np.finfo(float).tiny), 0)
        here = here.replaced(active[better], there.rows(np.flatnonzero(better)))
        ease = np.maximum(EASED, 1 - (2 * np.minimum(ratio, 2) - 1) ** 3)
        damp[active] *= np.where(better, ease, growth[active])
        growth[active] = np.where(better, 2.0, 2 * growth[active])
        if np.isfinite(stray):
            moved = np.linalg.norm(here.positions[active] - start[active], axis=2)
            strayed[active] = moved.max(axis=1, initial=0.0) > stray
        done = strayed[active] | (damp[active] > MOST_DAMPING)
        done |= better & ((gain < fall * now.chi2) | (there.chi2 < exact))
        active = active[~done]
    return Descents(here.positions, here.intensities, here.chi2, strayed)


def normal_equations(
    problem: Problem, one: Descents, loss: float, blur: float = 0.0
) -> NDArray[np.float64]:
    """(u, u) J^T W J at a hypothesis, over all coordinates, then the intensities' logarithms."""
    blur = blur if problem.geometry is not None else 0.0
    model = _Model(problem, blur, Unknown.LOGARITHM)
    return model.begun(one.positions, one.intensities, np.array([loss])).A[0]


@dataclass(frozen=True, eq=False)
class _Place:
    """m points of the search with what a step needs: A = J^T J and g = J^T r.

    Shadows are kept with the positions where they were taken: V, its slope, and those positions.
    """

    positions: NDArray
    intensities: NDArray
    chi2: NDArray  # (m,)
    A: NDArray  # (m, u, u)
    g: NDArray  # (m, u)
    seen: NDArray  # (m, k, n), V; of no length where nothing occludes
    turn: NDArray  # (m, d, k, n), its slope; of no length where edges are hard
    taken: NDArray  # (m, k, 3)

    def rows(self, some: NDArray) -> _Place:
        return _Place(*(getattr(self, one.name)[some] for one in fields(self)))

    def replaced(self, some: NDArray, by: _Place) -> _Place:
        if len(some) == len(self.chi2):
            return by
        result = {}
        for one in fields(self):
            result[one.name] = getattr(self, one.name).copy()
            result[one.name][some] = getattr(by, one.name)
        return _Place(**result)


def _steps(place: _Place, damping: NDArray) -> tuple[NDArray, NDArray]:
    """The damped Gauss-Newton steps (m, u) and the fall of chi-square that each promises."""
    diagonal = np.einsum("muu->mu", place.A)
    diagonal = np.maximum(diagonal, FLAT * diagonal.max(axis=1, keepdims=True))
    diagonal = np.maximum(diagonal, np.finfo(float).tiny)
    root = np.sqrt(diagonal)
    scaled = place.A / (root[:, :, None] * root[:, None, :])
    scaled += damping[:, None, None] * np.eye(place.g.shape[1])
    step = -np.linalg.solve(scaled, (place.g / root)[:, :, None])[:, :, 0] / root
    step[~np.isfinite(step).all(axis=1)] = 0.0  # begun on an observation: stays, and is given up
    promised = damping * (step * step * diagonal).sum(axis=1) - (step * place.g).sum(axis=1)
    return step, promised


@dataclass(frozen=True)
class _Model:
    """Residuals, and the normal equations of a step.

    Unknowns are all coordinates, light by light, then all intensities or their logarithms.
    """

    problem: Problem
    blur: float
    unknown: Unknown

    def begun(self, positions: NDArray, intensities: NDArray, loss: NDArray) -> _Place:
        """The starts, within their limits."""
        m, k, _ = intensities.shape
        if self.unknown is Unknown.LOGARITHM:
            least = DARKEST * intensities.max(axis=(1, 2), keepdims=True, initial=0.0)
            intensities = np.maximum(intensities, np.maximum(least, np.finfo(float).tiny))
        n, d = self.problem.surfels.n, len(self.problem.axes)
        occluded = self.problem.geometry is not None or not self.problem.surfels.flat
        seen = np.zeros((m, k, n if occluded else 0), np.float32)
        turn = np.zeros((m, d, k, n if self.blur else 0), np.float32)
        nowhere = np.full(positions.shape, np.inf)
        return self.place(self.kept(positions), intensities, loss, (seen, turn, nowhere))

    def kept(self, positions: NDArray) -> NDArray:
        """Positions within the region's border, up to which only what is near may go."""
        low, high = self.problem.bounds
        margin = TOUCHING if self.unknown is Unknown.POSITIVE else MARGIN
        edge = margin * self.problem.size * (high > low)
        return np.clip(positions, low + edge, high - edge)

    def moved(self, place: _Place, step: NDArray, loss: NDArray) -> _Place:
        m, k, _ = place.positions.shape
        axes = self.problem.axes
        positions = place.positions.copy()
        positions[:, :, axes] += step[:, : k * len(axes)].reshape(m, k, -1)
        change = step[:, k * len(axes) :].reshape(place.intensities.shape)
        if self.unknown is Unknown.FREE:
            intensities = place.intensities + change
        elif self.unknown is Unknown.POSITIVE:
            intensities = np.maximum(place.intensities + change, 0.0)
        else:
            intensities = place.intensities * np.exp(np.clip(change, -BRIGHTER, BRIGHTER))
        known = (place.seen.copy(), place.turn.copy(), place.taken.copy())
        return self.place(self.kept(positions), intensities, loss, known)

    def shadowed(
        self, positions: NDArray, known: tuple[NDArray, NDArray, NDArray]
    ) -> tuple[NDArray, NDArray]:
        """V (m, k, n) and its slope (m, d, k, n), taken anew for lights that moved too far."""
        seen, turn, taken = known
        axes = self.problem.axes
        off = positions - taken
        far = ~(np.linalg.norm(off, axis=2) <= REUSED * self.blur)
        if far.any():
            V, slope = shadows(
                self.problem.surfels, positions[far], self.problem.geometry, self.blur, axes
            )
            seen[far], taken[far], off[far] = V, positions[far], 0.0
            if slope is not None:
                turn.swapaxes(1, 2)[far] = slope.swapaxes(0, 1)
        if not self.blur:
            return seen, turn
        step = off[:, :, axes].astype(np.float32)
        return np.clip(seen + np.einsum("mdkn,mkd->mkn", turn, step), 0, 1), turn

    def place(
        self,
        positions: NDArray,
        intensities: NDArray,
        loss: NDArray,
        known: tuple[NDArray, NDArray, NDArray],
    ) -> _Place:
        """The normal equations there."""
        problem = self.problem
        m, k, c = intensities.shape
        d, n = len(problem.axes), problem.surfels.n
        S, gradient = slopes(problem.surfels, positions.reshape(m * k, 3), problem.axes)
        S = S.reshape(-1, m, k, n)
        gradient = gradient.reshape(-1, d, m, k, n)
        if known[0].shape[2]:
            seen, turn = self.shadowed(positions, known)
            gradient = gradient * seen
            if self.blur:
                gradient = gradient + S[:, None] * turn.swapaxes(0, 1)
            S = S * seen
        weight = (1 / problem.sigma).T  # c, n
        A = np.zeros((m, k * (d + c), k * (d + c)))
        g = np.zeros((m, k * (d + c)))
        chi2 = np.zeros(m)
        for channel in range(c):
            own = min(channel, len(S) - 1)
            I = intensities[:, :, channel, None]
            bright = S[own] * weight[channel].astype(S.dtype)
            lit = bright * I.astype(S.dtype)
            r = lit.sum(axis=1, dtype=float) - (problem.radiance[:, channel] * weight[channel])
            J = np.empty((m, k * (d + 1), n), S.dtype)
            scale = (I * weight[channel]).astype(S.dtype)
            for axis in range(d):
                np.multiply(gradient[own, axis], scale, out=J[:, axis : k * d : d])
            J[:, k * d :] = lit if self.unknown is Unknown.LOGARITHM else bright
            if problem.nuisance is not None:
                u = problem.nuisance[channel]
                r = r - (r @ u)[:, None] * u
                J = J - (J @ u)[:, :, None].astype(S.dtype) * u.astype(S.dtype)
            own_chi2, trust = _cauchy(r, loss)
            weighed = J if trust is None else J * trust[:, None, :].astype(S.dtype)
            columns = np.concatenate([np.arange(k * d), k * d + np.arange(k) * c + channel])
            A[:, columns[:, None], columns] += weighed @ J.transpose(0, 2, 1)
            g[:, columns] += (weighed @ r[:, :, None].astype(S.dtype))[:, :, 0]
            chi2 += own_chi2
        self._held(positions, intensities, A, g)
        return _Place(positions, intensities, chi2, A, g, *known)

    def _held(self, positions: NDArray, intensities: NDArray, A: NDArray, g: NDArray) -> None:
        """What is at a limit and would go beyond it stays where it is."""
        low, high = self.kept(np.stack([np.full(3, -np.inf), np.full(3, np.inf)]))
        axes = self.problem.axes
        m, k, _ = positions.shape
        p = positions[:, :, axes].reshape(m, -1)
        first = p.shape[1]
        held = np.zeros(g.shape, bool)
        held[:, :first] = ((p <= np.tile(low[axes], k)) & (g[:, :first] > 0)) | (
            (p >= np.tile(high[axes], k)) & (g[:, :first] < 0)
        )
        if self.unknown is Unknown.POSITIVE:
            held[:, first:] = (intensities.reshape(m, -1) <= 0) & (g[:, first:] > 0)
        if held.any():
            g[held] = 0
            A *= np.where(held[:, :, None] | held[:, None, :], np.eye(g.shape[1]), 1.0)


def _cauchy(r: NDArray, loss: NDArray) -> tuple[NDArray, NDArray | None]:
    """Cauchy's loss over (m, n) residuals, and the weight that each then has; None for 1."""
    if np.isinf(loss).all():
        return np.square(r).sum(axis=1), None
    scale = loss[:, None]
    with np.errstate(invalid="ignore"):
        far = np.square(r / scale)
        chi2 = np.where(np.isinf(scale), np.square(r), scale**2 * np.log1p(far))
    return chi2.sum(axis=1), 1 / (1 + far)
