"""Indirect light beyond footnote 1: rendered for the lights found so far, subtracted, and again.

With positions fixed, all light is linear in the intensities, B = sum I (S + H), where H is what a
light of intensity 1 brings by way of the surfaces. So intensities follow in one step from all of
B: subtracting sum I H with intensities from the direct part alone would overshoot wherever H is
larger than S, as it is among metal walls. Direct light says how many lights there are and about
where; all light together, where exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from lightloc.answer import Kind, Localization, Reason, Step, Verdict, noise_by
from lightloc.deadline import OutOfTimeError, is_over
from lightloc.fit import Law, Problem, estimated_level, law_left, working_sigma
from lightloc.given import Observations, Options, PointLights
from lightloc.interreflection.all_light import REFITS, Split, above_zero, straight, together
from lightloc.interreflection.conclude import Certificate, concluded, explains
from lightloc.interreflection.rendered import Rendered, Source

Search = Callable[[Observations, PointLights], Localization]
"""Finds lights in direct light, going on from those that are given."""

MOST_ROUNDS = 5
"""Rooms of metal with eight lights settle in three to five (measured)."""

GLANCES = 3
"""Rounds over a sample of the observations, to learn how many lights there are."""

AT_REST = 1.0
"""Standard errors that no light may have moved in the last round: what is rendered where it then
is would move it by a tenth of that (measured, also among metal)."""

STILL = 0.3
"""Standard errors of movement below which a light keeps what was rendered for it."""

SEARCHED = 2
"""Rounds in which a search goes on where more than noise is left."""

NEAR = 3.0
"""Standard errors of movement below which rounds refine what was found and search no more."""


@dataclass(frozen=True, eq=False)
class Room:
    """What rounds are made over.

    Parameters
    ----------
    q
        The observations, with all interreflected light in them.
    problem
        Over them; its radiance and its sigma are not used.
    source
        Renders their indirect light.
    search
        For lights in direct light.
    """

    q: Observations
    problem: Problem
    source: Source
    search: Search

    @staticmethod
    def of(q: Observations, problem: Problem, source: Source, search: Search, o: Options) -> Room:
        """All light, with the errors that a search works with."""
        q = replace(q.with_radiance(q.radiance, working_sigma(q, o), q.interreflected), step=0.0)
        ones = np.ones_like(q.radiance)
        return Room(
            q, replace(problem, radiance=q.radiance, sigma=ones, ambient=None), source, search
        )


def glanced(found: Localization, room: Room, o: Options) -> Localization:
    """The lights of which direct light showed some, and ghosts, as all light shows them.

    Over a sample, with few paths: `rounds` begin where this ends.
    """
    for _ in range(GLANCES):
        before = found.lights
        if not len(before) or is_over():
            break
        try:
            H = Rendered.at(room.source, before.positions)
        except OutOfTimeError:
            break
        split = Split(room.q, straight(room.problem, before), H.around, H.error, o.outlier)
        found = searched_on(split, before, room.search)
        if movement(found, before) < NEAR:
            break
    return found


def rounds(
    found: Localization,
    room: Room,
    certificate: Certificate,
    o: Options,
    watch: Callable[[Step], None] = lambda step: None,
) -> Localization:
    """Render the indirect light of what was found, subtract it, and search again.

    Parameters
    ----------
    found : Localization
        Where to begin.
    room : Room
        All observations.
    certificate : Certificate
        Of an answer in direct light.
    o : Options
        The search's options.
    watch : callable
        Called with each round.

    Returns
    -------
    Localization
        The last search's answer, with positions, intensities and errors from direct and indirect
        light together. Where the lights still move after `MOST_ROUNDS`, a verdict says so.
    """
    lights = PointLights(np.zeros((0, 3)), np.zeros((0, room.q.channels)))
    H = split = None
    history, moved, far = list(found.history), np.inf, np.zeros(0, bool)
    for turn in range(MOST_ROUNDS):
        if moved < AT_REST or not len(found.lights) or is_over():
            break
        order = order_like(found.lights, lights)
        lights = PointLights(found.lights.positions[order], found.lights.intensities[order])
        try:
            if H is not None and len(far) == len(lights):
                H = H.moved(lights.positions, far)
            else:
                H = Rendered.at(room.source, lights.positions)
        except OutOfTimeError:
            break
        split = Split(room.q, straight(room.problem, lights), H.around, H.error, o.outlier)
        steps = [Step(f"round {turn + 1}", len(lights), found.chi2, turn + 1)]
        if moved > NEAR or (turn < SEARCHED and not explains(found)):
            found = searched_on(split, lights, room.search)
            steps += found.history
        far = np.zeros(0, bool)
        if len(found.lights) == len(lights):
            order = np.argsort(order_like(found.lights, lights))
            found, split = refined(found, split.rows(order), room.problem, o)
            far = movements(found, lights) > STILL
        moved = movement(found, lights)
        steps[0] = replace(steps[0], lights=len(found.lights), chi2=found.chi2)
        history += steps
        watch(steps[0])
    if split is not None and len(found.lights) == split.straight.shape[1]:
        found = concluded(found, split, room.problem, certificate, o)
    if len(found.lights) and not moved < AT_REST:
        found = unsettled(found)
    return replace(found, history=tuple(history))


def searched_on(split: Split, lights: PointLights, search: Search) -> Localization:
    """Search what the lights' indirect part leaves, from those of them that shine."""
    I = split.intensities()
    lit = I.any(axis=1)
    return search(split.direct(I), PointLights(lights.positions[lit], I[lit]))


