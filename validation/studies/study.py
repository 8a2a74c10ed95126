"""A study is a value: named scenes, what is measured over the rows of them, and a curve."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from validation.jobs import Ended, row_of
from validation.records import Cell, Curve, Heat, Row
from validation.studies.measures import Fields, Figure, Goal, Measured

EVERY = "every row"  # the name of the row over all others


@dataclass(frozen=True)
class Measure:
    """A column: its title, what it means, how it is measured, and its goal by row.

    A goal under `EVERY` is of all rows together; ``goals`` may be one goal for each single row.
    """

    title: str
    meaning: str
    of: Measured
    goals: Goal | Mapping[str, Goal] | None = None

    def goal(self, row: str) -> Goal | None:
        """What the row's figure must keep to; None where nothing is asked."""
        if isinstance(self.goals, Goal):
            return None if row == EVERY else self.goals
        return self.goals.get(row) if self.goals else None


@dataclass(frozen=True)
class Study:
    """Everything about a study.

    Parameters
    ----------
    name
        As on the command line.
    title
        Of its page.
    question
        What is asked, a sentence or two, with the goal.
    per_row
        Scenes of a row where nothing else is asked for.
    names
        All scenes for so many a row.
    one
        Runs one scene, in a process of its own.
    measures
        The columns.
    label
        A row's name as a reader meets it.
    said
        What came out, a sentence, from the rows.
    doubt
        Why a scene needs a look; None where it needs none.
    together
        Whether a last row is over all scenes.
    curve
        The drawing, None where there is nothing to draw.
    solvers
        Whether any solver may be asked in our search's place.
    heat
        Maps of the rows by two of their names; none where they have no two.
    """

    name: str
    title: str
    question: str
    per_row: int
    names: Callable[[int], list[str]]
    one: Callable[[str], Any]
    measures: tuple[Measure, ...]
    label: Callable[[str], str]
    said: Callable[[Sequence[Row]], str]
    doubt: Callable[[Fields], str | None]
    together: bool = False
    curve: Callable[[Sequence[Row], Sequence[Ended]], Curve | None] = lambda rows, scenes: None
    solvers: bool = False
    heat: Callable[[Sequence[Ended]], list[Heat]] = lambda scenes: []


def pooled(*titles: str) -> Callable[[Sequence[Row]], str]:
    """A `Study.said` that gives these cells of the row over all scenes."""
    return lambda rows: "; ".join(f"{title}: {rows[-1].cell(title).text}" for title in titles) + "."


def tabulate(study: Study, names: Sequence[str], ended: Mapping[str, Ended]) -> list[Row]:
    """The rows, in the order of the names, and at last the one over all of them."""
    rows: dict[str, list[str]] = {}
    for name in names:
        rows.setdefault(row_of(name), []).append(name)
    if study.together:
        rows[EVERY] = list(names)
    return [_row(study, row, planned, ended) for row, planned in rows.items()]


def _row(study: Study, name: str, planned: Sequence[str], ended: Mapping[str, Ended]) -> Row:
    scenes = [ended[scene] for scene in planned if scene in ended]
    crashed = sum(scene.record is None for scene in scenes)
    cells = tuple(
        _cell(measure.title, measure.of(scenes), measure.goal(name)) for measure in study.measures
    )
    label = EVERY if name == EVERY else study.label(name)
    return Row(name, label, len(planned), len(scenes), crashed, cells)


def _cell(title: str, figure: Figure, goal: Goal | None) -> Cell:
    met = None
    if goal is not None and goal.met is not None and figure.value is not None:
        met = goal.met(figure.value)
    return Cell(title, figure.text, figure.value, figure.error, goal.text if goal else None, met)


def outcome(study: Study, rows: Sequence[Row]) -> list[str]:
    """Which goals are met, what came out, and how much has been run: a sentence or so each."""
    if not any(row.ended for row in rows):
        return ["No scene has been run yet."]
    return [text for text in (_goals(rows), study.said(rows), _state(study, rows)) if text]


def _goals(rows: Sequence[Row]) -> str:
    judged = [(row, cell) for row in rows for cell in row.cells if cell.met is not None]
    missed = [
        f"{row.label}, {cell.column} {cell.text} (goal {cell.goal})"
        for row, cell in judged
        if not cell.met
    ]
    if missed:
        return f"{len(missed)} of {len(judged)} goals missed: {'; '.join(missed)}."
    if not judged:
        return ""
    return "The one goal is met." if len(judged) == 1 else f"All {len(judged)} goals met."


def _state(study: Study, rows: Sequence[Row]) -> str:
    single = [row for row in rows if row.name != EVERY]
    ended, planned = sum(row.ended for row in single), sum(row.planned for row in single)
    said = []
    if crashed := sum(row.crashed for row in single):
        said.append(f"{crashed} of {ended} scenes crashed.")
    if ended < planned:
        said.append(f"{ended} of {planned} scenes have been run.")
    if (fewest := min(row.planned for row in single)) < study.per_row:
        said.append(f"A row has {fewest} scene{'s' * (fewest > 1)} here, of {study.per_row}.")
    return " ".join(said)
