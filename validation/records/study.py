"""What a study leaves on disk: study.json, its table as rows of cells, and its curve."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from validation.records.part import Count, MadeOn, Part, Real

Stroke = Literal["line", "dash", "bar", "smooth"]


@dataclass(frozen=True)
class Cell:
    """A figure, the goal as text, and whether it is met; None where there is no goal."""

    column: str
    text: str
    value: Real = None
    error: Real = None
    goal: str | None = None
    met: bool | None = None


@dataclass(frozen=True)
class Row:
    """A row: its scenes, how many have ended and how many of those crashed, and its cells."""

    name: str
    label: str
    planned: Count
    ended: Count
    crashed: Count
    cells: tuple[Cell, ...]

    def cell(self, column: str) -> Cell:
        """The cell of a column."""
        return next(cell for cell in self.cells if cell.column == column)


@dataclass(frozen=True)
class Line:
    """A line of a curve, ``error`` of each y where it is known.

    A "dash" belongs to the line before it; "smooth" has no markers.
    """

    name: str
    x: list[float]
    y: list[Real]
    error: list[Real] | None = None
    kind: Stroke = "line"


@dataclass(frozen=True)
class Curve:
    """A drawing of the rows: axes, lines, and levels that a goal or a theory gives."""

    title: str
    x: str
    y: str
    lines: tuple[Line, ...]
    levels: tuple[tuple[float, str], ...] = ()
    log_x: bool = False
    caption: str = ""


@dataclass(frozen=True)
class Tile:
    """A cell of a map: the row that it stands for, what came out, and how good that is."""

    row: str
    text: str
    outcome: Literal["passed", "shown", "failed"]


@dataclass(frozen=True)
class Heat:
    """A map of rows by two of their names: what runs down and what across, and their tiles."""

    title: str
    down: str
    across: str
    rows: list[str]
    columns: list[str]
    tiles: list[list[Tile | None]]


class Column(Part):
    """A column and what it means."""

    title: str
    meaning: str = ""


class Scene(Part):
    """A scene that has ended; no record where it crashed, ``doubt`` where it needs a look."""

    name: str
    elapsed: Real = None
    record: dict[str, Any] | None = None
    error: str = ""
    doubt: str | None = None

    def get(self, field: str) -> Any:
        """A field of the record; None where there is none."""
        return (self.record or {}).get(field)


class Document(Part):
    """All of it."""

    name: str
    title: str
    question: str
    outcome: list[str] = Field(min_length=1)
    command: str
    made: MadeOn
    spent: Real = None
    columns: list[Column]
    rows: list[Row] = Field(min_length=1)
    curve: Curve | None = None
    heat: list[Heat] = Field(default_factory=list)
    scenes: list[Scene]
