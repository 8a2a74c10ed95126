"""The method on one page: remove indirect light, search a sample, settle over all, conclude."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from numpy.typing import ArrayLike

from lightloc.answer import Localization, Step, Way, among
from lightloc.backend import one_blas_thread
from lightloc.checks import array
from lightloc.fit import Criterion, Fit, Problem, is_exact, presumed, working_sigma
from lightloc.given import Geometry, Observations, Options, PointLights
from lightloc.interreflection import Indirect, remove_indirect, rendering, rounds
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
    indirect: Indirect | int | None = None,
    seed: int = 0,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Find the lights: how many, where, how strong, and how sure that is.

    Parameters
    ----------
    observations : Observations
        What is seen. Interreflected light in it is removed first.
    geometry : Geometry, optional
        What occludes; nothing does where None.
    method : {"search", "paper"}
        Our own search, or the method as published, which takes one channel and a known sigma.
    bounds : (2, 3) array_like, optional
        Lower and upper corner of the region that may hold lights, in the unit of length. Where
        None, the observations' bounding box; where all of them lie in one plane, as on a floor,
        that has no height, and lights are sought in the plane alone.
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
        works where the room is largely diffuse.
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
        asks, or the observations are irradiance.

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
    if method not in METHODS:
        raise ValueError(f"method is '{method}'; expected 'search' or 'paper'")
    o = options or METHODS[method]()
    if not isinstance(o, METHODS[method]):
        raise ValueError(f"method '{method}' takes {METHODS[method].__name__} as its options")
    if isinstance(o, Paper) and indirect is not None:
        raise ValueError("method 'paper' renders no interreflected light; leave out indirect")
    if isinstance(o, Options) and surface is not None:
        raise ValueError("method 'search' takes no surface")
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
    seen = observations if used.all() else observations.at(used)
    if isinstance(o, Options) and seen.sigma is None:
        seen, o = presumed(seen), replace(o, noise="estimate")
    region = array("bounds", observations.bounds if bounds is None else bounds, (2, 3))
    if (region[1] < region[0]).any() or (region[0] == region[1]).all():
        raise ValueError("bounds are no box: expected a lower corner and, beyond it, an upper one")
    direct, way = seen, Way.DIRECT
    if seen.interreflected:
        if geometry is None:
            raise ValueError("interreflected light can't be removed without the geometry")
        if indirect is None and not used.all():
            raise ValueError(
                "footnote 1 would gather from points that are saturated; give indirect, to render "
                "interreflected light"
            )
        direct, way = remove_indirect(seen, geometry, seed), Way.GATHERED
    if isinstance(o, Paper):
        if surface is not None and not used.all():
            raise ValueError("a surface has a place for each observation, and some are saturated")
        found = published(direct, geometry, region, o, surface, watch)
        return replace(among(found, used), way=way)
    with one_blas_thread():
        ground = Ground.of(direct, geometry, region, o, seed)
        if way is Way.DIRECT:
            found = searched(direct, ground, o, Criterion.of(o), watch)
        elif indirect is None:
            found = searched(direct, ground, o, Criterion.of(o).after_removal(), watch)
        else:
            columns, way = rendering(indirect, geometry, seen, used, seed), Way.RENDERED
            found = without_indirect(seen, direct, ground, o, columns, watch)
    return replace(among(found, used), way=way)


def without_indirect(
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
