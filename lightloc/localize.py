"""The method on one page: remove indirect light, search a sample, settle over all, conclude."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.answer import (
    Assumption,
    Localization,
    Step,
    Way,
    among,
    in_the_unit,
    with_unknowns,
)
from lightloc.backend import one_blas_thread
from lightloc.diagnosis import diagnosed
from lightloc.fit import Criterion, Fit, Problem, is_exact, presumed, without_black, working_sigma
from lightloc.given import Geometry, Observations, Options, PointLights, remove_known
from lightloc.interreflection import (
    Indirect,
    less_background,
    remove_indirect,
    rendering,
    rounds,
)
from lightloc.paper import Paper, Surface, published
from lightloc.search import (
    Ground,
    Ladder,
    Region,
    best_one,
    bordered,
    climbed,
    concluded,
    emptied,
    resumed,
    settled,
    widened,
)


def localize(
    observations: Observations,
    geometry: Geometry | None = None,
    *,
    method: Literal["search", "paper"] = "search",
    bounds: ArrayLike | None = None,
    options: Options | Paper | None = None,
    surface: Surface | None = None,
    indirect: Indirect | int | None = None,
    seed: int = 0,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is.

    Parameters
    ----------
    observations : Observations
        What is seen. Known light in it, and interreflected light, are removed first.
    geometry : Geometry, optional
        What occludes; nothing does where None. The light of emitters that it knows of (see
        `OtherwiseLit`) is subtracted.
    method : {"search", "paper"}
        Our own search, or the method as published, which takes one channel and a known sigma.
    bounds : (2, 3) array_like, optional
        Lower and upper corner of the region that may hold lights, in the unit of length. Where
        None: the box of the observations, or of the scene where the geometry has ``bounds``, and
        beyond it on sides that are open, from which a light would reach what is observed; further
        out still where such a side stops a light.
    options : Options or Paper, optional
        Settings of the method: `Options` for "search", `Paper` for "paper"; the defaults where
        None.
    surface : Surface, optional
        Distances along the observed surface, for "paper" alone. Where None, they are taken along
        the walls of a 2D scene, and else over neighbouring observations.
    indirect : int or callable, optional
        How the interreflected light of the lights found is rendered, for "search" alone: a number
        of paths per observation and light, which ``geometry`` then traces (see `Interreflecting`),
        or a function as `render.interreflected` gives it. What is rendered is subtracted and the
        search repeated, until the lights no longer move; that works for any BRDF. Where None,
        interreflected light is gathered from the observations alone, as by `remove_indirect`; that
        works where the room is largely diffuse, and not for irradiance.
    seed : int
        Seed of the sample of observations, of the gathering rays and of the rendered paths; same
        seed, same result.
    watch : callable, optional
        Called with each step of the search, as `Localization` keeps it in ``history``.

    Returns
    -------
    Localization
        The lights, the brightest first, and how sure they are.

    Raises
    ------
    ValueError
        If the method is neither of the two or the options are the other's; if ``bounds`` has
        another shape, is not finite, or its upper corner is below its lower; if "paper" is given
        RGB radiance or an unknown sigma; if all observations are saturated; or if interreflected
        light is to be removed and there is no geometry, the geometry can't render as ``indirect``
        asks, or the observations are irradiance and there is no ``indirect``.

    Notes
    -----
    The problem of section 3.1. "paper" is the algorithm of sections 4 and 5; interreflected light
    is removed as footnote 1 says. ``indirect`` is ours.

    Examples
    --------
    Five hundred points on a floor, and a light somewhere above it:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, PointLights, localize, radiance
    >>> floor = np.random.default_rng(0).uniform(-2, 2, (500, 3)) * [1, 1, 0]
    >>> up = np.tile([0.0, 0.0, 1.0], (500, 1))
    >>> dark = Observations(positions=floor, normals=up, directions=up,
    ...                     radiance=np.zeros(500), material=Lambert(albedo=0.5))
    >>> B = radiance(dark, PointLights([[0.5, -0.3, 1.2]], [10.0]))
    >>> found = localize(dark.with_radiance(B, 0.0), bounds=[[-2, -2, 0.1], [2, 2, 2]])
    >>> found.lights.positions.round(3).tolist(), found.reason.name
    ([[0.5, -0.3, 1.2]], 'CONVERGED')
    """
    o = settings(method, options, surface, indirect)
    measured, used = looked_at(observations, geometry)
    rest = remove_known(measured, geometry, seed=seed)
    seen = without_black(rest)
    if isinstance(o, Options) and seen.relative_sigma:
        o = replace(o, noise="estimate")
    if isinstance(o, Options) and seen.sigma is None:
        seen, o = presumed(seen), replace(o, noise="estimate")
    region = Region.of(observations, geometry, bounds)
    direct, way, columns = seen, Way.DIRECT, None
    if seen.interreflected:
        meters = seen.quantity == "irradiance" and indirect is not None
        direct = less_background(seen) if meters else without_indirect(seen, geometry, seed)
        way = Way.GATHERED
        if indirect is not None:
            columns, way = rendering(indirect, geometry, seen, used, seed), Way.RENDERED
        elif not used.all():
            raise ValueError(
                "footnote 1 would gather from points that are saturated; give indirect, to render "
                "interreflected light"
            )

    def answered(found: Localization) -> Localization:
        known = () if rest is measured else (Assumption.KNOWN_LIGHT,)
        told = in_the_unit(among(with_unknowns(found), used), observations)
        return replace(told, way=way, assumed=(*told.assumed, *known))

    if isinstance(o, Paper):
        if surface is not None and not used.all():
            raise ValueError("a surface has a place for each observation, and some are saturated")
        found = published(direct, geometry, region.bounds, o, surface, watch)
        return answered(found)

    def look(region: Region, glance: bool) -> Localization:
        ground = Ground.of(direct, geometry, region.bounds, o, seed)
        if glance:
            one = replace(o, most_lights=1)
            return searched(direct, ground, one, Criterion.of(o), silent, rough=True)
        if not seen.interreflected:
            return searched(direct, ground, o, Criterion.of(o), watch)
        if columns is None:
            return searched(direct, ground, o, Criterion.of(o).after_removal(), watch)
        return by_rounds(seen, direct, ground, o, columns, watch)

    with one_blas_thread():
        region, found = widened(look, region, seen, geometry, may=bounds is None)
        found = best_one(found, direct, geometry, region.bounds, o, seed)
        rule = Criterion.of(o).after_removal() if seen.interreflected else Criterion.of(o)
        found = diagnosed(found, direct, geometry, region.bounds, o, rule, seed)
    return answered(bordered(found, region))


