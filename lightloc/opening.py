"""The opening: several lights at once, more than needed and then fewer, through errors that tighten.

Each stage widens the observations' errors and the edges of shadows, so that what one light does
is seen from afar. In it lights are born where the residual's gain peaks, several at once; all are
refined together; and then as many are dropped or joined as the stage's errors can't tell. What
explains a stage goes on to the next, narrower one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.candidates import Dictionary, Left, atoms_at, gains_of
from lightloc.levenberg import NEARBY, Descents, descend
from lightloc.moves import start_at
from lightloc.certainty import jacobian
from lightloc.options import Options
from lightloc.polish import least_gain, spread_of
from lightloc.shading import shading, shading_gradient
from lightloc.solve import Problem, whitened

STAGES = ((0.2, 0.01), (0.05, 0.005), (0.02, 0.002))
"""Errors, of B, and the width of shadows' edges, of the longest side."""

BIRTHS, MORE = 6, 4
"""Lights born at once, and how many more after a round in vain."""

APART = 0.08
"""Of the longest side, between lights that are born at once."""

VAIN = 2
"""Rounds of births in vain that end a stage."""

ROUNDS = 12
"""Rounds of births in a stage, at most."""

STEPS = 20
"""Evaluations of each refinement."""

LIKELY = 1.3
"""Loss an observation, in a stage's errors, at which it is explained."""

TRIED = 2
"""Lights that are dropped, and pairs that are joined, before the best of these is taken."""

JOINED = 0.2
"""Of the longest side: pairs nearer than this may be one light."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A view of the problem through wider errors.

    Args:
        problem: with the stage's errors.
        dictionary: over it.
        blur: metres.
    """

    problem: Problem
    dictionary: Dictionary
    blur: float
    o: Options

    @property
    def price(self) -> float:
        return least_gain(self.problem, self.o)

    def explains(self, one: Descents) -> bool:
        return bool(one.chi2[0] < LIKELY * self.problem.rows)

    def descended(
        self, starts: Descents, damping: float, loss: float | None = None, steps: int = STEPS
    ) -> Descents:
        return descend(
            self.problem,
            starts.positions,
            starts.intensities,
            steps=steps,
            damping=damping,
            loss=self.o.outlier if loss is None else loss,
            blur=self.blur,
            fall=FALL,
        )

    def residuals(self, one: Descents) -> NDArray[np.float64]:
        """(n, c) with shadows as soft as the stage's."""
        problem, p, I = self.problem, one.positions[0], one.intensities[0]
        model: NDArray = np.zeros_like(problem.radiance)
        if len(p):
            S, _ = shading_gradient(problem.surfels, p, problem.geometry, self.blur, problem.axes)
            model = np.einsum("nkc,kc->nc", np.broadcast_to(S, (*S.shape[:2], I.shape[1])), I)
        return problem.without_ambient((problem.radiance - model) / problem.sigma)


FALL = 1e-4


def stage(tight: Problem, sampled: Problem, dictionary: Dictionary, level, blur, o) -> Stage:
    B = np.maximum(tight.radiance, 0)
    wide = np.maximum(tight.sigma, level * (B + DIM * B.mean(axis=0)))
    problem = replace(tight, sigma=wide)
    return Stage(problem, dictionary.under(sampled, problem), blur * tight.size, o)


DIM = 0.4


def through(s: Stage, one: Descents, rng: np.random.Generator, told) -> Descents | None:
    """One stage."""
    if one.positions.shape[1]:
        one = s.descended(one, NEARBY, steps=2 * STEPS)
        if told(one):
            return None
    vain = 0
    for _ in range(ROUNDS):
        if vain >= VAIN or s.explains(one) or one.positions.shape[1] >= s.o.most_lights:
            break
        z = s.residuals(one)
        loss = s.o.outlier if one.positions.shape[1] else np.inf
        more = born(s, one, z, loss, BIRTHS + MORE * vain, rng if vain else None)
        if more.positions.shape[1] == one.positions.shape[1]:
            break
        tried = s.descended(more, 1.0, loss, steps=30)
        tried = fewer(s, s.descended(tried, NEARBY, steps=15))
        gain = one.chi2[0] - tried.chi2[0]
        if not gain > s.price / 2 * max(1.0, tried.chi2[0] / s.problem.rows):
            vain += 1
        else:
            one, vain = tried, 0
            if told(one):
                return None
    return one


