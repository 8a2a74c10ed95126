"""The page of a study: what was asked, what came out, the rows with their goals, and a curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from jinja2 import Environment
from pydantic import Field

from validation.jobs import write_text
from validation.report.read import Count, MadeOn, Part, Real, read_checked
from validation.studies import NAMES

FILE = "study.json"
FOLDER = "studies"  # of a report, with a folder in it for each study
KINDS = {  # of scenes that are listed, and what each means
    "crashed": "the scene raised, or its process died",
    "shown": "not as it should be",
}
NAMED = {"crashed": "crashed", "shown": "look"}


class Column(Part):
    """A column and what it means."""

    title: str
    meaning: str = ""


class Cell(Part):
    """A figure as text, and the goal that it meets or not."""

    column: str
    text: str
    value: Real = None
    error: Real = None
    goal: str | None = None
    met: bool | None = None


class Row(Part):
    """A row of the table."""

    name: str
    label: str
    planned: Count
    ended: Count
    crashed: Count
    cells: list[Cell]


class Line(Part):
    """A line of the curve."""

    name: str
    x: list[float]
    y: list[Real]
    error: list[Real] | None = None
    kind: Literal["line", "dash", "bar", "smooth"] = "line"


class Curve(Part):
    """What the page's script draws."""

    title: str
    x: str
    y: str
    lines: list[Line]
    levels: list[tuple[float, str]] = Field(default_factory=list)
    log_x: bool = False
    caption: str = ""


class Scene(Part):
    """A scene that has ended; no record where it crashed, ``doubt`` where it needs a look."""

    name: str
    record: dict[str, Any] | None = None
    error: str = ""
    doubt: str | None = None

    def get(self, field: str) -> Any:
        """A field of the record; None where there is none."""
        return (self.record or {}).get(field)

    @property
    def kind(self) -> str:
        """A key of `KINDS`."""
        return "crashed" if self.record is None else "shown"


class Document(Part):
    """What `lightloc study` leaves."""

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
    scenes: list[Scene]


@dataclass(frozen=True)
class StudyPage:
    """A page that was drawn, and what the index says of it."""

    page: Path
    title: str
    said: str
    met: int
    judged: int

    @property
    def kind(self) -> str:
        """The outcome whose colour and symbol it has."""
        if not self.judged:
            return "shown"
        return "passed" if self.met == self.judged else "failed"


def find_all(out: Path) -> list[Path]:
    """The study.json files of a report in OUT, in the order of the studies' names."""
    found = {path.parent.name: path for path in sorted((out / FOLDER).glob(f"*/{FILE}"))}
    order = [*NAMES, *found]
    return [found[name] for name in sorted(found, key=order.index)]


def write_study_page(
    source: Path, page: Path, pages: Environment, back: str | None = None, root: str = ""
) -> StudyPage:
    """Draw the study in a file as a page; ``back`` is the suite's name where the page has one.

    Raises:
        ValueError: the file is missing or broken.
    """
    study, _ = read_checked(Document, source)
    cells = [cell for row in study.rows for cell in row.cells if cell.met is not None]
    listed = [scene for scene in study.scenes if scene.record is None or scene.doubt]
    listed.sort(key=lambda scene: scene.kind != "crashed")
    drawn = StudyPage(
        page,
        study.title,
        " ".join(study.outcome[bool(cells) and len(study.outcome) > 1 :]),
        sum(bool(cell.met) for cell in cells),
        len(cells),
    )
    text = pages.get_template("study.html.j2").render(
        root=root,
        back=back,
        study=study,
        drawn=drawn,
        listed=listed,
        words=_words(study.rows),
        counts={kind: sum(scene.kind == kind for scene in listed) for kind in KINDS},
        kinds=KINDS,
        kind_names=NAMED,
        curve=study.curve.model_dump() if study.curve else None,
        ended=len(study.scenes),
        planned=sum(row.planned for row in study.rows if row.name != "every row"),
        downloads=[
            (source.parent / name).relative_to(page.parent).as_posix()
            for name in ("study.md", FILE)
            if (source.parent / name).is_file()
        ],
    )
    write_text(page, text)
    return drawn


def _words(rows: Sequence[Row]) -> set[str]:
    """The columns that hold words and no figures."""
    figures = {cell.column for row in rows for cell in row.cells if cell.value is not None}
    return {cell.column for row in rows for cell in row.cells} - figures
