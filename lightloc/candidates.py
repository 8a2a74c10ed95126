"""Where a light may be missing: gains in chi-square over a coarse grid of positions.

S(q, p) is computed once for every coarse position and a sample of the observations; each later
question about the whole room is then one product of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.fields import Grid
from lightloc.shading import shading
from lightloc.solve import Problem


@dataclass(frozen=True)
class Dictionary:
    """S(q, p) / sigma for all positions of a grid: ``atoms`` (g, n, c) float32."""

    grid: Grid
    points: NDArray[np.float64]  # (g, 3)
    atoms: NDArray[np.float32]

    @staticmethod
    def over(problem: Problem, grid: Grid) -> Dictionary:
        points = grid.points
        S = shading(problem.surfels, points, problem.geometry)
        atoms = np.ascontiguousarray(S.transpose(1, 0, 2) / problem.sigma, dtype=np.float32)
        return Dictionary(grid, points, atoms)

    def gains(self, residual: NDArray, columns: NDArray, weight: NDArray) -> NDArray[np.float64]:
        """How much chi-square one more light would gain at each position, all others refitted.

        Args:
            residual: (n, c) in standard errors, orthogonal to the present lights.
            columns: (n, k, c) the present lights' S / sigma.
            weight: (n, c) in 0..1, the weight that a robust loss gives each residual.

        Returns (g,): sum over channels of a^2 / b for a > 0, where a is the correlation with the
        residual and b what is left of the atom's energy beside the present lights'.
        """
        total = np.zeros(len(self.points))
        for c in range(residual.shape[1]):
            atoms = self.atoms[:, :, c]
            root = np.sqrt(weight[:, c])
            a = atoms @ (residual[:, c] * weight[:, c]).astype(np.float32)
            b = (atoms * atoms) @ weight[:, c].astype(np.float32)
            floor = ENERGY_LEFT * b
            if columns.shape[1]:
                basis, _ = np.linalg.qr(columns[:, :, c] * root[:, None])
                b = b - np.square(atoms @ (basis * root[:, None]).astype(np.float32)).sum(axis=1)
            total += np.where(
                (a > 0) & (b > floor) & (floor > 0), a * a / np.maximum(b, floor + 1e-30), 0
            )
        return total

    def peaks(self, gains: NDArray, most: int) -> NDArray[np.float64]:
        """The ``most`` highest local maxima of the gains: (m, 3) positions, best first."""
        field = np.pad(gains.reshape(self.grid.shape), 1, constant_values=-np.inf)
        around = np.full(self.grid.shape, -np.inf)
        nx, ny, nz = self.grid.shape
        for dx in range(3):
            for dy in range(3):
                for dz in range(3):
                    if (dx, dy, dz) != (1, 1, 1):
                        shifted = field[dx : dx + nx, dy : dy + ny, dz : dz + nz]
                        around = np.maximum(around, shifted)
        top = np.flatnonzero((gains > 0) & (gains >= around.ravel()))
        return self.points[top[np.argsort(-gains[top], kind="stable")][:most]]


ENERGY_LEFT = 1e-3
"""Atoms that the present lights explain but for this share are those lights again."""
