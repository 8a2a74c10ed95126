"""Lights and a departure fitted together, robustly, and what a first step promises.

Unknowns are the free coordinates of each light, then the intensities, then the departure's own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.deadline import in_time
from lightloc.diagnosis.departure import Array, Departure, Evidence, Lit, Modelled
from lightloc.fit import cauchy, covariance_of
from lightloc.given import PointLights

WIDTHS, STEPS = 6, 12
"""Times that the loss is narrowed, and steps at each width."""

TYPICAL = 0.95
"""Share of the residuals that the loss takes as they are to begin with."""

DAMPING, SOFTER, HARDER = 1e-2, 0.2, 6.0
"""Of the normal equations' diagonal: to begin with, after a step that helps, after one that does
not."""

FALL = 1e-4
"""Share of chi-square by which a step must lower it for another to follow."""

LEAST = 1e-6
"""Standard errors, in the root of their mean square, below which a derivative tells nothing."""

RIDGE = 1e-8
"""Of the normal equations' diagonal: what two unknowns do alike has no first step."""

TOUCHING = 1e-6
"""Of the longest side, that lights keep from the border: S is infinite on an observation."""


@dataclass(frozen=True, eq=False)
class Joint:
    """Lights and a departure that were fitted together.

    Parameters
    ----------
    lights
        The k lights.
    departure
        What else was fitted; None where nothing was.
    unknowns : (u,) array
        Its unknowns.
    residual : (n, c) array
        (B - model) / sigma.
    cost : float
        The robust chi-square.
    """

    lights: PointLights
    departure: Departure | None
    unknowns: Array
    residual: Array
    cost: float


def modelled(
    evidence: Evidence, lights: PointLights, departure: Departure | None, u: Array
) -> Modelled:
    """B of lights, with a departure or without."""
    lit = evidence.lit(lights)
    return departure.model(lit, u) if departure else lit.plain


def left(evidence: Evidence, B: Array) -> Array:
    """(n, c) residuals in standard errors, with as much ambient light as explains them best."""
    problem = evidence.problem
    return problem.without_ambient((problem.radiance - B) / problem.sigma)


def lost(evidence: Evidence, z: Array, width: float = 0.0) -> tuple[float, Array]:
    """The robust chi-square of (n, c) residuals and the weight of each: the one place of the loss.

    ``width``, where larger, stands for the standard errors beyond which a residual counts less.
    """
    loss, weight = cauchy(z, max(width, evidence.criterion.likelihood.scale))
    return float(loss.sum()), weight


def whitened(evidence: Evidence, one: Modelled) -> Array:
    """(n, c, m + u) all derivatives in standard errors, the ambient term taken out."""
    J = np.concatenate([one.by_lights, one.by_unknowns], axis=2)
    J = J / evidence.problem.sigma[:, :, None]
    if evidence.problem.nuisance is not None:
        across = evidence.problem.nuisance.T[:, :, None]
        J = J - across * (across * J).sum(axis=0)
    return J


@dataclass(frozen=True, eq=False)
class Ground:
    """What lights leave, and all that they can adapt: what departures are asked beside.

    Parameters
    ----------
    lit
        The lights.
    cost
        The robust chi-square that they leave.
    root : (n, c) array
        Roots of the weights.
    rest : (n c,) array
        What is left once the lights have adapted, times these.
    basis : (n c, r) array
        What they span, times these.
    """

    lit: Lit
    cost: float
    root: Array
    rest: Array
    basis: Array

    @staticmethod
    def of(lit: Lit, one: Modelled) -> Ground:
        """Of lights as they are, and of a departure's own unknowns."""
        evidence = lit.evidence
        z = left(evidence, one.B)
        cost, weight = lost(evidence, z)
        root = np.sqrt(weight)
        J = (whitened(evidence, one) * root[:, :, None]).reshape(z.size, -1)
        size = np.linalg.norm(J, axis=0)
        basis = np.linalg.qr(J[:, size > 0] / size[size > 0])[0]
        own = (z * root).ravel()
        return Ground(lit, cost, root, own - basis @ (basis.T @ own), basis)

    def beside(self, columns: Array) -> Array:
        """(n, c, u) derivatives of B, as (n c, u) that the lights cannot take up."""
        problem = self.lit.evidence.problem
        J = columns / problem.sigma[:, :, None]
        if problem.nuisance is not None:
            across = problem.nuisance.T[:, :, None]
            J = J - across * (across * J).sum(axis=0)
        J = (J * self.root[:, :, None]).reshape(self.rest.size, -1)
        return np.asarray(J - self.basis @ (self.basis.T @ J))

    def promised(self, columns: Array) -> float:
        """The robust chi-square that a first step would leave: the score test of a departure."""
        J = self.beside(columns)
        size = np.sqrt(np.square(J).sum(axis=0))
        J = J[:, size > LEAST * np.sqrt(self.rest.size)]
        if not J.size:
            return self.cost
        Q, _ = np.linalg.qr(J)
        return self.cost - float(np.square(Q.T @ self.rest).sum())


def ground_of(lit: Lit) -> Ground:
    """The ground under lights, computed once."""
    if "ground" not in lit.memo:
        lit.memo["ground"] = Ground.of(lit, lit.plain)
    ground: Ground = lit.memo["ground"]
    return ground


