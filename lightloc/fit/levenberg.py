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
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.deadline import is_over
from lightloc.fit.batched import Indirect, Model, Place, Tie, Unknown
from lightloc.fit.problem import Problem
from lightloc.given import PointLights

FIRST_DAMPING = 1.0  # of the normal equations' diagonal (Marquardt's scaling)
NEARBY = 1e-2  # a first damping for starts that are nearly there
AT_HAND = 1e-3  # the same for starts that need a polish: intensities are then unknowns themselves
MOST_DAMPING = 1e12  # beyond it no step goes down any more
EASED = 1 / 3  # damping after a step that fulfils its promise (Nielsen's rule)
SMALLEST_FALL = 1e-12  # relative fall of chi-square below which a start has converged
EXACT = (1e-14, 1e-26)  # chi-square in units of the sum of B^2 / sigma^2: the reals' own error
FLAT = 1e-12  # least diagonal of the normal equations, of the largest: a light that nothing sees
POLISH_FALL = (1e-5, 1e-6)  # the relative fall that ends a polish, in 32 and in 64 bits


@dataclass(frozen=True, eq=False)
class Descents:
    """Where m starts of k lights have come to.

    Parameters
    ----------
    positions : (m, k, 3) array
        In the unit of length.
    intensities : (m, k, c) array
        W/sr.
    chi2 : (m,) array
        Sum of squared residuals in standard errors, or of Cauchy's loss of them.
    strayed : (m,) array
        Whether a light went further from its start than it was allowed.
    """

    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    chi2: NDArray[np.float64]
    strayed: NDArray[np.bool_]

    @staticmethod
    def of(positions: ArrayLike, intensities: ArrayLike) -> Descents:
        """Starts (m, k, 3) and (m, k, c) that have not moved yet."""
        p, I = np.asarray(positions, float), np.asarray(intensities, float)
        return Descents(p, I, np.full(len(p), np.inf), np.zeros(len(p), bool))

    @staticmethod
    def at(lights: PointLights) -> Descents:
        """One start, at lights."""
        return Descents.of(lights.positions[None], lights.intensities[None])

    @property
    def lights(self) -> PointLights:
        """The first hypothesis as lights."""
        return PointLights(self.positions[0], np.maximum(self.intensities[0], 0))

    def __len__(self) -> int:
        return len(self.positions)

    def rows(self, some: NDArray[np.intp]) -> Descents:
        """Some of them."""
        return Descents(
            self.positions[some], self.intensities[some], self.chi2[some], self.strayed[some]
        )

    def each(self) -> Iterator[Descents]:
        """One at a time."""
        for i in range(len(self)):
            yield self.rows(np.array([i]))


