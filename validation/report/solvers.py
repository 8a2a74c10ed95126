"""Solvers side by side: what each made of the same cases."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from validation.records import Result


@dataclass(frozen=True)
class SolverRow:
    """One solver's cases.

    Parameters
    ----------
    name
        As the command line takes it.
    outcomes
        How many came out how, by outcome.
    unexplained
        How many passed with an answer that does not believe itself.
    right
        How many have the right number of lights, each near a true one.
    cases
        How many there are.
    position, intensity
        The median over the cases of the worst error of a light that was found, in percent.
    seconds
        The median time of the search.
    """

    name: str
    outcomes: dict[str, int]
    unexplained: int
    right: int
    cases: int
    position: float | None
    intensity: float | None
    seconds: float | None


def solvers(results: Sequence[Result], order: Sequence[str]) -> list[SolverRow]:
    """A row for each solver, in the order of their cases; none where there is ours alone."""
    names = list(dict.fromkeys(result.method for result in results))
    if names in ([], ["search"]):
        return []
    rows = []
    for name in names:
        own = [result for result in results if result.method == name]
        judged = [result.comparison for result in own if result.comparison]
        rows.append(
            SolverRow(
                name=name,
                outcomes={o: sum(r.outcome == o for r in own) for o in order},
                unexplained=sum(r.is_unexplained for r in own),
                right=sum(c.count_right and not c.ghosts for c in judged),
                cases=len(own),
                position=middle([c.worst_position_percent for c in judged]),
                intensity=middle([c.worst_intensity_percent for c in judged]),
                seconds=middle([r.seconds.get("localize") for r in own]),
            )
        )
    return rows


def middle(values: Sequence[float | None]) -> float | None:
    """The median of what is known.

    Examples
    --------
    >>> middle([1.0, None, 3.0]), middle([None])
    (2.0, None)
    """
    known = [value for value in values if value is not None]
    return median(known) if known else None