def born(s: Stage, one: Descents, z, loss, most, rng) -> Descents:
    """One hypothesis with up to ``most`` more lights, where each alone would gain most."""
    p, I = one.positions[0], one.intensities[0]
    d = s.dictionary
    left = Left.beside(whitened(s.problem, p), z, 1 / (1 + np.square(z / loss)))
    gains = replace(d, cap=np.full_like(d.cap, np.inf)).gains(left)
    if rng is not None:
        gains = gains * rng.uniform(0.5, 1.0, len(gains))
    places = apart(d.points, d.peaks(gains, PEAKS), PEAKS, APART * s.problem.size)
    if not len(places):
        return one
    lit = (z > LIT).any(axis=1)
    found = alone(s, d.points[places], z, np.flatnonzero(lit))
    atoms = atoms_at(s.problem, found)
    energies = np.square(atoms)
    free = np.full((len(found), len(atoms)), np.inf)
    gains = gains_of(atoms, energies, free, left)
    if rng is not None:
        gains = gains * rng.uniform(0.5, 1.0, len(gains))
    best = np.argsort(-gains, kind="stable")
    best = best[gains[best] > 0]
    new = apart(found, best, most, NEAR * s.problem.size)
    if not len(new):
        return one
    found = np.concatenate([about(s, found[j], left) for j in new])
    atoms, new = atoms_at(s.problem, found), np.arange(len(found))
    energies = np.square(atoms)
    a = np.stack([atoms[c][new] @ left.residual[c] for c in range(len(atoms))], axis=1)
    b = np.stack([energies[c][new] @ left.weight[c] for c in range(len(atoms))], axis=1)
    bright = np.maximum(a / np.maximum(b, 1e-30), 0) / len(new)
    bright = np.maximum(bright, 1e-3 * bright.max())
    return Descents.of(np.concatenate([p, found[new]])[None], np.concatenate([I, bright])[None])


def about(s: Stage, p, left) -> NDArray[np.float64]:
    """The best of some places about p: it may lie on the wrong side of a thin surface."""
    if s.problem.geometry is None:
        return p[None]
    rng = np.random.default_rng(0)
    axes = s.problem.axes
    way = rng.normal(size=(CLOUD, len(axes)))
    way *= (np.geomspace(*REACH, CLOUD) * s.problem.size / np.linalg.norm(way, axis=1))[:, None]
    places = np.tile(p, (CLOUD + 1, 1))
    places[1:, axes] += way
    places = np.clip(places, *s.problem.bounds)
    atoms = atoms_at(s.problem, places)
    gains = gains_of(atoms, np.square(atoms), np.full((len(places), len(atoms)), np.inf), left)
    return places[int(np.argmax(gains))][None]


CLOUD = 48
REACH = (0.0005, 0.03)


def apart(points, order, most, distance) -> NDArray[np.intp]:
    """The first of ``order`` that lie apart from each other."""
    kept: list[int] = []
    for j in order:
        if np.linalg.norm(points[kept] - points[j], axis=1).min(initial=np.inf) > distance:
            kept.append(int(j))
        if len(kept) == most:
            break
    return np.array(kept, int)


PEAKS = 24
LIT = 1.0
NEAR = 0.03


