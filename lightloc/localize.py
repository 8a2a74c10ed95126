"""The method on one page: remove indirect light, search a sample, settle over all, conclude."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.answer import (
    Assumption,
    Localization,
    Reason,
    Step,
    Way,
    among,
    hardly_gathered,
    in_the_unit,
    out_of_time,
    outliers_of,
    with_unknowns,
)
from lightloc.asked import are_given, begun, held, looked_at, settings
from lightloc.backend import one_blas_thread
from lightloc.checks import number
from lightloc.deadline import OutOfTimeError, in_time, is_over, within
from lightloc.diagnosis import astray, diagnosed
from lightloc.fit import (
    Criterion,
    Fit,
    Problem,
    Subtracted,
    is_exact,
    presumed,
    without_black,
    working_sigma,
)
from lightloc.given import (
    Geometry,
    Observations,
    Options,
    PointLights,
    remove_known,
)
from lightloc.interreflection import (
    Choice,
    Indirect,
    Room,
    Source,
    glanced,
    guessed,
    may_gather,
    removed,
    rendering,
    rounds,
    treatment,
    with_shared,
)
from lightloc.paper import Paper, Surface, published
from lightloc.search import (
    Ground,
    Ladder,
    Region,
    above_rounding,
    best_one,
    bordered,
    by_law,
    climbed,
    concluded,
    emptied,
    resumed,
    settled,
    strengths,
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
    indirect: Indirect | int | Literal["gathered"] | None = None,
    start: PointLights | None = None,
    fixed: ArrayLike | None = None,
    seconds: float | None = None,
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
    indirect : int, callable or "gathered", optional
        How interreflected light is treated, for "search" alone: rendered for the lights found,
        subtracted, and the search repeated until the lights no longer move, which works for any
        BRDF and any view; or "gathered" from the observations and subtracted first, as by
        `remove_indirect`, which works where the room is largely diffuse and observed almost
        everywhere, and not for irradiance. A number is that of paths per observation and light,
        which ``geometry`` then traces (see `Interreflecting`); a function, as
        `render.interreflected` gives it, renders by itself. Where None, it is gathered where that
        works and else rendered if the geometry can; the answer's ``way`` and ``why`` say which.
    start : PointLights, optional
        Lights to begin with, for "search" alone: a guess, or those of an earlier answer. They are
        refined, and searched on from unless they explain all.
    fixed : (k, 3) array_like, optional
        Positions of all lights, in the unit of length, for "search" alone, where they are known:
        only intensities are found then. An answer that a further light would improve says so.
    seconds : float, optional
        A budget of time, for "search" alone. Where it is used up, the best lights so far are the
        answer, and the reason is OUT_OF_TIME: whether the model is right was then not asked.
        Footnote 1 takes fewer rays where time is short, and is less sure. Not counted are kernels
        that a machine has never compiled, and the light of known emitters. What comes out then
        depends on how fast the machine is.
    seed : int
        Seed of the sample of observations, of the gathering rays and of the rendered paths; same
        seed, same result, unless time was up.
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
        another shape, is not finite, or its upper corner is below its lower; if ``seconds`` is not
        above 0; if ``fixed`` are no positions, or come with a ``start`` or with ``Options.free``;
        if ``start`` has other channels or another unit than the observations, or too many lights;
        if "paper" is given RGB radiance or an unknown sigma; if all observations are saturated; or
        if interreflected light is to be removed and there is no geometry, or the geometry can't
        render where that is asked for, the observations are irradiance or have a ``max_depth``, or
        some are saturated.

    Notes
    -----
    The problem of section 3.1. "paper" is the algorithm of sections 4 and 5; interreflected light
    is removed as footnote 1 says. Rendering it is ours.

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
    are_given(observations, geometry)
    if isinstance(o, Paper) and not (start is None and fixed is None and seconds is None):
        raise ValueError("method 'paper' takes neither start, fixed nor seconds")
    places = None if fixed is None else held(fixed, start, o)
    if seconds is not None:
        number("seconds", seconds, above=True)
    with within(None if seconds is None else seconds - concluding(seconds, len(observations))):
        return found_by(
            o, observations, geometry, bounds, surface, indirect, start, places, seed, watch
        )


SHARE, FIRST, EACH = 0.15, 0.1, 6e-5
"""What it takes to conclude: of a budget, and seconds at least, with those of each observation.

