"""To first order: whether lights shine alike in all directions, beside all that they can adapt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lightloc.diagnosis.departure import Array, Evidence
from lightloc.diagnosis.joint import left, lost, whitened
from lightloc.diagnosis.lamps import seen_from
from lightloc.given import PointLights

NEARLY, TYPICAL = 1.15, 0.95
"""Times the points' own cost that fewer lamps may leave to first order; share of the residuals that
the loss takes as they are for that."""


@dataclass(frozen=True, eq=False)
class Score:
    """To first order, what a dipole of each light's emission would gain.

    Parameters
    ----------
    basis : (rows, m) array
        An orthonormal basis of all that the lights can adapt, under the weights of the fit.
    left : (rows,) array
        The residuals under these weights.
    root : (n, c) array
        The roots of the weights.
    fisher : (k d, k d) array
        Information on the dipoles beside the lights.
    slope : (k d,) array
        The residuals' correlation with them.
    d : int
        Free axes.
    """

    basis: Array
    left: Array
    root: Array
    fisher: Array
    slope: Array
    d: int

    @staticmethod
    def of(evidence: Evidence, lights: PointLights, z: Array, weight: Array) -> Score:
        """At lights that leave (n, c) residuals z."""
        problem, lit, root = evidence.problem, evidence.lit(lights), np.sqrt(weight)
        axes, (n, c) = problem.axes, problem.radiance.shape
        J = (whitened(evidence, lit.plain) * root[:, :, None]).reshape(n * c, -1)
        size = np.linalg.norm(J, axis=0)
        basis = np.linalg.qr(J[:, size > 0] / size[size > 0])[0]
        w = seen_from(problem, lights.positions)[0][:, :, axes]
        own = (lit.brought[0] * lights.intensities).swapaxes(1, 2)  # (n, c, k)
        D = own[..., None] * w[:, None] * (root / problem.sigma)[:, :, None, None]
        D = D.reshape(n * c, -1)
        D = D - basis @ (basis.T @ D)
        rest = (z * root).ravel()
        rest = rest - basis @ (basis.T @ rest)
        return Score(basis, rest, root, D.T @ D, D.T @ rest, len(axes))

    @property
    def groups(self) -> list[tuple[int, ...]]:
        """Each light by itself, and all of several alike."""
        k = len(self.slope) // self.d
        return [(i,) for i in range(k)] + [tuple(range(k))] * (k > 1)

    def of_group(self, which: tuple[int, ...]) -> tuple[Array, Array]:
        """Information (d, d) and slope (d,) of one dipole that these lights share."""
        d = self.d
        rows = [np.arange(i * d, i * d + d) for i in which]
        F = sum((self.fisher[np.ix_(a, b)] for a in rows for b in rows), np.zeros((d, d)))
        return F, sum((self.slope[a] for a in rows), np.zeros(d))

    def lost(self, which: tuple[int, ...], axes: Array) -> Array:
        """Chi-square (a,) that lamps cos^1 about (a, d) axes would lose, to first order."""
        F, s = self.of_group(which)
        return np.asarray(np.einsum("ax,xy,ay->a", axes, F, axes) - 2 * axes @ s)

    def gain(self, which: tuple[int, ...]) -> float:
        """Chi-square that any dipole would gain, to first order."""
        F, s = self.of_group(which)
        return float(s @ np.linalg.lstsq(F, s, rcond=1e-10)[0])


def seen_as_fewer(evidence: Evidence, fewer: PointLights, cost: float) -> bool:
    """Whether fewer lights that are lamps may explain as well as points that leave ``cost``.

    To first order: with a dipole and a quadrupole of each light's emission.
    """
    lit, problem = evidence.lit(fewer), evidence.problem
    z = left(evidence, lit.plain.B)
    _, weight = lost(evidence, z, float(np.quantile(np.abs(z), TYPICAL)))
    w = seen_from(problem, fewer.positions)[0][:, :, problem.axes]
    a, b = np.triu_indices(len(problem.axes))
    poles = np.concatenate([w, w[:, :, a] * w[:, :, b]], axis=2)
    own = (lit.brought[0] * fewer.intensities).swapaxes(1, 2) / problem.sigma[:, :, None]
    D = (own[..., None] * poles[:, None]).reshape(*z.shape, -1)
    root = np.sqrt(weight)
    J = np.concatenate([whitened(evidence, lit.plain), D], axis=2) * root[:, :, None]
    J = J.reshape(z.size, -1)
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    rest = (z * root).ravel()
    step = np.linalg.lstsq(J / size, rest, rcond=1e-10)[0]
    return float(np.square(rest - J / size @ step).sum()) < NEARLY * max(cost, 1e-300)
