"""Indirect light beyond footnote 1: rendered for the lights found so far, subtracted, and again.

With positions fixed, all light is linear in the intensities, B = sum I (S + H), where H is what a
light of intensity 1 brings by way of the surfaces. So intensities follow in one step from all of
B, and only positions need rounds: subtracting sum I H with intensities from the direct part alone
would overshoot wherever H is larger than S, as it is among metal walls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment, nnls

from lightloc.certainty import jacobian
from lightloc.geometry import Geometry
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.result import Localization, Reason, Step
from lightloc.shading import shading
from lightloc.solve import Problem
from lightloc.verdicts import Kind, Verdict

Indirect = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""From (k, 3) positions to H(q, p) and its standard error, each (n, k, c), m^-2 sr^-1."""

Search = Callable[[Observations, PointLights | None], Localization]
"""Finds lights in direct light, going on from those that are given, if any."""

MOST_ROUNDS = 8
"""Metal rooms with eight lights settle in three to five (measured)."""

SETTLED = 0.3
"""Standard errors that no light may have moved in the last round."""

OUTLIER = 5.0
"""Standard errors beyond which a residual counts less and less, as in `Options.outlier`."""

REFITS = 4
"""The error of the rendering and the weights depend on the intensities: settled after three."""


@dataclass(frozen=True, eq=False)
class Split:
    """B(q) as the light of some lights: straight from them, and by way of the surfaces.

    Args:
        straight, around: (n, k, c) S and H of each light at intensity 1, m^-2 sr^-1.
        error: (n, k, c) standard error of ``around``, independent from light to light.
    """

    q: Observations
    straight: NDArray[np.float64]
    around: NDArray[np.float64]
    error: NDArray[np.float64]

    def sigma(self, intensities: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, c) standard error of B less the rendered part."""
        rendered = np.square(self.error * intensities).sum(axis=1)
        return np.sqrt(np.square(self.q.sigma) + rendered)

    def intensities(self) -> NDArray[np.float64]:
        """(k, c) by non-negative least squares from direct and indirect light together."""
        whole = self.straight + self.around
        _, k, channels = whole.shape
        I = np.zeros((k, channels))
        weight = np.ones_like(self.q.radiance)
        for _ in range(REFITS):
            scale = np.sqrt(weight) / _above_zero(self.sigma(I))
            for c in range(channels):
                A, b = whole[:, :, c] * scale[:, c, None], self.q.radiance[:, c] * scale[:, c]
                I[:, c] = nnls(A, b)[0]
            z = (self.q.radiance - (whole * I).sum(axis=1)) / _above_zero(self.sigma(I))
            weight = 1 / (1 + np.square(z / max(OUTLIER, np.median(np.abs(z)))))
        return I

    def direct(self, intensities: NDArray[np.float64]) -> Observations:
        """What is left for the search: B less the rendered part, with the error of both."""
        B = self.q.radiance - (self.around * intensities).sum(axis=1)
        return self.q.with_radiance(B, self.sigma(intensities), interreflected=False)


def rounds(
    q: Observations,
    first: Observations,
    geometry: Geometry | None,
    indirect: Indirect,
    search: Search,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Search, render the indirect light of what was found, subtract it, and search again.

    Args:
        q: with all interreflected light in them.
        first: q without it as far as that is known before any light is: by footnote 1.
        indirect: H(q, p) of the room, as `render.interreflected` gives it.
        search: the search for lights in direct light.
        watch: is told each round.

    Returns the last search's answer, with intensities and errors from direct and indirect light
    together. Where the lights still move after `MOST_ROUNDS`, a verdict says so.
    """
    found, lights = search(first, None), PointLights(np.zeros((0, 3)), np.zeros((0, q.channels)))
    history = list(found.history)
    for turn in range(MOST_ROUNDS):
        if not len(found.lights):
            return found
        order = order_like(found.lights, lights)
        lights = PointLights(found.lights.positions[order], found.lights.intensities[order])
        split = Split(q, shading(q, lights.positions, geometry), *indirect(lights.positions))
        I = split.intensities()
        lit = I.any(axis=1)
        found = search(split.direct(I), PointLights(lights.positions[lit], I[lit]))
        history += [Step(f"round {turn + 1}", len(found.lights), found.chi2), *found.history]
        watch(history[-1 - len(found.history)])
        if lit.all() and movement(found, lights) < SETTLED:
            return replace(whole(found, lights, split, geometry), history=tuple(history))
    return replace(unsettled(found), history=tuple(history))