def movements(found: Localization, before: PointLights) -> NDArray[np.float64]:
    """(k,) how far each light has changed, in standard errors; in the order of ``before``."""
    order = order_like(found.lights, before)
    step = np.linalg.norm(found.lights.positions[order] - before.positions, axis=1)
    error = np.linalg.norm(found.position_error[order], axis=1)
    brighter = np.abs(found.lights.intensities[order] - before.intensities)
    share = brighter / above_zero(found.intensity_error[order])
    return np.maximum(step / above_zero(error), share.max(axis=1))


def movement(found: Localization, before: PointLights) -> float:
    """How far the lights have changed, in standard errors; infinite where their number has."""
    if len(found.lights) != len(before):
        return np.inf
    return float(movements(found, before).max(initial=0.0))


def order_like(lights: PointLights, like: PointLights) -> NDArray[np.intp]:
    """Indices of the lights in the order of those that they are nearest to; new ones last.

    Examples
    --------
    >>> like = PointLights([[0, 0, 0], [5, 0, 0]], [1.0, 2.0])
    >>> order_like(PointLights([[9, 0, 0], [5.1, 0, 0], [0.1, 0, 0]], [3.0, 2.0, 1.0]), like)
    array([2, 1, 0])
    """
    apart = np.linalg.norm(like.positions[:, None] - lights.positions, axis=2)
    _, nearest = linear_sum_assignment(apart)
    others = np.setdiff1d(np.arange(len(lights)), nearest)
    return np.concatenate([nearest, others]).astype(np.intp)


def refined(
    found: Localization, split: Split, problem: Problem, o: Options
) -> tuple[Localization, Split]:
    """The lights refined on all of B, with their errors; a wide light's answer stands as it is."""
    if found.width.any():
        return found, split
    lights, split, errors = together(split, found.lights, problem)
    noise, unknowns = found.noise, len(lights) * (len(problem.axes) + lights.channels)
    if o.noise == "scaled":
        split, level = scaled(split, lights, unknowns)
        lights, split, errors = together(split, lights, problem)
        scale = np.full(lights.channels, level)
        noise = replace(noise, scale=scale, scale_error=noise.scale_error / noise.scale * scale)
    elif o.noise == "estimate":
        for _ in range(REFITS):
            split, law = with_law(split, lights, unknowns)
            lights, split, errors = together(split, lights, problem)
        noise = noise_by(law, split.residual(lights.intensities))
    now = replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=errors.covariance,
        noise=noise,
        chi2=split.cost(lights.intensities) / problem.rows,
    )
    return now, split


def scaled(split: Split, lights: PointLights, parameters: int) -> tuple[Split, float]:
    """The split with the standard errors of B times a factor that its residuals ask for.

    The rendering's own error is known, and is no part of that factor.
    """
    q, scale = split.q, 1.0
    for _ in range(REFITS):
        scale *= estimated_level(split.residual(lights.intensities), parameters)
        split = replace(split, q=q.with_radiance(q.radiance, q.known_sigma * scale))
    return split, scale


def with_law(split: Split, lights: PointLights, parameters: int) -> tuple[Split, Law]:
    """The split with standard errors of B by the law of what is left of all light.

    The rendering's own error is known, and is no part of that law.
    """
    M = ((split.straight + split.around) * lights.intensities).sum(axis=1)
    rendered = np.sqrt(np.square(split.error * lights.intensities).sum(axis=1))
    law = law_left(split.q.radiance - M, M, parameters, rendered)
    return replace(split, q=split.q.with_radiance(split.q.radiance, law.sigma(M))), law


def unsettled(found: Localization) -> Localization:
    """The answer where the lights still move: a verdict says so."""
    said = f"The lights still move after {MOST_ROUNDS} rounds of rendering their indirect light."
    verdict = Verdict(Kind.UNEXPLAINED, tuple(range(len(found.lights))), said)
    return replace(found, reason=Reason.NO_GAIN, verdicts=(verdict, *found.verdicts))
