"""What the data cannot decide, said as such: a verdict, not a wrong number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from lightloc import units
from lightloc.backend import types
from lightloc.fields import Grid
from lightloc.fit import Bound, Criterion, Fit, Problem, residuals
from lightloc.given import Geometry, Options, PointLights
from lightloc.optics import columns

PLANAR = 1e-6
"""Observations thinner than this share of their extent lie in one plane."""

Z95 = 1.96
"""Standard errors to either side that hold 95 % of a Gaussian."""


SAME = 5.0
"""Chi-square by which a mirror image may be worse and still look the same."""

LIT = 0.1
"""Of the brightest radiance: what counts as lit in a sentence."""


class Kind(Enum):
    """What can't be told; the value is what that means.

    Examples
    --------
    >>> from lightloc import Kind
    >>> Kind.MIRROR.value
    'the mirror image of a light would look the same'
    """

    TOO_FEW = "fewer observations are lit than there are unknowns"
    UNEXPLAINED = "the model does not explain the data"
    MATERIAL = "a material is not as given"
    EMISSION = "a light does not shine alike in all directions"
    GEOMETRY = "shadows are not where the geometry puts them"
    INDIRECT = "interreflected light is left, or too much of it was removed"
    OUTSIDE = "light comes from beyond the region that was searched"
    ENCODING = "radiance is not in proportion to what was given: a gamma, or another encoding"
    NOISE = "the noise is not as large as the standard errors say"
    ASSUMED = "the answer hangs on an assumption that nothing seen confirms"
    UNCERTAIN = "a position or an intensity is poorly determined"
    COUNT = "the observations allow more lights than are claimed"
    CLUSTER = "what was found as one light may be several, or several may be one"
    EXTENDED = "a light is wide, or several close together"
    MIRROR = "the mirror image of a light would look the same"
    BORDER = "a light lies at the border of the region that was searched"
    UNSEEN = "nothing is seen in a channel, so that an intensity is unknown"
    UNLIT = "a light whose position was given is not seen to shine"
    HIDDEN = "a light in some part of the region would reach no observation"


WRONG = frozenset(
    {
        *(Kind.MATERIAL, Kind.EMISSION, Kind.GEOMETRY, Kind.INDIRECT, Kind.OUTSIDE),
        *(Kind.ENCODING, Kind.NOISE),
    }
)
"""Verdicts on the model itself."""

DECISIVE = WRONG | {Kind.TOO_FEW, Kind.COUNT, Kind.UNCERTAIN, Kind.MIRROR, Kind.BORDER}
"""Verdicts that leave an answer undecided."""


@dataclass(frozen=True)
class Verdict:
    """One thing that the data can't decide.

    Parameters
    ----------
    kind : Kind
        What sort of thing.
    lights : tuple of int
        Indices of the lights that it is about, from 0; none where it is about the model or the
        region. Sentences, tables and files number lights from 1.
    sentence : str
        What a user reads.

    Examples
    --------
    >>> from lightloc import Kind, Verdict
    >>> Verdict(Kind.CLUSTER, (0, 1), "Lights 1 and 2 can't be told apart.").kind.value
    'what was found as one light may be several, or several may be one'
    """

    kind: Kind
    lights: tuple[int, ...]
    sentence: str


def too_few(problem: Problem, lights: PointLights) -> list[Verdict]:
    """No more lit observations than unknowns."""
    lit = int((problem.radiance > 0).sum())
    unknown = max(1, len(lights)) * (len(problem.axes) + problem.radiance.shape[1])
    if lit > unknown or not lit:
        return []
    said = f"{lit} lit observation(s) can't decide {unknown} unknowns."
    return [Verdict(Kind.TOO_FEW, tuple(range(len(lights))), said)]


def uncounted(possible: Sequence[int]) -> list[Verdict]:
    """Several numbers of lights are allowed."""
    if len(possible) < 2:
        return []
    said = f"The observations allow {possible[0]} to {possible[-1]} lights (95 %)."
    return [Verdict(Kind.COUNT, (), said)]


def unexplained(fit: Fit, problem: Problem, tried: int, share: float | None = None) -> Verdict:
    """The residual test: what is left is more than noise.

    ``tried`` is how many lights the search came to, and ``share`` how much of the squares of B the
    one light explains that is told all the same.
    """
    said = (
        f"The model does not explain the data: chi-square is {fit.cost / problem.rows:.3g} per "
        f"residual, where noise alone leaves 1."
    )
    looked = (
        f" Up to {tried} light{'s' * (tried != 1)} were tried;"
        if tried
        else " No place for a light was found;"
    )
    if share is not None:
        said += f"{looked} of all single ones this explains most, {_percent(share)} of B squared."
    elif not len(fit):
        B = problem.radiance
        lit = _percent(float((B.max() * LIT < B).mean()))
        said += f"{looked} {lit} of the radiances are above a tenth of the brightest."
    return Verdict(Kind.UNEXPLAINED, (), said)


def uncertain(problem: Problem, lights: PointLights, errors: Bound, o: Options) -> list[Verdict]:
    """Lights whose 95 % interval is wider than `Options` calls known.

    An intensity is measured by itself, or by the brightest channel's where it may well be 0; by the
    brightest light's where places were given, at which nothing may shine.
    """
    verdicts, held = [], problem.places is not None
    for i, (e, dI) in enumerate(zip(errors.position, errors.intensity, strict=True)):
        off = Z95 * float(np.linalg.norm(e))
        I = lights.intensities[i]
        whole = lights.intensities.max() if held else np.where(Z95 * dI < I, I, I.max())
        share = Z95 * float((dI / np.maximum(whole, 1e-300)).max())
        if off > o.sure_position * problem.size or share > o.sure_intensity:
            known = f"± {_length(off, problem.unit)} and {_percent(share)} of its intensity"
            if held:
                known = f"{_percent(share)} of the brightest intensity"
            said = f"Light {i + 1} is known to {known} (95 %)."
            verdicts.append(Verdict(Kind.UNCERTAIN, (i,), said))
    return verdicts


def clusters(
    problem: Problem, resolution: NDArray[np.float64], pairs: Sequence[tuple[int, int]], o: Options
) -> list[Verdict]:
    """Lights that could be two, and pairs that could be one."""
    found = [
        Verdict(Kind.CLUSTER, pair, f"Lights {pair[0] + 1} and {pair[1] + 1} can't be told apart.")
        for pair in pairs
    ]
    for i, apart in enumerate(resolution):
        if apart > o.cluster * problem.size:
            said = (
                f"Light {i + 1} may be several lights, up to {_length(apart, problem.unit)} apart."
            )
            found.append(Verdict(Kind.CLUSTER, (i,), said))
    return found


def unseen(unknown: NDArray[np.bool_]) -> list[Verdict]:
    """Intensities that nothing tells: (k, c) which those are. Said once where no light has one."""
    k = len(unknown)
    every = np.asarray(unknown.all(axis=0) & bool(k))
    verdicts = []
    if every.any():
        rest = "its intensity is" if every.sum() == 1 else "the intensities there are"
        said = f"Nothing is seen{_channels(every)}: {rest} unknown."
        verdicts.append(Verdict(Kind.UNSEEN, tuple(range(k)), said))
    for i in np.flatnonzero((unknown & ~every).any(axis=1)):
        where = _channels(unknown[i] & ~every)
        said = f"Light {i + 1} reaches nothing that is seen{where}: its intensity there is unknown."
        verdicts.append(Verdict(Kind.UNSEEN, (int(i),), said))
    return verdicts


def _channels(which: NDArray[np.bool_]) -> str:
    """Where that is, in words: nothing where there is one channel."""
    names = [name for name, one in zip(("red", "green", "blue"), which, strict=False) if one]
    return f" in {' and '.join(names)}" if len(which) == 3 else ""


def spread_out(width: NDArray[np.float64], unit: str) -> list[Verdict]:
    """Lights that have a width, of which (k,) say how wide each is, 0 for a point."""
    return [
        Verdict(
            Kind.EXTENDED,
            (int(i),),
            f"Light {i + 1} is no point: it is wide, or several lights close together. Two points "
            f"{_length(width[i], unit)} apart look like it.",
        )
        for i in np.flatnonzero(width)
    ]


def mirrored(
    problem: Problem, lights: PointLights, level: float, criterion: Criterion, o: Options
) -> list[Verdict]:
    """Lights that explain as much from the other side of a plane that holds all observations."""
    x = np.stack([np.array(v, np.float64) for v in problem.surfels.x], axis=1)
    middle = x.mean(axis=0)
    _, s, axes = np.linalg.svd(x - middle, full_matrices=False)
    if len(problem.axes) < 3 or not len(lights) or len(s) < 3 or s[2] > PLANAR * s[0]:
        return []
    across = axes[2]
    cost = criterion.likelihood.cost(residuals(problem, lights), level)
    verdicts = []
    for i, p in enumerate(lights.positions):
        image = p - 2 * across * ((p - middle) @ across)
        inside = ((image >= problem.bounds[0]) & (image <= problem.bounds[1])).all()
        if not inside or np.linalg.norm(image - p) < o.sure_position * problem.size:
            continue
        moved = lights.positions.copy()
        moved[i] = image
        other = residuals(problem, PointLights(moved, lights.intensities))
        if criterion.likelihood.cost(other, level) < cost + SAME:
            where = ", ".join(f"{a:.4g}" for a in image)
            said = f"Light {i + 1} may as well be at ({where}): all observations lie in one plane."
            verdicts.append(Verdict(Kind.MIRROR, (i,), said))
    return verdicts


def hidden(
    grid: Grid, dark: NDArray[np.bool_], geometry: Geometry | None, axes: NDArray[np.intp]
) -> list[Verdict]:
    """Free space from which nothing observed is seen.

    A cell that reaches no observation is inside a solid or outside the room, unless a way through
    such cells leads from it to one that does: each step of the way is a ray test.

    ``dark`` is (g,), whether a light in the cell would reach no observation; ``axes`` (d,) are the
    coordinates that lights may move along.
    """
    if dark.all():
        said = (
            "No position in the region lights any observation; bounds may have to include the "
            "space in front of the surfaces."
        )
        return [Verdict(Kind.HIDDEN, (), said)]
    if geometry is None or not dark.any():
        return []
    points = grid.points
    index = np.arange(len(points)).reshape(grid.shape)
    steps = []
    for axis in axes:
        a = np.take(index, range(grid.shape[axis] - 1), axis).ravel()
        b = np.take(index, range(1, grid.shape[axis]), axis).ravel()
        steps.append(np.stack([a, b]))
    a, b = np.concatenate(steps, axis=1)
    a, b = a[dark[a] | dark[b]], b[dark[a] | dark[b]]
    free = geometry.visible(columns(points[a]), columns(points[b]), types().Bool(True))
    dr.eval(free)
    open_ = np.broadcast_to(np.array(free), a.shape)
    a, b = a[open_], b[open_]
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(points), len(points)))
    _, part = connected_components(graph, directed=False)
    reached = np.unique(part[np.concatenate([a[~dark[a]], b[~dark[b]]])])
    share = float((dark & np.isin(part, reached)).mean())
    if not share:
        return []
    said = f"{_percent(share)} of the region reaches no observation: a light there can't be seen."
    return [Verdict(Kind.HIDDEN, (), said)]


def _length(value: float, unit: str) -> str:
    return units.length(value, unit) if np.isfinite(value) else "any distance"


def _percent(value: float) -> str:
    return f"{units.brief(100 * value)} %" if np.isfinite(value) else "any share"
