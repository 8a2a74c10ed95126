"""The last word over all observations: polish, add what the sample hid, drop what is idle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.levenberg import Descents
from lightloc.moves import start_at
from lightloc.noise import law_of, level_of
from lightloc.options import Options
from lightloc.polish import is_explained, is_worth, least_gain, noise_level, prune, sharpened
from lightloc.search import Search
from lightloc.solve import Fit, Problem, intensities, no_lights

REWEIGHTED = 2
"""Times that sigma is taken at the model's B: the second changes it by a thousandth."""


def settled(whole: Problem, search: Search, o: Options) -> tuple[Fit, Problem]:
    """Polish the search's best over all observations and drop what is idle.

    Where sigma follows from B, it is then taken at the model's B, and where it is to be
    estimated, from the residuals; the problem comes back with the errors that were used.
    """
    if not len(search.best):
        return no_lights(whole, o.outlier), whole
    law = law_of(whole.radiance, whole.sigma)
    fit = search.best
    if o.rough:
        return sharpened(whole, start_at(fit.lights), o), whole
    if whole.rows > search.tight.rows:
        fit = prune(search.tight, fit, o)
        explained = is_explained(fit, search.tight, o)
        fit = sharpened(whole, start_at(fit.lights), o)
        if explained:  # else what is left is an error of the model, and no light
            fit = completed(whole, fit, search, o)
    else:
        fit = sharpened(whole, start_at(fit.lights), o)
    fit = prune(whole, fit, o)
    if law and o.noise == "given":
        for _ in range(REWEIGHTED):
            model = whole.radiance - fit.residual * whole.sigma
            whole = replace(whole, sigma=law(model))
            fit = sharpened(whole, start_at(fit.lights), o)
    if o.noise == "estimate":
        level = level_of(fit.residual, len(fit) * (len(whole.axes) + fit.lights.channels))
        whole = replace(whole, sigma=whole.sigma * level)
        fit = sharpened(whole, start_at(fit.lights), o)
    return fit, whole


def completed(whole: Problem, fit: Fit, search: Search, o: Options) -> Fit:
    """Add lights that only all observations together show, where the certificate has its peak."""
    while len(fit) < min(o.most_lights, search.most):
        peak, where = search.certificate(whole, fit)
        if peak**2 < least_gain(whole, o):
            return fit
        places = np.concatenate([fit.lights.positions, where[None]])
        start = Descents.of(places[None], intensities(whole, places)[None])
        more = sharpened(whole, start, o)
        if not is_worth(whole, fit, more, noise_level([more], o), o):
            return fit
        fit = more
    return fit