def alone(s: Stage, places, z, lit) -> NDArray[np.float64]:
    """Where one light from each place explains the residual best, of what is lit, without shadows.

    What is dark may lie in a shadow, which costs nothing here: so no shadow's edge comes between
    a start and a light, and no ray is traced.
    """
    if len(lit) <= 4:
        return places
    problem = s.problem.rows_of(lit)
    problem = replace(problem, geometry=None, radiance=(z * s.problem.sigma)[lit], ambient=None)
    S = shading(problem.surfels, places)  # n, m, c
    S = np.broadcast_to(S, (*S.shape[:2], z.shape[1])) / problem.sigma[:, None]
    zz = z[lit][:, None]
    bright = np.maximum((S * zz).sum(axis=0) / np.maximum(np.square(S).sum(axis=0), 1e-30), 0)
    bright = np.maximum(bright, 1e-3 * bright.max(axis=0))
    there = descend(problem, places[:, None], bright[:, None], steps=30, loss=s.o.outlier, fall=1e-3)
    return there.positions[:, 0]


def fewer(s: Stage, one: Descents) -> Descents:
    """Drop or join lights while that costs less than a light must gain."""
    while one.positions.shape[1] > 1:
        start = without(s, one)
        tried = s.descended(start, 0.1, steps=STEPS // 2)
        best = tried.rows(np.array([int(np.argmin(tried.chi2))]))
        most = one.chi2[0] + s.price * max(1.0, one.chi2[0] / s.problem.rows)
        if best.chi2[0] > most:
            best = s.descended(best, NEARBY, steps=2 * STEPS)
        if best.chi2[0] > most:
            return one
        one = best
    return one


def without(s: Stage, one: Descents) -> Descents:
    """Hypotheses with one light less: those that matter least dropped, those nearest joined."""
    p, I = one.positions[0], one.intensities[0]
    k, power = len(p), I.mean(axis=1)
    rest = [np.delete(np.arange(k), i) for i in np.argsort(worths(s, one))[:TRIED]]
    positions, intensities = [p[r] for r in rest], [I[r] for r in rest]
    a, b = np.triu_indices(k, 1)
    apart = np.linalg.norm(p[a] - p[b], axis=1)
    spread = np.minimum(power[a], power[b]) * apart**2
    for pair in np.argsort(spread)[:TRIED]:
        if apart[pair] < JOINED * s.problem.size:
            i, j = a[pair], b[pair]
            q, K = p.copy(), I.copy()
            q[i] = (power[i] * p[i] + power[j] * p[j]) / (power[i] + power[j])
            K[i] = I[i] + I[j]
            positions.append(np.delete(q, j, axis=0))
            intensities.append(np.delete(K, j, axis=0))
    return Descents.of(np.stack(positions), np.stack(intensities))


def worths(s: Stage, one: Descents) -> NDArray[np.float64]:
    """Chi-square that each light's absence would cost, to first order, all others refitted."""
    from lightloc.levenberg import normal_equations
    A = normal_equations(s.problem, one, s.o.outlier, s.blur)
    p, I = one.positions[0], one.intensities[0]
    k, c = I.shape
    first = len(A) - k * c
    size = np.sqrt(np.maximum(np.diag(A), np.finfo(float).tiny))
    spread = np.linalg.inv(A / np.outer(size, size) + 1e-9 * np.eye(len(A)))
    cost = np.zeros(k)
    for i in range(k):
        own = first + i * c + np.arange(c)
        cost[i] = size[own] @ np.linalg.inv(spread[np.ix_(own, own)]) @ size[own]
    return cost


def opened(tight: Problem, sampled: Problem, dictionary: Dictionary, o: Options, told) -> None:
    """Through all stages; ``told`` is given what each comes to, and says whether to go on."""
    c = tight.radiance.shape[1]
    one = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, c)))
    rng = np.random.default_rng(0)
    for level, blur in STAGES:
        s = stage(tight, sampled, dictionary, level, blur if tight.geometry is not None else 0.0, o)
        one = through(s, one, rng, told)
        if one is None or not one.positions.shape[1]:
            return