def settings(
    method: str,
    options: Options | Paper | None,
    surface: Surface | None,
    indirect: Indirect | int | None,
) -> Options | Paper:
    """The method's options; raises ValueError where something belongs to the other method."""
    if method not in METHODS:
        raise ValueError(f"method is '{method}'; expected 'search' or 'paper'")
    o = options or METHODS[method]()
    if not isinstance(o, METHODS[method]):
        raise ValueError(f"method '{method}' takes {METHODS[method].__name__} as its options")
    if isinstance(o, Paper) and indirect is not None:
        raise ValueError("method 'paper' renders no interreflected light; leave out indirect")
    if isinstance(o, Options) and surface is not None:
        raise ValueError("method 'search' takes no surface")
    return o


def looked_at(
    observations: Observations, geometry: Geometry | None
) -> tuple[Observations, NDArray[np.bool_]]:
    """The observations that are not saturated, and which those are: (n,)."""
    if not isinstance(observations, Observations):
        raise ValueError(f"observations are a {type(observations).__name__}; not Observations")
    if geometry is not None and not isinstance(geometry, Geometry):
        raise ValueError(
            f"geometry is a {type(geometry).__name__}; expected one with the functions visible and "
            "intersect, such as render.load(...).geometry"
        )
    used = ~observations.saturated
    if not used.any():
        raise ValueError("all observations are saturated; expected at least one that is not")
    return observations if used.all() else observations.at(used), used


def without_indirect(q: Observations, geometry: Geometry | None, seed: int) -> Observations:
    """What footnote 1 leaves."""
    if geometry is None:
        raise ValueError("interreflected light can't be removed without the geometry")
    return remove_indirect(q, geometry, seed)


def by_rounds(
    whole: Observations,
    direct: Observations,
    ground: Ground,
    o: Options,
    indirect: Indirect,
    watch: Callable[[Step], None],
) -> Localization:
    """Search what footnote 1 leaves, then what rendered light leaves."""
    removed = Criterion.of(o).after_removal()

    def search(rest: Observations, start: PointLights | None) -> Localization:
        if start:
            return searched(rest, ground, o, Criterion.of(o), watch, start)
        # whether the model is wrong shows only once indirect light is rendered
        found = searched(rest, ground, o, removed, watch, rough=True)
        # finding no light at this rough stage is no answer
        return found if len(found.lights) else searched(rest, ground, o, removed, watch)

    def certificate(problem: Problem, fit: Fit) -> float:
        return ground.view(problem, o, Criterion.of(o)).certificate(problem, fit)[0]

    return rounds(whole, direct, ground.whole, indirect, search, certificate, o, watch)


def silent(step: Step) -> None:
    """Tells nobody."""


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
