"""The method on one page: remove indirect light, search, polish, judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from numpy.typing import ArrayLike

from lightloc.answer import Localization, Step
from lightloc.backend import one_blas_thread
from lightloc.checks import array
from lightloc.fit import Criterion, Fit, Problem, is_exact, working_sigma
from lightloc.given import Geometry, Observations, Options, PointLights
from lightloc.interreflection import Indirect, remove_indirect, rounds
from lightloc.paper import Paper, Surface, published
from lightloc.search import Ground, Ladder, climbed, concluded, emptied, resumed, settled


def localize(
    observations: Observations,
    geometry: Geometry | None = None,
    *,
    method: Literal["search", "paper"] = "search",
    bounds: ArrayLike | None = None,
    options: Options | Paper | None = None,
    surface: Surface | None = None,
    indirect: Indirect | None = None,
    seed: int = 0,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is.

    Args:
        observations: what is seen; where they hold interreflected light, it is removed first.
        geometry: what occludes; None where nothing does.
        method: "search", ours, or "paper", the published one, which takes one channel.
        bounds: (2, 3) corners of the region that may hold lights, metres; the observations'
            bounding box where None, which has no height where all lie in one plane, as on a floor.
        options: settings of the method: `Options`, or `Paper` for "paper".
        surface: distances along the observed surface, used only by "paper". Where None: along the
            walls of a 2D scene, else shortest paths over neighbouring observations.
        indirect: the interreflected light of a light of intensity 1 at each of (k, 3) positions,
            and its standard error, each (n, k, c), as `render.interreflected` gives it. Then the
            indirect light of the lights found is subtracted, and the search repeated, until
            nothing changes: that holds for any BRDF, where footnote 1 asks for largely diffuse
            rooms.
        seed: for the sample of observations and the gathering rays.
        watch: called with each step of the search.

    Raises:
        ValueError: the bounds are not a box, the method is neither of the two or its options
            belong to the other, "paper" is given RGB radiance, or interreflected light is to be
            removed and there is no geometry to gather it with.

    >>> import numpy as np
    >>> from lightloc import Lambert, PointLights, radiance
    >>> floor = np.random.default_rng(0).uniform(-2, 2, (500, 3)) * [1, 1, 0]
    >>> up = np.tile([0.0, 0.0, 1.0], (500, 1))
    >>> dark = Observations(positions=floor, normals=up, directions=up,
    ...                     radiance=np.zeros(500), material=Lambert(albedo=0.5))
    >>> B = radiance(dark, PointLights([[0.5, -0.3, 1.2]], [10.0]))
    >>> found = localize(dark.with_radiance(B, 0.0), bounds=[[-2, -2, 0.1], [2, 2, 2]])
    >>> found.lights.positions.round(3).tolist(), found.reason.name
    ([[0.5, -0.3, 1.2]], 'CONVERGED')
    """
    q = observations
    if method not in METHODS:
        raise ValueError(f"method is '{method}'; expected 'search' or 'paper'")
    o = options or METHODS[method]()
    if not isinstance(o, METHODS[method]):
        raise ValueError(f"method '{method}' takes {METHODS[method].__name__} as its options")
    if q.interreflected:
        if geometry is None:
            raise ValueError("interreflected light can't be removed without the geometry")
        q = remove_indirect(q, geometry, seed)
    region = array("bounds", q.bounds if bounds is None else bounds, (2, 3))
    if isinstance(o, Paper):
        return published(q, geometry, region, o, surface, watch)
    with one_blas_thread():
        ground = Ground.of(q, geometry, region, o, seed)
        if not observations.interreflected:
            return searched(q, ground, o, Criterion.of(o), watch)
        return without_indirect(observations, q, ground, o, indirect, watch)


def without_indirect(
    whole: Observations,
    direct: Observations,
    ground: Ground,
    o: Options,
    indirect: Indirect | None,
    watch: Callable[[Step], None],
) -> Localization:
    """Search what footnote 1 leaves, then, where it can be rendered, what rendered light leaves."""
    removed = Criterion.of(o).after_removal()
    if indirect is None:
        return searched(direct, ground, o, removed, watch)

    def search(rest: Observations, start: PointLights | None) -> Localization:
        if start:
            return searched(rest, ground, o, Criterion.of(o), watch, start)
        # what footnote 1 leaves does not show a wrong model yet: rendered light will tell
        found = searched(rest, ground, o, removed, watch, rough=True)
        # finding no light at this rough stage is no answer
        return found if len(found.lights) else searched(rest, ground, o, removed, watch)

    def certificate(problem: Problem, fit: Fit) -> float:
        return ground.view(problem, o, Criterion.of(o)).certificate(problem, fit)[0]

    return rounds(whole, direct, ground.whole, indirect, search, certificate, o, watch)


METHODS: dict[str, type[Options] | type[Paper]] = {"search": Options, "paper": Paper}


SILENT = 0.03
"""Chi-square per residual that float32's rounding leaves in exact observations (measured)."""


def searched(
    q: Observations,
    ground: Ground,
    o: Options,
    criterion: Criterion,
    watch: Callable[[Step], None],
    start: PointLights | None = None,
    rough: bool = False,
) -> Localization:
    """Ours: climb to a set of lights over some observations, then settle it over all.

    A ``rough`` answer is only a starting point for a further search.
    """
    exact = is_exact(q) and o.noise == "given"
    whole = replace(ground.whole, radiance=q.radiance, sigma=working_sigma(q, o))
    enough = SILENT if exact else 0.0
    view = ground.view(whole, o, criterion, watch, enough=enough, rough=rough)
    ladder = Ladder.on(view)
    ladder = resumed(ladder, start) if start else climbed(ladder)
    if exact and len(ladder.best):
        ladder, whole = emptied(ladder, whole)
    if o.noise == "given" and not criterion.is_clean(view.tight, ladder.best):
        # the errors of a wrong model are correlated between neighbours
        ladder = replace(ladder, view=replace(view, criterion=criterion.doubting()))
    best, whole = settled(whole, ladder)
    last = Step("polish on all observations", len(best), best.cost / whole.rows)
    return concluded(q, whole, best, o, replace(ladder, history=(*ladder.history, last)))
