"""One way in which a model may be wrong: a few unknowns, and what B is with them.

A departure is asked at lights that may move, so it is a function of both: of what the lights bring
under the model as given, `Lit`, and of its own unknowns u. It answers with B and the derivatives
by which both are fitted together, `Modelled`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Kind
from lightloc.diagnosis.elsewhere import Elsewhere, sources
from lightloc.fit import Criterion, Problem
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics import Surfels, reflected_ambient, shadows, slopes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is seen, and how it is judged.

    Parameters
    ----------
    q : Observations
        The n observations that ``problem`` poses, with its radiance.
    problem : Problem
        B(q) with the errors as used.
    criterion : Criterion
        What decides.
    """

    q: Observations
    problem: Problem
    criterion: Criterion

    @property
    def geometry(self) -> Geometry | None:
        """What occludes."""
        return self.problem.geometry

    @cached_property
    def ambient(self) -> Array:
        """(n, c) what the same dim light from everywhere brings."""
        return reflected_ambient(self.problem.surfels, self.q.channels)

    @cached_property
    def elsewhere(self) -> Elsewhere:
        """What light from elsewhere brings."""
        return sources(self.q, self.problem)

    def lit(self, lights: PointLights) -> Lit:
        """What lights bring under the model as given."""
        return Lit(self, lights)

    def quieter(self, factor: float) -> Evidence:
        """The same with so many times the standard errors."""
        return replace(self, problem=replace(self.problem, sigma=self.problem.sigma * factor))

    def rows_of(self, some: NDArray[np.intp]) -> Evidence:
        """The same of some of the observations."""
        return replace(self, q=self.q.at(some), problem=self.problem.rows_of(some))


