"""The answer of all light: what follows from lights that direct and indirect light have settled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lightloc.answer import MARGIN, Kind, Localization, Reason, judged, mirrored, unexplained
from lightloc.fields import intensity_distance
from lightloc.fit import Criterion, Fit, Problem, inseparable, level_of, resolution
from lightloc.given import Options
from lightloc.interreflection.all_light import Split, spread

Certificate = Callable[[Problem, Fit], float]
"""The largest correlation of what a fit leaves with a further light, in standard errors."""


def explains(found: Localization) -> bool:
    """Whether no more than noise is left."""
    return found.reason in (Reason.CONVERGED, Reason.UNDECIDED, Reason.EXTENDED)


def concluded(
    found: Localization, split: Split, problem: Problem, certificate: Certificate, o: Options
) -> Localization:
    """The answer with all that follows from its lights and all of B, brightest first.

    ``split`` is B as the light of these very lights. Where one is wide, the answer of the search in
    direct light stands.
    """
    if found.width.any():
        return found
    lights, split = found.lights.brightest_first(), split.rows(found.lights.order)
    errors = spread(split, lights, problem)
    criterion, direct = Criterion.of(o), split.direct(lights.intensities)
    z, cost = split.residual(lights.intensities), split.cost(lights.intensities)
    k = len(lights)
    posed = replace(problem, radiance=direct.radiance, sigma=direct.known_sigma)
    fit = Fit(lights, z, cost, posed)
    top, _ = intensity_distance(direct, lights.positions, problem.geometry, margin=MARGIN)
    level = max(1.0, level_of(z))
    verdicts = [verdict for verdict in found.verdicts if verdict.kind is not Kind.MIRROR]
    verdicts += mirrored(posed, lights, level, criterion, o)
    reason = found.reason
    every = replace(posed, radiance=split.q.radiance)
    peak, explained = certificate(posed, fit), criterion.is_explained(every, fit)
    if explains(found) and not explained:
        reason, verdicts = Reason.NO_GAIN, [unexplained(fit, problem, k), *verdicts]
    if reason is Reason.NO_GAIN and explained and peak**2 < criterion.price(posed):
        # the search looked at what an earlier rendering had left
        reason = Reason.CONVERGED
        verdicts = [verdict for verdict in verdicts if verdict.kind is not Kind.UNEXPLAINED]
    now = replace(
        found,
        lights=lights,
        position_error=errors.position,
        intensity_error=errors.intensity,
        covariance=errors.covariance,
        bound=top,
        direct=direct.radiance,
        sigma=direct.known_sigma,
        residual=z,
        chi2=cost / problem.rows,
        noise=found.noise.leaving(z),
        counts=tuple(
            replace(one, lights=lights, chi2=cost / problem.rows) if len(one.lights) == k else one
            for one in found.counts
        ),
        inseparable=inseparable(lights, errors.position),
        resolution=resolution(posed, lights),
        certificate=peak,
        reason=reason,
        verdicts=tuple(verdicts),
    )
    return judged(now, problem, o)
