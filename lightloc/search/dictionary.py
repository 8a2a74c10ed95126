"""Where a light may be missing: gains in chi-square over a coarse grid of positions.

S(q, p) is computed once for every coarse position and a sample of the observations; each later
question about the whole room is then one product of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from lightloc.fields import Grid
from lightloc.fit import Problem, jacobian, whitened
from lightloc.given import PointLights
from lightloc.optics import shaded


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Residuals of a light at all positions of a grid: ``atoms`` (c, g, n), as `atoms_at`."""

    grid: Grid
    points: NDArray[np.float64]  # (g, 3)
    atoms: NDArray[np.floating]

    @staticmethod
    def over(problem: Problem, grid: Grid) -> Dictionary:
        points = grid.points
        return Dictionary(grid, points, atoms_at(problem, points))

    def under(self, problem: Problem, other: Problem) -> Dictionary:
        """The same positions for the same observations with other standard errors."""
        ratio = (problem.sigma / other.sigma).T[:, None].astype(np.float32)
        return Dictionary(self.grid, self.points, self.atoms * ratio)

    @property
    def unseen(self) -> NDArray[np.bool_]:
        """(g,) whether a light there would reach no observation."""
        return np.asarray((self.atoms <= 0).all(axis=(0, 2)))

    @cached_property
    def energies(self) -> NDArray[np.floating]:
        return np.square(self.atoms)

    def gains(self, left: Left) -> NDArray[np.float64]:
        """`gains_of` this grid's atoms."""
        return gains_of(self.atoms, self.energies, left)

    def peaks(self, gains: NDArray[np.float64], most: int) -> NDArray[np.intp]:
        """The ``most`` highest local maxima of the gains, best first: rows of ``points``."""
        field = gains.reshape(self.grid.shape)
        top = np.flatnonzero((gains > 0) & (field == maximum_filter(field, 3)).ravel())
        return top[np.argsort(-gains[top], kind="stable")][:most]

    def tops(self, problem: Problem, left: Left, most: int) -> NDArray[np.float64]:
        """The ``most`` highest peaks of the gain, each followed to its top: (m, 3), best first.

        ``problem`` is the one that the dictionary is over.
        """
        tops = self.points[self.peaks(self.gains(left), most)].copy()
        for i, p in enumerate(tops):
            reach = self.grid.step
            for _ in range(ZOOMS):
                points = Grid.around(p, reach, problem.bounds, ZOOM).points
                p = points[np.argmax(gains_at(problem, points, left))]
                reach = reach * 2 / ZOOM
            tops[i] = p
        return tops


def atoms_at(problem: Problem, points: NDArray[np.float64]) -> NDArray[np.floating]:
    """S / sigma at (g, 3) points of a light of the problem's measure: (c, g, n), in its bits."""
    S = shaded(problem.surfels, points, problem.geometry)
    bits = BITS[problem.surfels.double]
    return S.astype(bits, copy=False) * (problem.measure / problem.sigma).T[:, None].astype(bits)


@dataclass(frozen=True, eq=False)
class Left:
    """What is left for one more light, once those that are there have adapted to it.

    Parameters
    ----------
    residual : (c, n) array
        In standard errors, without what the others can take up, times weight.
    weight : (c, n) array
        In 0..1, the weight that a robust loss gives each residual.
    basis
        For each channel (n, u): what the others span, times the root of the weight.
    """

    residual: NDArray[np.floating]
    weight: NDArray[np.floating]
    basis: tuple[NDArray[np.floating], ...]

    @staticmethod
    def beside(
        problem: Problem, lights: PointLights, z: NDArray[np.float64], weight: NDArray[np.float64]
    ) -> Left:
        """Beside lights, and all that they can adapt: their own derivatives, and an ambient term.

        ``z`` (n, c) is what they leave, in standard errors, and ``weight`` (n, c) that of each in
        0..1.
        """
        bits = BITS[problem.surfels.double]
        columns = whitened(problem, lights.positions[:0])
        if len(lights):
            J = jacobian(problem, lights).transpose(1, 2, 0)
            columns = np.concatenate([J, columns], axis=1)
        left, spans = [], []
        for c, root in enumerate(np.sqrt(weight).T):
            present = columns[:, (columns[:, :, c] != 0).any(axis=0), c] * root[:, None]
            basis, _ = np.linalg.qr(present)
            own = z[:, c] * root
            left.append((own - basis @ (basis.T @ own)) * root)
            spans.append((basis * root[:, None]).astype(bits))
        return Left(np.array(left, bits), weight.T.astype(bits), tuple(spans))


def gains_at(problem: Problem, points: NDArray[np.float64], left: Left) -> NDArray[np.float64]:
    """`gains_of` a light at (g, 3) points."""
    atoms = atoms_at(problem, points)
    return gains_of(atoms, np.square(atoms), left)


def gains_of(
    atoms: NDArray[np.floating], energies: NDArray[np.floating], left: Left
) -> NDArray[np.float64]:
    """How much chi-square one more light would gain at each position, all others refitted.

    D(p) caps nothing here: one observation in a shadow that the geometry does not have would rule
    out the true light.

    Parameters
    ----------
    atoms, energies : (c, g, n) array
        As `atoms_at` gives them, in any unit, and their squares.
    left
        What is left to explain.

    Returns
    -------
    (g,) array
        The sum over channels of a^2 / b, where a > 0 is the correlation with the residual and b
        what is left of the atom's energy beside the present lights'.
    """
    total = np.zeros(atoms.shape[1])
    for c in range(len(atoms)):
        a = atoms[c] @ left.residual[c]
        b = energies[c] @ left.weight[c]
        floor = ENERGY_LEFT[b.dtype == float] * b
        if left.basis[c].shape[1]:
            b = b - np.square(atoms[c] @ left.basis[c]).sum(axis=1)
        good = (a > 0) & (b > floor) & (floor > 0)
        total += np.where(good, a, 0.0) ** 2 / np.where(good, b, 1.0)
    return total


ZOOMS, ZOOM = 2, 5
"""Finer grids about a peak, so that a shadow's edge starts on its right side, and their cells along
each axis."""

ENERGY_LEFT = (1e-3, 1e-12)
"""Atoms that the present lights explain but for this share are those lights again; in 64 bits."""

BITS = (np.float32, np.float64)
"""Of numbers in products over all positions, in 32 and in 64 bits."""
