"""Study: rooms of all kinds at once, with noise that nobody tells and values that are wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.jobs import Ended
from validation.studies.coverage import Z95, right
from validation.studies.crossing import crossed
from validation.studies.many import converged
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    at_least,
    between,
    bounded,
    clopper_pearson,
    duration,
    records,
    tally,
    typical,
)
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study, pooled

LABELS = {
    "exact": "exact",
    "c0.0005": "0.05 % of B",
    "c0.01": "1 % of B",
    "c0.05": "5 % of B",
    "shot": "shot noise",
    "bits": "8 bits",
    "clipped2": "1 %, clipped at 2 % of the points",
    "clipped10": "1 %, clipped at 10 %",
    "zeros": "1 %, 40 % read 0",
}
CLOSE = 0.2  # relative error of a predicted standard error
FACTOR = 1.5  # of the share of outliers


def no_ghost(record: Fields) -> bool:
    return not record["ghosts"]


def predicted(record: Fields) -> bool:
    return bool(record["sigma_off"] <= CLOSE)


def counted(record: Fields) -> bool:
    """Whether the share of outliers is right within the factor."""
    low, high = record["wild"] / FACTOR, record["wild"] * FACTOR
    return bool(low <= record["wild_found"] <= high)


def allowed(ended: Sequence[Ended]) -> Figure:
    known = [record["allowed"] for record in records(ended)]
    return Figure(float(np.mean(known)), f"{np.mean(known):.3f}") if known else NO_FIGURE


def of_the_allowed(ended: Sequence[Ended]) -> Figure:
    """The share of right counts over that which the bound allows, with bounds of the former."""
    most = allowed(ended).value
    if not most:
        return NO_FIGURE
    hits = sum(map(right, records(ended)))
    low, high = clopper_pearson(hits, len(ended))
    value = hits / len(ended) / most
    return Figure(value, f"{value:.3f} ({low / most:.3f} to {high / most:.3f})")


def covered(ended: Sequence[Ended]) -> Figure:
    """The share of intervals that hold the truth, with its error over rooms: those of one room
    are not independent."""
    pairs = []
    for record in records(ended):
        if right(record):
            z = np.array([v for light in record["z"] for v in light], dtype=float)
            pairs.append((float((np.abs(np.nan_to_num(z, nan=np.inf)) <= Z95).sum()), len(z)))
    if not pairs:
        return NO_FIGURE
    held, of = np.array(pairs).T
    value = float(held.sum() / of.sum())
    error = float(np.sqrt(np.square(held - value * of).sum()) / of.sum())
    low, high = max(0.0, value - Z95 * error), min(1.0, value + Z95 * error)
    return Figure(value, f"{value:.3f} ({low:.3f} to {high:.3f})", error)


def doubt(record: Fields) -> str | None:
    said = [f"{record['found']} of {record['lights']} lights"] * (not right(record))
    said += [f"{record['ghosts']} ghosts"] * bool(record["ghosts"])
    if not said:
        return None
    room = f"{record['dimensions']}D, {record['surface']}, {record['occluders']} occluders"
    wild = f"{record['share']:.0%} {record['kind']} outliers"
    return f"{', '.join(said)} ({room}, {wild}; allowed {record['allowed']:.2f})"


STUDY = Study(
    name="crossed",
    title="Noise that nobody knows",
    question="How often are the lights found in rooms of all kinds, where the data say nothing of "
    "their noise? Dimensions, surfaces, occluders, one to six lights, outliers of three kinds and "
    "shares up to 10 % are drawn for each room by itself. The count should be right as often as "
    "the Cramér-Rao bound allows, no light should be a ghost, stated intervals should hold the "
    "truth, and the noise and the share of outliers should be told.",
    per_row=67,
    names=lambda per_row: numbered(list(LABELS), per_row),
    one=crossed,
    measures=(
        Measure("Right count", "as many lights are found as there are", bounded(right)),
        Measure(
            "Allowed",
            "mean probability that every light stands out of the noise, for errors at the bound",
            allowed,
        ),
        Measure(
            "Of the allowed",
            "the first over the second",
            of_the_allowed,
            {EVERY: at_least(0.98)},
        ),
        Measure(
            "No ghost",
            "every light found lies near a true one, as near as errors at the bound let it",
            bounded(no_ghost),
            {EVERY: at_least(0.99)},
        ),
        Measure(
            "Coverage",
            "share of the 95 % intervals, of positions and intensities, that hold the truth, where "
            "the count is right",
            covered,
            {EVERY: between(0.93, 0.97)},
        ),
        Measure(
            "σ told",
            "the standard error of B is predicted within 20 % over its central 90 %",
            bounded(predicted, lambda r: r["sigma_off"] is not None),
            {EVERY: at_least(0.9)},
        ),
        Measure(
            "Outliers told",
            "where there are some, their share is told within a factor of 1.5",
            bounded(counted, lambda r: r["wild"] > 0),
            {EVERY: at_least(0.9)},
        ),
        Measure(
            "Converged where right",
            "of the answers with the right count, those that converged",
            bounded(converged, right),
        ),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: LABELS[row],
    said=pooled("Right count", "Of the allowed", "No ghost", "Coverage"),
    doubt=doubt,
    together=True,
)
