"""The last word over all observations: polish, add what the sample hid, drop what is idle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.deadline import is_over
from lightloc.fit import (
    Criterion,
    Descents,
    Fit,
    Problem,
    arithmetic,
    estimated_level,
    fit_of,
    intensities,
    is_noise,
    law_of,
    level_of,
    no_lights,
)
from lightloc.given import PointLights
from lightloc.optics import shading
from lightloc.search.ladder import Ladder
from lightloc.search.lawful import posed_by
from lightloc.search.polish import pruned, sharpened

ROUNDING = 3.0
"""Standard errors of the arithmetic, which are alike at neighbours, that a light must exceed."""

REWEIGHTED = 2
"""Times that sigma is taken at the model's B: the second changes it by a thousandth."""


def settled(whole: Problem, ladder: Ladder) -> tuple[Fit, Problem]:
    """Polish the ladder's best over all observations and drop what is idle.

    Where sigma follows from B, it is then taken at the model's B, and where it is to be
    estimated, from the residuals; the problem comes back with the errors that were used.
    """
    view, fit = ladder.view, ladder.best
    criterion = view.criterion
    if not len(fit):
        known = criterion.likelihood.known and not criterion.likelihood.lawful
        whole = whole if known else in_the_dark(whole)
        return no_lights(whole, criterion.likelihood.scale), whole
    if criterion.likelihood.lawful:
        whole = posed_by(fit, whole)
    if view.rough:
        return sharpened(whole, Descents.at(fit.lights), criterion), whole
    if whole.rows > view.tight.rows:
        fit = pruned(view.tight, fit, criterion)
        explained = criterion.is_explained(view.tight, fit)
        fit = sharpened(whole, Descents.at(fit.lights), criterion)
        if explained:  # else what is left is an error of the model, and no light
            fit = completed(whole, fit, ladder)
    else:
        fit = pruned(whole, sharpened(whole, Descents.at(fit.lights), criterion), criterion)
    return by_its_own(whole, fit, criterion)


def by_its_own(whole: Problem, fit: Fit, criterion: Criterion) -> tuple[Fit, Problem]:
    """Refine a fit by the errors that follow from it, and the problem with these."""
    likelihood = criterion.likelihood
    if likelihood.lawful:
        for _ in range(REWEIGHTED):
            whole = replace(whole, sigma=fit.sigma)
            fit = fit_of(whole, fit.lights, likelihood.scale)
            some = criterion.trusted(whole, fit)
            there = sharpened(some, Descents.at(fit.lights), criterion)
            fit = fit_of(whole, there.lights, likelihood.scale)
        return fit, whole
    if likelihood.known:
        law = law_of(whole.radiance, whole.sigma)
        for _ in range(REWEIGHTED):
            if law is None:
                break
            model = whole.radiance - fit.residual * whole.sigma
            whole = replace(whole, sigma=law(model))
            fit = sharpened(whole, Descents.at(fit.lights), criterion)
        return fit, whole
    level = estimated_level(fit.residual, len(fit) * (len(whole.axes) + fit.lights.channels))
    whole = replace(whole, sigma=whole.sigma * level)
    return sharpened(whole, Descents.at(fit.lights), criterion), whole


def above_rounding(whole: Problem, fit: Fit, scale: float) -> Fit:
    """Without lights that bring nowhere as much as rounding may: that is alike at neighbours."""
    if whole.surfels.double or not len(fit):
        return fit
    each = shading(whole.surfels, fit.lights.positions, whole.geometry) * fit.lights.intensities
    B = each.sum(axis=1)
    seen = (each > ROUNDING * arithmetic(B, B.mean(axis=0))[:, None]).any(axis=(0, 2))
    if seen.all():
        return fit
    lights = PointLights(fit.lights.positions[seen], fit.lights.intensities[seen])
    return fit_of(whole, lights, scale)


def in_the_dark(whole: Problem) -> Problem:
    """Without a light B is noise about 0, of one size in a channel; unless its mean is not 0."""
    B = whole.radiance
    if not is_noise(B).all():
        return whole
    sigma = np.array([max(level_of(b), np.finfo(float).tiny) for b in B.T])
    return replace(whole, sigma=np.broadcast_to(sigma, B.shape))


def completed(whole: Problem, fit: Fit, ladder: Ladder) -> Fit:
    """Add lights that only all observations together show, where the certificate has its peak."""
    view = ladder.view
    criterion, most = view.criterion, ladder.most or view.most_lights
    while len(fit) < most and not is_over():
        peak, where = view.certificate(whole, fit)
        if peak**2 < criterion.price(whole):
            return fit
        places = np.concatenate([fit.lights.positions, where[None]])
        start = Descents.of(places[None], intensities(whole, places)[None])
        more = sharpened(whole, start, criterion)
        if not criterion.is_worth(whole, fit, more, criterion.errors([more])):
            return fit
        fit = more
    return fit
