"""Study: a frozen set of rooms, hard enough to tell one search from another by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.jobs import Ended
from validation.records import Row
from validation.studies.hard_scenes import hard
from validation.studies.many import certificate_of_unsolved, converged, doubt, says_so, solved
from validation.studies.measures import (
    NO_FIGURE,
    Figure,
    at_least,
    duration,
    records,
    share,
    tally,
    typical,
)
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study

# Rows by name: how a reader meets them, and how many rooms for each of the smallest row, so that
# those with many lights, of up to some minutes each, are few.
ROWS = {
    "lights-15": ("15 lights, no noise", 2),
    "lights-17": ("17 lights, no noise", 1),
    "lights-20": ("20 lights, no noise", 1),
    "noisy-4": ("4 lights, k = 0.05", 3),
    "noisy-5": ("5 lights, k = 0.05", 3),
    "discs-2-lights-9": ("2 discs, 9 lights, 1 % noise", 2),
    "solid-5-noise-5": ("3D, 5 lights, 5 % noise", 2),
    "solid-10-noise-1": ("3D, 10 lights, 1 % noise", 1),
}
FROZEN = 0.66  # share of all rooms that the search solved when the set was frozen: 40 of 60


def names(per_row: int) -> list[str]:
    """All rooms, row by row.

    Examples
    --------
    >>> names(1)[:3], len(names(4))
    (['lights-15-000', 'lights-15-001', 'lights-17-000'], 60)
    """
    return [name for row, (_, n) in ROWS.items() for name in numbered([row], n * per_row)]


def ceiling(ended: Sequence[Ended]) -> Figure:
    """The mean probability of being solved at the Cramér-Rao bound, where there is noise."""
    known = [r["ceiling"] for r in records(ended) if r["ceiling"] is not None]
    return Figure(float(np.mean(known)), f"{np.mean(known):.2f}") if known else NO_FIGURE


def said(rows: Sequence[Row]) -> str:
    whole = rows[-1]
    return f"Solved: {whole.cell('Solved').text} of all."


STUDY = Study(
    name="hard",
    title="The hard set",
    question="Does a change of the search win or lose rooms? These stay the same for ever, and are "
    "hard enough that the search solved only some of each row when they were chosen: many lights "
    "without noise, 5 % of noise, lights among discs, and more lights than usual in rooms of three "
    "dimensions. Two runs are compared room by room with `lightloc paired`. "
    f"At least {FROZEN:.0%} should be solved, as many as then.",
    per_row=4,
    names=names,
    one=hard,
    measures=(
        Measure(
            "Solved",
            "the count is right, every light within 1 % of the side (in three dimensions of the "
            "diagonal) and 5 % of its intensity; among discs within twice as much",
            share(solved),
            {EVERY: at_least(FROZEN)},
        ),
        Measure("Ceiling", "mean probability of that for errors at the Cramér-Rao bound", ceiling),
        Measure("Converged", "the answer says that it explains everything", share(converged)),
        Measure(
            "Right if converged", "solved, of the answers that converged", share(solved, converged)
        ),
        Measure(
            "Unsolved say so",
            "of those not solved, the answers whose reason, verdict or certificate shows it",
            share(says_so, lambda r: not solved(r)),
        ),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure(
            "Certificate",
            "its median over those not solved, standard errors; about 4 by chance alone",
            certificate_of_unsolved,
        ),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: ROWS[row][0],
    said=said,
    doubt=doubt,
    together=True,
    solvers=True,
)