Measured: 0.25 to 0.35 s with 4 000, and one to eight lights.
"""


def concluding(seconds: float, n: int) -> float:
    """How long before the end of a budget nothing more is begun; what was begun ends by then."""
    return min(seconds / 2, max(SHARE * seconds, FIRST + EACH * n))


def found_by(
    o: Options | Paper,
    observations: Observations,
    geometry: Geometry | None,
    bounds: ArrayLike | None,
    surface: Surface | None,
    indirect: Indirect | int | Literal["gathered"] | None,
    start: PointLights | None,
    places: NDArray[np.float64] | None,
    seed: int,
    watch: Callable[[Step], None],
) -> Localization:
    """The lights, as `localize` has them, within the time that there is."""
    measured, limits = looked_at(observations, o, gathers=may_gather(geometry, indirect))
    if start is not None and isinstance(o, Options):
        start = begun(start, measured, o)
    used = ~limits.left_out
    rest = remove_known(measured, geometry, seed=seed)
    seen = without_black(rest)
    if isinstance(o, Options):
        if seen.relative_sigma and o.noise == "given":
            o = replace(o, noise="scaled")
        if seen.sigma is None:
            o = replace(o, noise="estimate")
        if o.noise == "estimate":
            seen = presumed(seen)
    region = Region.of(observations, geometry, bounds)
    direct, source, shared, choice = seen, None, None, Choice(Way.DIRECT, "")
    if seen.interreflected:
        choice = treatment(
            seen, geometry, not used.all(), indirect, seed, choose=isinstance(o, Options)
        )
        if choice.way is Way.RENDERED:
            asked = None if isinstance(indirect, str) else indirect
            source = rendering(asked, geometry, seen, used, seed)
            direct = guessed(seen, geometry, seed)
        elif geometry is not None:
            removal = removed(seen, geometry, seed)
            direct, shared = removal.direct, removal.shared

    def answered(found: Localization) -> Localization:
        known = () if rest is measured else (Assumption.KNOWN_LIGHT,)
        if found.reason is not Reason.OUT_OF_TIME:
            where = outliers_of(seen, found.noise.outliers, found.lights, geometry)
            found = replace(found, outlying=where)
        told = in_the_unit(among(with_unknowns(found), used), observations)
        why = choice.why
        if told.reason is Reason.OUT_OF_TIME and not any(step.turn for step in told.history):
            why = why if choice.way is Way.GATHERED else ""  # nothing was rendered
        told = replace(
            told, way=choice.way, why=why, limits=limits, assumed=(*told.assumed, *known)
        )
        return hardly_gathered(told) if choice.doubtful else told

    if isinstance(o, Paper):
        if surface is not None and not used.all():
            raise ValueError("a surface has a place for each observation, and some are saturated")
        found = published(direct, geometry, region.bounds, o, surface, watch)
        return answered(found)

    def look(region: Region, glance: bool) -> Localization:
        ground = Ground.of(direct, geometry, region.bounds, o, seed).at(places)
        criterion = Criterion.of(o, ground.chance)
        if glance:
            one = replace(o, most_lights=1)
            return searched(direct, ground, one, criterion, silent, rough=True)
        if not seen.interreflected:
            return searched(direct, ground, o, criterion, watch, start)
        if source is None:
            loose = criterion.after_removal()
            found = searched(direct, ground, o, loose, watch, start, seen=seen)
            return found if shared is None else with_shared(found, ground.whole, shared, o)
        return by_rounds(seen, direct, ground, o, source, watch, start)

    rule = Criterion.of(o).after_removal() if seen.interreflected else Criterion.of(o)
    with one_blas_thread():
        region, found = widened(look, region, seen, geometry, may=bounds is None and places is None)
        with suppress(OutOfTimeError):
            in_time()
            if places is None:
                found = best_one(found, direct, geometry, region.bounds, o, seed)
                found = diagnosed(found, direct, geometry, region.bounds, o, rule, seed)
    if is_over():
        found = out_of_time(found)
    return answered(found if places is not None else bordered(found, region))


def by_rounds(
    whole: Observations,
    direct: Observations,
    ground: Ground,
    o: Options,
    source: Source,
    watch: Callable[[Step], None],
    start: PointLights | None = None,
) -> Localization:
    """Search a guess at the direct light, then what rendered light leaves.

    First over a sample and with few paths, where that is cheaper.
    """
    criterion = Criterion.of(o, ground.chance)
    some = np.arange(len(whole)) if ground.some is None else ground.some
    few = source.glance(some)
    small, first, sample = ground, direct, whole
    if few is not None:
        small, first, sample = ground.of_sample(), direct.at(some), whole.at(some)
    loose = criterion.after_removal()
    # whether the model is wrong shows only once indirect light is rendered
    found = searched(first, small, o, loose, watch, start, rough=True, seen=sample)
    if not len(found.lights):  # finding no light at this rough stage is no answer
        found = searched(direct, ground, o, loose, watch, start, seen=whole)

    def room(q: Observations, ground: Ground, source: Source, rule: Criterion) -> Room:
        own = q.with_radiance(q.radiance, working_sigma(q, o))

        def search(rest: Observations, start: PointLights) -> Localization:
            return searched(rest, ground, o, rule, watch, start, seen=own)

        return Room.of(q, ground.whole, source, search, o)

    def certificate(problem: Problem, fit: Fit) -> float:
        return ground.view(problem, o, criterion).certificate(problem, fit)[0]

    if few is not None:
        found = glanced(found, room(sample, small, few, loose), o)
    return rounds(found, room(whole, ground, source, criterion), certificate, o, watch)


def silent(step: Step) -> None:
    """Tells nobody."""


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
    seen: Observations | None = None,
) -> Localization:
    """Ours: climb to a set of lights over some observations, then settle it over all.

    A ``rough`` answer is only a starting point for a further search. ``seen`` are the same
    observations with the interreflected light that ``q`` no longer has.
    """
    exact = is_exact(q) and o.noise == "given"
    whole = replace(ground.whole, radiance=q.radiance, sigma=working_sigma(q, o))
    if seen is not None:
        whole = replace(whole, subtracted=Subtracted.between(seen, q))
    enough = SILENT if exact else 0.0
    view = ground.view(whole, o, criterion, watch, enough=enough, rough=rough)
    if whole.places is not None:
        return strengths(q, view, whole, whole.places, o)
    if not rough:
        looked = q if ground.some is None else q.at(ground.some)
        view = replace(view, astray=partial(astray, looked, criterion))
    ladder = Ladder.on(view)
    ladder = resumed(ladder, start) if start else climbed(ladder)
    if criterion.likelihood.lawful and not ladder.astray:
        ladder = by_law(ladder)
    if exact and len(ladder.best):
        ladder, whole = emptied(ladder, whole)
    if o.noise == "given" and not criterion.is_clean(view.tight, ladder.best):
        # the errors of a wrong model are correlated between neighbours
        ladder = replace(ladder, view=replace(view, criterion=criterion.doubting()))
    best, whole = settled(whole, ladder)
    best = above_rounding(whole, best, criterion.likelihood.scale)
    last = Step("polish on all observations", len(best), best.cost / whole.rows)
    return concluded(q, whole, best, o, replace(ladder, history=(*ladder.history, last)))