def descend(
    problem: Problem,
    starts: Descents,
    *,
    stray: float = np.inf,
    steps: int = 100,
    loss: ArrayLike = np.inf,
    unknown: Unknown = Unknown.LOGARITHM,
    blur: float = 0.0,
    fall: float = SMALLEST_FALL,
    damping: float = FIRST_DAMPING,
    tie: Tie | None = None,
    indirect: Indirect | None = None,
) -> Descents:
    """Minimize sum ((B - sum_i I_i S(q, p_i)) / sigma)^2 from m starts, within the bounds.

    The optimization of section 5.2.

    Parameters
    ----------
    problem
        B, its errors, and the bounds.
    starts
        m sets of k lights; in 2D only x and y move.
    stray
        A start is given up once one of its lights is further from where it began, in the unit of
        length ("terminating early if the light positions stray too far", section 5.2).
    steps
        The most evaluations per start.
    loss : float or (m,) array_like
        Standard errors beyond which a residual counts less and less (Cauchy's loss); infinite for
        plain least squares.
    unknown
        What stands for the intensities.
    blur
        Shadows' edges are this wide, in the unit of length (`shading_gradient`).
    fall
        Relative fall of chi-square below which a start has converged.
    damping
        The first, of the normal equations' diagonal.
    tie
        Between lights that move together; intensities are then unknowns themselves.
    indirect
        What lights bring by way of the surfaces, in the model on top.

    Returns
    -------
    Descents
        Where each start has ended.

    Examples
    --------
    >>> from lightloc import Lambert, Observations, PointLights, radiance
    >>> rng = np.random.default_rng(0)
    >>> floor, up = rng.uniform(-1, 1, (99, 3)) * [1, 1, 0], np.tile([0.0, 0.0, 1.0], (99, 1))
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(99),
    ...                  material=Lambert(albedo=0.5))
    >>> B = radiance(q, PointLights([[0.2, 0.1, 0.7]], [3.0]))
    >>> box = np.array([[-1, -1, 0.1], [1, 1, 1.0]])
    >>> here = descend(Problem.of(q.with_radiance(B, 0.01), np.full((99, 1), 0.01), None, box),
    ...                Descents.of([[[0.0, 0.0, 0.5]]], [[[1.0]]]))
    >>> here.positions.round(2).tolist(), here.intensities.round(2).tolist()
    ([[[0.2, 0.1, 0.7]]], [[[3.0]]])
    """
    m = len(starts)
    if not m:
        return starts
    scale = np.broadcast_to(np.asarray(loss, float), (m,))
    blur = blur if problem.geometry is not None else 0.0
    model = Model(problem, starts.positions.shape[1], blur, unknown, tie, indirect)
    here = model.begun(starts.positions, starts.intensities, scale)
    begun = here.positions.copy()
    strayed, damp, growth = np.zeros(m, bool), np.full(m, damping), np.full(m, 2.0)
    exact = EXACT[problem.surfels.double] * float(np.square(problem.radiance / problem.sigma).sum())
    active = np.flatnonzero(here.chi2 > exact)
    for _ in range(steps):
        if not len(active) or is_over():
            break
        now = here.rows(active)
        tried = damp[active]
        step, promised = damped_steps(model, now, tried)
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
            moved = np.linalg.norm(here.positions[active] - begun[active], axis=2)
            strayed[active] = moved.max(axis=1, initial=0.0) > stray
        done = strayed[active] | (damp[active] > MOST_DAMPING)
        done |= better & ((gain < fall * now.chi2) | (there.chi2 < exact))
        done |= ~better & (tried < NEARBY) & (promised < fall * now.chi2)
        active = active[~done]
    return Descents(here.positions, here.intensities, here.chi2, strayed)


def normal_equations(problem: Problem, one: Descents, loss: float) -> NDArray[np.float64]:
    """(u, u) J^T W J at a hypothesis, over all coordinates, then the intensities' logarithms.

    ``loss`` is the scale of Cauchy's loss, standard errors, that W follows from.
    """
    model = Model(problem, one.positions.shape[1], 0.0, Unknown.LOGARITHM)
    return model.begun(one.positions, one.intensities, np.array([loss])).A[0]


def damped_steps(
    model: Model, place: Place, damping: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The damped Gauss-Newton steps (m, u) and the fall of chi-square that each promises.

    In 64 bits a step bends as the residuals do along it (geodesic acceleration: Transtrum and
    Sethna, arXiv:1201.5885, 2012), or it would creep along the narrow valleys of exact data.
    """
    diagonal = np.einsum("muu->mu", place.A)
    diagonal = np.maximum(diagonal, FLAT * diagonal.max(axis=1, keepdims=True))
    diagonal = np.maximum(diagonal, np.finfo(float).tiny)
    root = np.sqrt(diagonal)
    u, bend = place.g.shape[1], np.zeros_like(place.g)
    if rows := place.R.shape[1]:
        damped = np.sqrt(damping)[:, None, None] * np.eye(u)
        Q, R = np.linalg.qr(np.concatenate([place.R[:, :, :u] / root[:, None], damped], axis=1))

        def solved(b: NDArray[np.floating]) -> NDArray[np.float64]:
            return -np.linalg.solve(R, Q[:, :rows].swapaxes(1, 2) @ b)[:, :, 0] / root

        step = solved(place.R[:, :, u:])
        bend = solved(model.bent(place, step)) / 2
    else:
        scaled = place.A / (root[:, :, None] * root[:, None, :])
        scaled += damping[:, None, None] * np.eye(u)
        step = -np.linalg.solve(scaled, (place.g / root)[:, :, None])[:, :, 0] / root
    for each in (step, bend):  # begun on an observation: stays, and is given up
        each[~np.isfinite(each).all(axis=1)] = 0.0
    promised = damping * (step * step * diagonal).sum(axis=1) - (step * place.g).sum(axis=1)
    return step + bend, promised
