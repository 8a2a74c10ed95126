"""How near the position error comes to the Cramér-Rao bound: two studies along one axis each."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from validation.jobs import Ended
from validation.records import Curve, Line, Row
from validation.studies import scenes
from validation.studies.coverage import right
from validation.studies.many import converged
from validation.studies.measures import NO_FIGURE, Fields, Figure, below, records, share, tally
from validation.studies.study import Measure, Study
from validation.studies.trial import SIDE, Trial

GOAL = 1.2
BOOTSTRAP, SEED = 1000, 2018  # resamples of the scenes: their spread is known to 2 %


def usable(record: Fields) -> bool:
    """Whether an answer claims to be right and has the right count."""
    return converged(record) and right(record)


def squares(ended: Sequence[Ended]) -> NDArray[np.float64]:
    """(scenes, 2) summed squares of position errors and of their bounds, of usable answers."""
    pairs = [
        (np.square(record["errors"]).sum(), np.square(record["bounds"]).sum())
        for record in records(ended)
        if usable(record) and None not in record["bounds"]
    ]
    return np.array(pairs, dtype=float).reshape(-1, 2)


def ratio(ended: Sequence[Ended]) -> Figure:
    """Root mean square error over that of the bound, with its bootstrap error over scenes."""
    pairs = squares(ended)
    if not len(pairs):
        return NO_FIGURE
    value = float(np.sqrt(pairs[:, 0].sum() / pairs[:, 1].sum()))
    rng = np.random.default_rng(SEED)
    again = pairs[rng.integers(0, len(pairs), (BOOTSTRAP, len(pairs)))].sum(axis=1)
    error = float(np.sqrt(again[:, 0] / again[:, 1]).std())
    return Figure(value, f"{value:.2f} ± {error:.2f}", error)


def by_light(ended: Sequence[Ended]) -> Figure:
    """Root mean square of each light's own error over its own bound: no light outweighs others."""
    terms = [
        (error / bound) ** 2
        for record in records(ended)
        if usable(record)
        for error, bound in zip(record["errors"], record["bounds"], strict=True)
        if bound
    ]
    if not terms:
        return NO_FIGURE
    value = float(np.sqrt(np.mean(terms)))
    error = float(np.std(terms) / np.sqrt(len(terms)) / (2 * value))
    return Figure(value, f"{value:.2f} ± {error:.2f}", error)


def rms(column: int) -> Callable[[Sequence[Ended]], Figure]:
    """Root mean square of the error (0) or of the bound (1) a light, percent of the side."""

    def measure(ended: Sequence[Ended]) -> Figure:
        lights = sum(record["lights"] for record in records(ended) if usable(record))
        if not lights:
            return NO_FIGURE
        value = 100 * float(np.sqrt(squares(ended)[:, column].sum() / lights)) / SIDE
        return Figure(value, f"{value:.2g}")

    return measure


def doubt(record: Fields) -> str | None:
    if usable(record):
        return None
    return "left out: not converged" if right(record) else "left out: another count"


def said(rows: Sequence[Row]) -> str:
    known = [cell.value for row in rows if (cell := row.cell("Ratio")).value is not None]
    if not known:
        return ""
    return f"The position error is {min(known):.2f} to {max(known):.2f} of the bound."


def curve_along(axis: str, values: Sequence[float]) -> Callable[..., Curve]:
    def curve(rows: Sequence[Row], ended: Sequence[Ended]) -> Curve:
        cells = [row.cell("Ratio") for row in rows]
        line = Line(
            "position error over the bound",
            [float(value) for value in values],
            [cell.value for cell in cells],
            [cell.error for cell in cells],
        )
        return Curve(
            "Position error over the Cramér-Rao bound",
            axis,
            "ratio of root mean squares",
            (line,),
            ((1.0, "the bound"), (GOAL, "goal")),
            log_x=True,
            caption="Bars are bootstrap standard errors over the scenes.",
        )

    return curve


def study(
    name: str,
    title: str,
    question: str,
    axis: str,
    values: Sequence[float],
    letter: str,
    one: Callable[[str], Trial],
) -> Study:
    """The study whose rows are ``values`` of k or n, the rest held fixed."""
    return Study(
        name=name,
        title=title,
        question=question,
        per_row=50,
        names=lambda per_row: scenes.numbered([f"{letter}{value}" for value in values], per_row),
        one=one,
        measures=(
            Measure(
                "Ratio",
                "root mean square position error over that of the Cramér-Rao bound",
                ratio,
                below(GOAL),
            ),
            Measure(
                "By light",
                "root mean square of error over bound of each light: the few that are badly "
                "determined weigh no more than others",
                by_light,
            ),
            Measure("Error (%)", "root mean square position error, percent of the side", rms(0)),
            Measure("Bound (%)", "the same at the Cramér-Rao bound", rms(1)),
            Measure("Used", "answers that converged with the right count", share(usable)),
            Measure(
                "Right if converged",
                "of the answers that converged, those with the right count",
                share(right, converged),
            ),
            Measure("Reasons", "why the searches stopped", tally("reason")),
        ),
        label=lambda row: f"{letter} = {row.removeprefix(letter)}",
        said=said,
        doubt=doubt,
        solvers=True,
        curve=curve_along(axis, values),
    )