@dataclass(frozen=True, eq=False)
class Lit:
    """What k lights bring to n observations under the model as given.

    Parameters
    ----------
    evidence
        The observations.
    lights
        The lights.
    memo
        What several departures ask of the same lights, by their own keys.
    """

    evidence: Evidence
    lights: PointLights
    memo: dict[Any, Any] = field(default_factory=dict)

    @cached_property
    def seen(self) -> NDArray[np.floating]:
        """(k, n) whether nothing comes between."""
        problem = self.evidence.problem
        shape = len(self.lights), problem.surfels.n
        if not shape[0] or (problem.geometry is None and problem.surfels.flat):
            return np.ones(shape)
        return shadows(problem.surfels, self.lights.positions, problem.geometry)[0]

    def through(self, surfels: Surfels) -> tuple[Array, Array]:
        """S (n, k, c), and its slope (n, k, c, d), of these surfels with the shadows as they are.

        They are the observations with another material, or with other normals; so often as they
        may come one after the other.
        """
        problem, k = self.evidence.problem, len(self.lights)
        n, c, d = surfels.n, problem.radiance.shape[1], len(problem.axes)
        if not k:
            return np.zeros((n, 0, c)), np.zeros((n, 0, c, d))
        seen = np.tile(self.seen, n // problem.surfels.n)
        S, slope = slopes(surfels, self.lights.positions, problem.axes)
        S, slope = S * seen, slope * seen
        return (
            np.broadcast_to(S.transpose(2, 1, 0), (n, k, c)).astype(float),
            np.broadcast_to(slope.transpose(3, 2, 0, 1), (n, k, c, d)).astype(float),
        )

    @cached_property
    def brought(self) -> tuple[Array, Array]:
        """`through` the observations as they are given."""
        return self.through(self.evidence.problem.surfels)

    @cached_property
    def plain(self) -> Modelled:
        """B under the model as given: no departure, no unknown."""
        return self.summed(*self.brought)

    def summed(self, S: Array, slope: Array, by_unknowns: Array | None = None) -> Modelled:
        """B of the lights' own intensities times S (n, k, c), of which ``slope`` is the slope."""
        I = self.lights.intensities
        n, k, c, d = slope.shape
        by_lights = np.zeros((n, c, k * (d + c)))
        by_lights[:, :, : k * d] = (slope * I[:, :, None]).swapaxes(1, 2).reshape(n, c, k * d)
        for channel in range(c):
            by_lights[:, channel, k * d + np.arange(k) * c + channel] = S[:, :, channel]
        B = np.einsum("nkc,kc->nc", S, I) if k else np.zeros((n, c))
        return Modelled(B, by_lights, np.zeros((n, c, 0)) if by_unknowns is None else by_unknowns)


@dataclass(frozen=True, eq=False)
class Modelled:
    """B with its derivatives.

    Parameters
    ----------
    B : (n, c) array
        What the lights leave at the observations, in the unit of radiance.
    by_lights : (n, c, m) array
        By the free coordinates of each light, then by the intensities, m = k (d + c).
    by_unknowns : (n, c, u) array
        By the departure's own unknowns.
    """

    B: Array
    by_lights: Array
    by_unknowns: Array


@dataclass(frozen=True, eq=False)
class Departure:
    """One way in which the model may be wrong.

    Parameters
    ----------
    kind : Kind
        What sort of thing is wrong.
    name : str
        What is wrong, as a user reads it: "the albedo of floor".
    model : callable
        B with its derivatives, of what k lights bring (`Lit`) and of the (u,) unknowns.
    columns : callable
        The derivatives (n, c, u) alone, at unknowns at which the model is as given.
    starts : callable
        Where the unknowns may begin, of what the lights bring: (s, u).
    said : callable
        What the (u,) values and their standard errors mean, as a user reads it: "x 1.30 ± 0.01".
    trial : str
        What a user may do about it: a clause that follows "try".
    limits : callable
        The least and the largest of each unknown of k lights: (2, u).
    none : int
        How many of the starts, the first, leave the model as it is given.
    rank : int
        How many unknowns it is charged for; as many as it has where 0.
    kept : callable
        The unknowns where only some lights are kept, by their (j,) indices: all of them where no
        unknown belongs to a light.
    more : callable
        The unknowns of k lights with those of one more: as they are where none belongs to a light.
    width : callable, optional
        How wide the unknowns make each of the lights, (k,); points where None.
    aside : (n,) array of bool, optional
        Observations that it leaves out; none where None.
    """

    kind: Kind
    name: str
    model: Callable[[Lit, Array], Modelled]
    columns: Callable[[Lit, Array], Array]
    starts: Callable[[Lit], Array]
    said: Callable[[Array, Array], str]
    trial: str
    limits: Callable[[Lit], Array]
    none: int = 1
    rank: int = 0
    kept: Callable[[Array, NDArray[np.intp]], Array] = lambda u, some: u
    more: Callable[[Array, int], Array] = lambda u, k: u
    width: Callable[[Array], Array] | None = None
    aside: NDArray[np.bool_] | None = None


Maker = Callable[[Lit], list[Departure]]
"""The departures of one kind that are worth a question beside lights."""

Change = Callable[[Array, Array], tuple[Array, Array, Array]]
"""Of B (n, c) and the unknowns (u,): the B that is seen, its derivative by the former (n, c), and
by the unknowns (n, c, u)."""


def pointwise(change: Change) -> Callable[[Lit, Array], Modelled]:
    """The model of a departure that changes B itself, whatever lights it comes from."""

    def model(lit: Lit, u: Array) -> Modelled:
        plain = lit.plain
        B, slope, by_unknowns = change(plain.B, u)
        return Modelled(B, plain.by_lights * slope[:, :, None], by_unknowns)

    return model


def slope_of(change: Change) -> Callable[[Lit, Array], Array]:
    """The columns of such a departure."""
    return lambda lit, u: change(lit.plain.B, u)[2]


def added(columns: Array) -> Change:
    """B with so much of each of (n, c, u) columns on top."""
    return lambda B, u: (B + columns @ u, np.ones_like(B), columns)


def fixed(values: Array) -> Callable[[Lit], Array]:
    """Starts, or limits, that do not depend on the lights."""
    return lambda lit: values
