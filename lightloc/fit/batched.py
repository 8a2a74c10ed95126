"""Many hypotheses at once: what each leaves of B, and the normal equations of its next step.

Unknowns x are all free coordinates, light by light, then all intensities or their logarithms.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lightloc.fit.loss import cauchy
from lightloc.fit.problem import Problem
from lightloc.optics import shadows, slopes

MARGIN = 1e-3  # of the longest side, that lights keep from the region's border until they are near
TOUCHING = 1e-6  # the same where they are near: S is infinite on an observation itself
BRIGHTER = 2.0  # most that the logarithm of an intensity changes in one step
DARKEST = 1e-9  # of the brightest: a start is given no less
AHEAD = 0.1  # of a step: how far ahead residuals are looked at, to see how they bend along it
REUSED = 0.5  # of the blur: a light that moved no further keeps its shadows, by their slope
TINY = np.finfo(float).tiny


class Unknown(Enum):
    """What stands for an intensity among the unknowns."""

    LOGARITHM = "far from the end: a dark light comes back"
    POSITIVE = "near it: the model is linear in it; held at 0"
    FREE = "the published method's: of either sign"


@dataclass(frozen=True, eq=False)
class Tie:
    """Lights that move together: what is unknown of them is linear in fewer unknowns.

    Parameters
    ----------
    matrix : (all coordinates and intensities, unknowns) array
        The first of these unknowns are coordinates within the region, then intensities, then what
        is free.
    lights
        How many lights have those coordinates and intensities.
    """

    matrix: NDArray[np.floating]
    lights: int


@dataclass(frozen=True, eq=False)
class Indirect:
    """What a light of intensity 1 brings by way of the surfaces, held while lights move.

    Parameters
    ----------
    around : (n, k, c) array
        That light, m^-2 sr^-1.
    noise : (k, c) array
        What the error of ``around`` adds to the normal equations' diagonal.
    """

    around: NDArray[np.floating]
    noise: NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Place:
    """m points of the search with what a step needs: A = J^T J and g = J^T r.

    In 64 bits a QR of the whitened J, too: J^T J squares the condition number.
    Shadows are kept with the positions where they were taken: V, its slope, and those positions.
    """

    x: NDArray[np.float64]  # (m, u)
    positions: NDArray[np.float64]  # (m, k, 3)
    intensities: NDArray[np.float64]  # (m, k, c)
    chi2: NDArray[np.float64]  # (m,)
    A: NDArray[np.float64]  # (m, u, u)
    g: NDArray[np.float64]  # (m, u)
    Q: NDArray[np.floating]  # (m, c n, u), times the root of each weight; empty in 32 bits
    R: NDArray[np.floating]  # (m, u, u + 1), Q^T r in the last column; empty in 32 bits
    seen: NDArray[np.floating]  # (m, k, n), V; of no length where nothing occludes
    turn: NDArray[np.floating]  # (m, d, k, n), its slope; of no length where edges are hard
    taken: NDArray[np.float64]  # (m, k, 3)

    def rows(self, some: NDArray[np.intp]) -> Place:
        """Some of them."""
        return Place(*(getattr(self, one.name)[some] for one in fields(self)))

    def replaced(self, some: NDArray[np.intp], by: Place) -> Place:
        """These with some replaced."""
        if len(some) == len(self.chi2):
            return by
        result = {}
        for one in fields(self):
            result[one.name] = getattr(self, one.name).copy()
            result[one.name][some] = getattr(by, one.name)
        return Place(**result)


@dataclass(frozen=True, eq=False)
class Model:
    """B of k lights in every hypothesis.

    Parameters
    ----------
    problem
        What is fitted.
    k
        Number of lights.
    blur
        Shadows' edges are this wide, in the unit of length.
    unknown
        What stands for an intensity.
    tie, indirect
        As in `levenberg.descend`.
    """

    problem: Problem
    k: int
    blur: float
    unknown: Unknown
    tie: Tie | None = None
    indirect: Indirect | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """Lights, free coordinates of each, channels."""
        return self.k, len(self.problem.axes), self.problem.radiance.shape[1]

    def begun(
        self,
        positions: NDArray[np.float64],
        intensities: NDArray[np.float64],
        loss: NDArray[np.float64],
    ) -> Place:
        """The starts (m, k, 3), (m, k, c), within their limits."""
        k, d, _ = self.shape
        m, n = len(positions), self.problem.surfels.n
        if self.unknown is Unknown.LOGARITHM:
            least = DARKEST * intensities.max(axis=(1, 2), keepdims=True, initial=0.0)
            intensities = np.log(np.maximum(intensities, np.maximum(least, TINY)))
        coordinates = positions[:, :, self.problem.axes].reshape(m, -1)
        x = np.concatenate([coordinates, intensities.reshape(m, -1)], axis=1)
        if self.tie:
            x = np.linalg.lstsq(self.tie.matrix, x.T)[0].T
        occluded = self.problem.geometry is not None or not self.problem.surfels.flat
        seen = np.zeros((m, k, n if occluded else 0), np.float32)
        turn = np.zeros((m, d, k, n if self.blur else 0), np.float32)
        taken = np.full((m, k, 3), np.inf)
        return self.place(np.clip(x, *self.limits), loss, seen, turn, taken)

    @cached_property
    def limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The least and the largest of each unknown: (u,), (u,)."""
        k, d, c = self.shape
        u, k = (self.tie.matrix.shape[1], self.tie.lights) if self.tie else (k * (d + c), k)
        low, high = np.full(u, -np.inf), np.full(u, np.inf)
        margin = TOUCHING if self.unknown is Unknown.POSITIVE else MARGIN
        edge = margin * self.problem.size
        inner = self.problem.bounds[:, self.problem.axes]
        low[: k * d], high[: k * d] = np.tile(inner[0] + edge, k), np.tile(inner[1] - edge, k)
        if self.unknown is Unknown.POSITIVE:
            low[k * d : k * (d + c)] = 0.0
        return low, high

    def lights(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions (m, k, 3) and intensities (m, k, c)."""
        k, d, c = self.shape
        x = x @ self.tie.matrix.T if self.tie else x
        held = self.problem.places
        at = self.problem.bounds[0] if held is None else held
        positions = np.broadcast_to(at, (len(x), k, 3)).copy()
        positions[:, :, self.problem.axes] = x[:, : k * d].reshape(len(x), k, d)
        intensities = x[:, k * d :].reshape(-1, k, c)
        return positions, np.exp(intensities) if self.logarithmic else intensities

    @property
    def is_exact(self) -> bool:
        """Whether a step is solved without squaring the condition number."""
        return self.problem.surfels.double and not self.indirect

    @property
    def logarithmic(self) -> bool:
        return self.unknown is Unknown.LOGARITHM

    def shortened(self, step: NDArray[np.float64]) -> NDArray[np.float64]:
        """A step (m, u) that changes no intensity's logarithm by more than `BRIGHTER`."""
        k, d, _ = self.shape
        if self.logarithmic:
            step = step.copy()
            step[:, k * d :] = np.clip(step[:, k * d :], -BRIGHTER, BRIGHTER)
        return step

    def moved(self, place: Place, step: NDArray[np.float64], loss: NDArray[np.float64]) -> Place:
        """A step (m, u) on, within the limits."""
        x = np.clip(place.x + self.shortened(step), *self.limits)
        return self.place(x, loss, place.seen.copy(), place.turn.copy(), place.taken.copy())

    def place(
        self,
        x: NDArray[np.float64],
        loss: NDArray[np.float64],
        seen: NDArray[np.floating],
        turn: NDArray[np.floating],
        taken: NDArray[np.float64],
    ) -> Place:
        """What is left at x, and the normal equations; shadows are brought up to date."""
        problem, (k, d, c) = self.problem, self.shape
        positions, intensities = self.lights(x)
        m, n = len(x), problem.surfels.n
        S, gradient = slopes(problem.surfels, positions.reshape(m * k, 3), problem.axes)
        S = S.reshape(-1, m, k, n)
        gradient = gradient.reshape(len(S), d, m, k, n)
        if seen.shape[2]:
            V = self.shadowed(positions, seen, turn, taken)
            gradient = gradient * V
            if self.blur:
                gradient = gradient + S[:, None] * turn.swapaxes(0, 1)
            S = S * V
        A, g = np.zeros((m, k * (d + c), k * (d + c))), np.zeros((m, k * (d + c)))
        chi2, exact, plain = np.zeros(m), self.is_exact, bool(np.isinf(loss).all())
        whole = np.zeros((m, c * n if exact else 0, k * (d + c)))
        half, left = (np.zeros((m, c * n if exact else 0)) for _ in range(2))
        for channel in range(c):
            own = min(channel, len(S) - 1)
            weight = 1 / problem.sigma[:, channel]
            I = intensities[:, :, channel, None]
            bright = S[own]
            if self.indirect:
                bright = bright + self.indirect.around[:, :, channel].T.astype(S.dtype)
            bright = bright * weight.astype(S.dtype)
            lit = bright * I.astype(S.dtype)
            r = self.left(lit, channel)
            J = np.empty((m, k * (d + 1), n), S.dtype)
            scale = (I * weight).astype(S.dtype)
            for axis in range(d):
                np.multiply(gradient[own, axis], scale, out=J[:, axis : k * d : d])
            J[:, k * d :] = lit if self.logarithmic else bright
            if problem.nuisance is not None:
                u = problem.nuisance[channel]
                J = J - (J @ u)[:, :, None].astype(S.dtype) * u.astype(S.dtype)
            lost, trust = cauchy(r, loss[:, None])
            weighed = J if plain else J * trust[:, None, :].astype(S.dtype)
            columns = np.concatenate([np.arange(k * d), k * d + np.arange(k) * c + channel])
            A[:, columns[:, None], columns] += weighed @ J.transpose(0, 2, 1)
            g[:, columns] += (weighed @ r[:, :, None].astype(S.dtype))[:, :, 0]
            chi2 += lost.sum(axis=1)
            if exact:
                rows = np.arange(channel * n, channel * n + n)
                half[:, rows] = np.sqrt(trust)
                whole[:, rows[:, None], columns] = (J * half[:, None, rows]).swapaxes(1, 2)
                left[:, rows] = r
        if self.indirect:
            noise, bright = self.indirect.noise.ravel(), intensities.reshape(m, -1)
            A[:, range(k * d, k * (d + c)), range(k * d, k * (d + c))] -= noise
            g[:, k * d :] -= noise * bright
            chi2 -= np.square(bright) @ noise
        if self.tie:
            A, g = self.tie.matrix.T @ A @ self.tie.matrix, g @ self.tie.matrix
            whole = whole @ self.tie.matrix
        low, high = self.limits
        held = ((x <= low) & (g > 0)) | ((x >= high) & (g < 0))  # what would go beyond its limit
        if held.any():
            g[held] = 0
            A *= np.where(held[:, :, None] | held[:, None, :], np.eye(g.shape[1]), 1.0)
            whole *= ~held[:, None]
        Q, R = np.linalg.qr(whole) if exact else (whole, whole)
        Q = Q * half[:, :, None]
        R = np.concatenate([R, (left[:, None] @ Q).swapaxes(1, 2)], axis=2) if exact else R
        return Place(x, positions, intensities, chi2, A, g, Q, R, seen, turn, taken)

    def left(self, lit: NDArray[np.floating], channel: int) -> NDArray[np.floating]:
        """(m, n) residuals in standard errors, of what (m, k, n) each light brings in these."""
        weight = 1 / self.problem.sigma[:, channel]
        r = lit.sum(axis=1, dtype=float) - self.problem.radiance[:, channel] * weight
        if self.problem.nuisance is None:
            return r
        u = self.problem.nuisance[channel]
        return r - (r @ u)[:, None] * u

    def bent(self, place: Place, step: NDArray[np.float64]) -> NDArray[np.floating]:
        """Q^T of how residuals bend along a step (m, u), their second derivative: (m, u, 1)."""
        k, _, c = self.shape
        step = self.shortened(step)
        positions, intensities = self.lights(place.x + AHEAD * step)
        m, n = len(positions), self.problem.surfels.n
        S, _ = slopes(self.problem.surfels, positions.reshape(m * k, 3), self.problem.axes)
        S = S.reshape(-1, m, k, n) * (place.seen if place.seen.shape[2] else 1.0)
        r = []
        for channel in range(c):
            bright = S[min(channel, len(S) - 1)] / self.problem.sigma[:, channel]
            r.append(self.left(bright * intensities[:, :, channel, None], channel))
        u = step.shape[1]
        R, b = place.R[:, :, :u], place.R[:, :, u:]
        ahead = (np.concatenate(r, axis=1)[:, None] @ place.Q).swapaxes(1, 2)
        return 2 / AHEAD * ((ahead - b) / AHEAD - R @ step[:, :, None])

    def shadowed(
        self,
        positions: NDArray[np.float64],
        seen: NDArray[np.floating],
        turn: NDArray[np.floating],
        taken: NDArray[np.float64],
    ) -> NDArray[np.floating]:
        """V (m, k, n); ``seen``, its slope, and where taken, anew for lights that moved too far."""
        problem, axes = self.problem, self.problem.axes
        off = positions - taken
        far = ~(np.linalg.norm(off, axis=2) <= REUSED * self.blur)
        if far.any():
            V, slope = shadows(problem.surfels, positions[far], problem.geometry, self.blur, axes)
            seen[far], taken[far], off[far] = V, positions[far], 0.0
            if slope is not None:
                turn.swapaxes(1, 2)[far] = slope.swapaxes(0, 1)
        if not self.blur:
            return seen
        step = off[:, :, axes].astype(np.float32)
        return np.clip(seen + np.einsum("mdkn,mkd->mkn", turn, step), 0, 1)
