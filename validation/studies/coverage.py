"""Study: whether the 95 % intervals that answers state contain the truth 95 % of the time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from validation.jobs import Ended
from validation.records import Curve, Line, Row
from validation.studies import scenes
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    Measured,
    between,
    rate,
    records,
    tally,
)
from validation.studies.study import EVERY, Measure, Study

Z95 = float(norm.ppf(0.975))  # standard errors to either side of an estimate
GOAL = between(0.93, 0.97)
MAKES = {"square": "empty", "discs2": "2 discs", "discs4": "4 discs"}
QUANTITIES = ("x", "y", "I")
WIDEST, BINS = 4.0, 32  # of the histogram, in standard errors; what lies beyond is in the last bins
EQUAL = 20  # bins of equal probability, for chi-square


def scores(ended: Sequence[Ended], quantity: int | None = None) -> NDArray[np.float64]:
    """Error over stated error: all, or of one of x, y and I; what is not finite covers nothing."""
    every = [light for record in records(ended) if right(record) for light in record["z"]]
    z = np.array(every, dtype=float).reshape(-1, len(QUANTITIES))
    z = np.nan_to_num(z, nan=np.inf)
    return z.ravel() if quantity is None else z[:, quantity]


def right(record: Fields) -> bool:
    """Whether the answer has as many lights as the room."""
    return record["found"] == record["lights"]


def covered(quantity: int | None) -> Measured:
    def measure(ended: Sequence[Ended]) -> Figure:
        z = scores(ended, quantity)
        figure = rate(int((np.abs(z) <= Z95).sum()), len(z))
        if figure.value is None:
            return NO_FIGURE
        return Figure(figure.value, f"{figure.value:.3f} ± {figure.error:.3f}", figure.error)

    return measure


def trials(ended: Sequence[Ended]) -> Figure:
    count = sum(map(right, records(ended)))
    return Figure(count, str(count))


def left_out(ended: Sequence[Ended]) -> Figure:
    count = sum(not right(record) for record in records(ended))
    return Figure(count, str(count))


def pearson(z: NDArray[np.float64]) -> tuple[float, float]:
    """Chi-square of a histogram of z against the Gaussian, and the chance of a larger one.

    Examples
    --------
    >>> chi_square, chance = pearson(norm.ppf((np.arange(1000) + 0.5) / 1000))
    >>> chi_square < 1e-9, chance
    (True, 1.0)
    """
    counts = np.bincount(np.minimum((norm.cdf(z) * EQUAL).astype(int), EQUAL - 1), minlength=EQUAL)
    expected = len(z) / EQUAL
    value = float((np.square(counts - expected) / expected).sum())
    return value, float(chi2.sf(value, EQUAL - 1))


def doubt(record: Fields) -> str | None:
    return None if right(record) else "left out: another count"


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    shares = ", ".join(f"{name} {whole.cell(name).text}" for name in QUANTITIES)
    return (
        f"The 95 % intervals contain the truth: {shares}, over {whole.cell('Trials').text} trials; "
        f"{whole.cell('Left out').text} with another count are left out."
    )


def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve | None:
    z = scores(ended)
    if not len(z):
        return None
    edges = np.linspace(-WIDEST, WIDEST, BINS + 1)
    counts, _ = np.histogram(np.clip(z, -WIDEST, WIDEST), edges)
    middle = ((edges[:-1] + edges[1:]) / 2).tolist()
    tails = np.concatenate([[-np.inf], edges[1:-1], [np.inf]])
    expected = (np.diff(norm.cdf(tails)) * len(z)).tolist()
    value, chance = pearson(z)
    return Curve(
        "Error over stated error, of all positions and intensities",
        "z",
        "count",
        (
            Line("z of the answers", middle, [float(count) for count in counts], kind="bar"),
            Line("standard Gaussian", middle, expected, kind="smooth"),
        ),
        caption=f"{len(z)} z-scores; what lies beyond ±{WIDEST:g} is in the last bins. Against the "
        f"Gaussian, in {EQUAL} bins of equal probability: χ² = {value:.1f} with {EQUAL - 1} "
        f"degrees of freedom, p = {chance:.2g}.",
    )


STUDY = Study(
    name="coverage",
    title="Coverage of the stated errors",
    question="Do the 95 % intervals that answers state contain the true positions and intensities? "
    "Between 93 and 97 % of them should, over at least 400 trials of two or three lights, in "
    "empty rooms and among discs, with k from 0.02 to 0.05.",
    per_row=100,
    names=lambda per_row: scenes.numbered(
        [f"{make}-{k}" for make in scenes.COVERED for k in scenes.FEW], per_row
    ),
    one=scenes.coverage,
    measures=(
        Measure("Trials", "answers with the right count", trials),
        Measure("Left out", "answers with another count, of which nothing is asked", left_out),
        Measure(
            "x", "share of the 95 % intervals with the truth in them", covered(0), {EVERY: GOAL}
        ),
        Measure(
            "y", "share of the 95 % intervals with the truth in them", covered(1), {EVERY: GOAL}
        ),
        Measure(
            "I", "share of the 95 % intervals with the truth in them", covered(2), {EVERY: GOAL}
        ),
        Measure("all three", "x, y and I together", covered(None)),
        Measure("Reasons", "why the searches stopped", tally("reason")),
    ),
    label=lambda row: "{}, {} lights".format(MAKES[row.partition("-")[0]], row.partition("-")[2]),
    said=said,
    doubt=doubt,
    together=True,
    curve=curve,
    solvers=True,
)