def ahead(evidence: Evidence, one: Modelled) -> float:
    """The robust chi-square that a first step would leave from a start that is far."""
    z = left(evidence, one.B)
    _, weight = lost(evidence, z, float(np.quantile(np.abs(z), TYPICAL)))
    J = whitened(evidence, one).reshape(z.size, -1)
    A, g = (J * weight.reshape(-1, 1)).T @ J, J.T @ (weight * z).ravel()
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    A = A / np.outer(size, size) + RIDGE * np.eye(len(A))
    step = np.linalg.solve(A, g / size) / size
    return lost(evidence, z - (J @ step).reshape(z.shape))[0]


def fitted(
    evidence: Evidence,
    lights: PointLights,
    departure: Departure | None,
    u: Array,
    steps: int = STEPS,
    fall: float = FALL,
) -> Joint:
    """Fit both, from lights and unknowns to begin with; the loss narrows as residuals fall."""
    in_time()
    x, limits = packed(evidence, lights, u), bounds(evidence, lights, departure, len(u))
    width, least = np.inf, evidence.criterion.likelihood.scale
    for _ in range(WIDTHS):
        z = left(evidence, at(evidence, lights, departure, x).B)
        typical = float(np.quantile(np.abs(z), TYPICAL))
        width = max(least, min(width / 2, typical))
        x = descended(evidence, lights, departure, x, limits, width, steps, fall)
        if width <= least:
            break
    there, u = unpacked(evidence, lights, x)
    z = left(evidence, modelled(evidence, there, departure, u).B)
    return Joint(there, departure, u, z, lost(evidence, z)[0])


def descended(
    evidence: Evidence,
    lights: PointLights,
    departure: Departure | None,
    x: Array,
    limits: tuple[Array, Array],
    width: float,
    steps: int,
    fall: float,
) -> Array:
    """Levenberg-Marquardt at one width of the loss, within limits."""
    low, high = limits
    damping, here = DAMPING, at(evidence, lights, departure, x)
    z = left(evidence, here.B)
    cost, weight = lost(evidence, z, width)
    for _ in range(steps):
        J = whitened(evidence, here).reshape(z.size, -1)
        A = (J * weight.reshape(-1, 1)).T @ J
        g = J.T @ (weight * z).ravel()
        scale = np.maximum(np.diag(A), np.finfo(float).tiny)
        held = ((x <= low) & (g < 0)) | ((x >= high) & (g > 0)) | (np.diag(A) <= 0)
        free = np.flatnonzero(~held)
        before = cost
        while free.size and damping < 1e8:
            size = np.sqrt(scale[free])
            system = A[np.ix_(free, free)] / np.outer(size, size)
            step = np.zeros_like(x)
            system[np.diag_indices_from(system)] += damping
            step[free] = np.linalg.solve(system, g[free] / size) / size
            trial = np.clip(x + step, low, high)
            there = at(evidence, lights, departure, trial)
            z = left(evidence, there.B)
            now, heavy = lost(evidence, z, width)
            if now < cost:
                x, here, cost, weight, damping = trial, there, now, heavy, damping * SOFTER
                break
            damping *= HARDER
        if not before - cost > fall * before:
            break
        z = left(evidence, here.B)
    return x


def covariance(evidence: Evidence, joint: Joint) -> Array:
    """(m + u, m + u) of the unknowns, from the Fisher information with the weights of the fit."""
    one = modelled(evidence, joint.lights, joint.departure, joint.unknowns)
    _, weight = lost(evidence, joint.residual)
    J = whitened(evidence, one) * np.sqrt(weight)[:, :, None]
    return covariance_of(J.reshape(weight.size, -1))


def at(evidence: Evidence, lights: PointLights, departure: Departure | None, x: Array) -> Modelled:
    """B of the unknowns x."""
    return modelled(evidence, *_with(evidence, lights, departure, x))


def _with(
    evidence: Evidence, lights: PointLights, departure: Departure | None, x: Array
) -> tuple[PointLights, Departure | None, Array]:
    there, u = unpacked(evidence, lights, x)
    return there, departure, u


def packed(evidence: Evidence, lights: PointLights, u: Array) -> Array:
    """All unknowns in a row."""
    coordinates = lights.positions[:, evidence.problem.axes].ravel()
    return np.concatenate([coordinates, lights.intensities.ravel(), u])


def unpacked(evidence: Evidence, lights: PointLights, x: Array) -> tuple[PointLights, Array]:
    """And back; ``lights`` say how many there are, and where they lie along axes that are fixed."""
    (k, c), axes = lights.intensities.shape, evidence.problem.axes
    m, d = k * (len(axes) + c), len(axes)
    positions = lights.positions.copy()
    positions[:, axes] = x[: k * d].reshape(k, d)
    return PointLights(positions, x[k * d : m].reshape(k, c)), x[m:]


def bounds(
    evidence: Evidence, lights: PointLights, departure: Departure | None, u: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The least and the largest of each unknown: lights stay within the region."""
    (k, c), problem = lights.intensities.shape, evidence.problem
    edge = TOUCHING * problem.size
    inner = problem.bounds[:, problem.axes] + np.array([[edge], [-edge]])
    own = departure.limits(evidence.lit(lights)) if departure else np.zeros((2, u))
    dark, bright = np.zeros(k * c), np.full(k * c, np.inf)
    return (
        np.concatenate([np.tile(inner[0], k), dark, own[0]]),
        np.concatenate([np.tile(inner[1], k), bright, own[1]]),
    )
