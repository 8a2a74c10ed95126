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

from lightloc.grid import Grid
from lightloc.shading import shaded
from lightloc.solve import Problem


@dataclass(frozen=True, eq=False)
class Dictionary:
    """S(q, p) / sigma for all positions of a grid: ``atoms`` (c, g, n) float32.

    ``cap`` (g, c) is D(p), Eq. 6: the brightest that a light can be there.
    """

    grid: Grid
    points: NDArray[np.float64]  # (g, 3)
    atoms: NDArray[np.float32]
    cap: NDArray[np.float64]

    @staticmethod
    def over(problem: Problem, grid: Grid) -> Dictionary:
        points = grid.points
        atoms = atoms_at(problem, points)
        return Dictionary(grid, points, atoms, caps(problem, atoms))

    def under(self, problem: Problem, other: Problem) -> Dictionary:
        """The same positions for the same observations with other standard errors."""
        ratio = (problem.sigma / other.sigma).T[:, None].astype(np.float32)
        atoms = self.atoms * ratio
        return Dictionary(self.grid, self.points, atoms, caps(other, atoms))

    @cached_property
    def energies(self) -> NDArray[np.float32]:
        return np.square(self.atoms)

    def gains(self, left: Left) -> NDArray[np.float64]:
        """`gains_of` this grid's atoms."""
        return gains_of(self.atoms, self.energies, self.cap, left)

    def peaks(self, gains: NDArray, most: int) -> NDArray[np.intp]:
        """The ``most`` highest local maxima of the gains, best first: rows of ``points``."""
        field = gains.reshape(self.grid.shape)
        top = np.flatnonzero((gains > 0) & (field == maximum_filter(field, 3)).ravel())
        return top[np.argsort(-gains[top], kind="stable")][:most]


def atoms_at(problem: Problem, points: NDArray) -> NDArray[np.float32]:
    """S / sigma at (g, 3) points: (c, g, n)."""
    S = shaded(problem.surfels, points, problem.geometry)
    weight = (1 / problem.sigma).T[:, None].astype(np.float32)
    return S.astype(np.float32, copy=False) * weight


def caps(problem: Problem, atoms: NDArray) -> NDArray[np.float64]:
    """D(p) = min B / S with B raised by `MARGIN` standard errors: (g, c)."""
    top = (np.maximum(problem.radiance / problem.sigma, 0) + MARGIN).T.astype(np.float32)
    with np.errstate(divide="ignore"):
        return np.stack([(B / a).min(axis=1) for B, a in zip(top, atoms, strict=True)], axis=1)


@dataclass(frozen=True, eq=False)
class Left:
    """What is left for one more light, once those that are there have adapted to it.

    Args:
        residual: (c, n) in standard errors, without what the others can take up, times weight.
        weight: (c, n) in 0..1, the weight that a robust loss gives each residual.
        basis: for each channel (n, u): what the others span, times the root of the weight.
    """

    residual: NDArray[np.float32]
    weight: NDArray[np.float32]
    basis: tuple[NDArray[np.float32], ...]

    @staticmethod
    def beside(columns: NDArray, residual: NDArray, weight: NDArray) -> Left:
        """From what is refitted with it, (n, k, c), the residual and its weight, each (n, c)."""
        left, spans = [], []
        for c, (z, w) in enumerate(zip(residual.T, weight.T, strict=True)):
            root = np.sqrt(w)
            present = columns[:, (columns[:, :, c] != 0).any(axis=0), c] * root[:, None]
            basis, _ = np.linalg.qr(present)
            left.append((z * root - basis @ (basis.T @ (z * root))) * root)
            spans.append((basis * root[:, None]).astype(np.float32))
        return Left(np.array(left, np.float32), weight.T.astype(np.float32), tuple(spans))


def gains_of(atoms: NDArray, energies: NDArray, cap: NDArray, left: Left) -> NDArray[np.float64]:
    """How much chi-square one more light would gain at each position, all others refitted.

    Args:
        atoms, energies: (c, g, n) S / sigma and its square.
        cap: (g, c) the brightest that a light can be.
        left: what is left to explain.

    Returns (g,): the sum over channels of 2 a I - b I^2 at I = min(a / b, D), where a > 0 is the
    correlation with the residual and b what is left of the atom's energy beside the present
    lights'.
    """
    total = np.zeros(atoms.shape[1])
    for c in range(len(atoms)):
        a = atoms[c] @ left.residual[c]
        b = energies[c] @ left.weight[c]
        floor = ENERGY_LEFT * b
        if left.basis[c].shape[1]:
            b = b - np.square(atoms[c] @ left.basis[c]).sum(axis=1)
        good = (a > 0) & (b > floor) & (floor > 0)
        a, b = np.where(good, a, 0.0), np.where(good, b, 1.0)
        I = np.minimum(a / b, cap[:, c])
        total += 2 * a * I - b * I * I
    return total


def unbounded_gains(atoms: NDArray, left: Left) -> NDArray[np.float64]:
    """`gains_of` atoms (c, g, n) where nothing says how bright a light can be.

    D(p) caps a light by its darkest observation: one that lies in a shadow which the geometry
    does not have makes the true light impossible.
    """
    free = np.full((atoms.shape[1], len(atoms)), np.inf)
    return gains_of(atoms, np.square(atoms), free, left)


ENERGY_LEFT = 1e-3
"""Atoms that the present lights explain but for this share are those lights again."""

MARGIN = 3.0
"""Standard errors on top of B before D caps a candidate: one in a thousand B is lower still."""