def movement(found: Localization, before: PointLights) -> float:
    """How far the lights have moved, in standard errors; infinite where their number changed."""
    if len(found.lights) != len(before):
        return np.inf
    order = order_like(found.lights, before)
    step = np.linalg.norm(found.lights.positions[order] - before.positions, axis=1)
    error = np.linalg.norm(found.position_error[order], axis=1)
    return float((step / _above_zero(error)).max())


def order_like(lights: PointLights, like: PointLights) -> NDArray[np.intp]:
    """Indices of the lights in the order of those that they are nearest to; new ones last.

    >>> like = PointLights([[0, 0, 0], [5, 0, 0]], [1.0, 2.0])
    >>> order_like(PointLights([[9, 0, 0], [5.1, 0, 0], [0.1, 0, 0]], [3.0, 2.0, 1.0]), like)
    array([2, 1, 0])
    """
    apart = np.linalg.norm(like.positions[:, None] - lights.positions, axis=2)
    _, nearest = linear_sum_assignment(apart)
    others = np.setdiff1d(np.arange(len(lights)), nearest)
    return np.concatenate([nearest, others]).astype(np.intp)


def whole(
    found: Localization, lights: PointLights, split: Split, geometry: Geometry | None
) -> Localization:
    """The answer with intensities from all of B, and with the errors that they then have."""
    order = np.argsort(order_like(found.lights, lights))
    split = replace(split, around=split.around[:, order], error=split.error[:, order])
    split = replace(split, straight=shading(split.q, found.lights.positions, geometry))
    now = PointLights(found.lights.positions, split.intensities())
    rest = split.direct(now.intensities)
    problem = Problem.of(rest, found.sigma, geometry, rest.bounds, double=False)
    model = (split.straight * now.intensities).sum(axis=1)
    spread = covariance(problem, now, split.around)
    error = np.sqrt(np.maximum(np.diag(spread), 0))
    d, k = len(problem.axes), len(now)
    position = np.zeros((k, 3))
    position[:, problem.axes] = error[: k * d].reshape(k, d)
    return replace(
        found,
        lights=now,
        position_error=position,
        intensity_error=error[k * d :].reshape(now.intensities.shape),
        covariance=spread,
        direct=rest.radiance,
        residual=(rest.radiance - model) / found.sigma,
    )


def covariance(problem: Problem, lights: PointLights, around: NDArray) -> NDArray[np.float64]:
    """As `lightloc.cramer_rao`, with intensities told by the indirect light too.

    What it tells of positions is left out: it is smooth, and the search does not use it.
    """
    J = jacobian(problem, lights)
    (k, c), n = lights.intensities.shape, len(around)
    first = k * len(problem.axes)
    for channel in range(c):
        J[channel][:, first + np.arange(k) * c + channel] += (
            np.broadcast_to(around, (n, k, c))[:, :, channel] / problem.sigma[:, channel, None]
        )
    J = J.reshape(-1, J.shape[2])
    size = _above_zero(np.linalg.norm(J, axis=0))
    return np.linalg.pinv((J / size).T @ (J / size)) / np.outer(size, size)


def unsettled(found: Localization) -> Localization:
    """The answer where the lights still move: a verdict says so."""
    said = f"The lights still move after {MOST_ROUNDS} rounds of rendering their indirect light."
    verdict = Verdict(Kind.UNEXPLAINED, tuple(range(len(found.lights))), said)
    return replace(found, reason=Reason.NO_GAIN, verdicts=(verdict, *found.verdicts))


def _above_zero(value: NDArray) -> NDArray[np.float64]:
    return np.maximum(value, np.finfo(float).tiny)
