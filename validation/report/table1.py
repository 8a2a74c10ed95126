"""The page of the paper's Table 1: ours beside the paper's, runtimes, and what was not solved."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment
from pydantic import Field

from validation.jobs import write_text
from validation.report.read import Count, MadeOn, Part, Real, read_checked
from validation.report.runtimes import Runtimes, runtimes
from validation.studies.published import SCENES

FILE = "table1.json"
MEDIAN, LONGEST = "Median (s)", "Max (s)"
KINDS = {  # of scenes that were not solved, and what each means
    "crashed": "the scene raised, or its process died",
    "failed": "no low-error solution was found",
    "shown": "low error, but other lights than the true ones",
}
NAMES = {"crashed": "crashed", "failed": "no low error", "shown": "other lights"}


class Cell(Part):
    """A figure of ours, the paper's, whether a goal is met, and both as text."""

    column: str
    ours: Real = None
    paper: Real = None
    met: bool | None = None
    text: str


class Row(Part):
    """A row of the table."""

    name: str
    planned: Count
    ended: Count
    crashed: Count
    cells: list[Cell]

    def cell(self, column: str) -> Cell | None:
        """The cell of a column."""
        return next((cell for cell in self.cells if cell.column == column), None)


class Scene(Part):
    """A scene that has ended; no record where it crashed."""

    name: str
    elapsed: float = 0.0
    record: dict[str, Any] | None = None
    error: str = ""

    def get(self, field: str) -> Any:
        """A field of the record; None where there is none."""
        return (self.record or {}).get(field)

    @property
    def kind(self) -> str:
        """What became of it: solved, or a key of `KINDS`."""
        if self.record is None:
            return "crashed"
        return "solved" if self.get("solved") else "shown" if self.get("full") else "failed"


class Document(Part):
    """What `lightloc table1` leaves: the verdict, the rows, and every scene."""

    made: MadeOn
    verdict: str
    spent: str = ""
    rows: list[Row] = Field(min_length=1)
    scenes: list[Scene]


def find(out: Path) -> Path | None:
    """The table1.json that belongs to a report in OUT: there, or in OUT/table1."""
    return next((path for path in (out / FILE, out / "table1" / FILE) if path.is_file()), None)


def write_page(source: Path, page: Path, pages: Environment, back: str | None = None) -> Path:
    """Draw the table in a file as a page; ``back`` is the suite's name where the page has one.

    Raises:
        ValueError: the file is missing or broken.
    """
    document, _ = read_checked(Document, source)
    scenes = sorted(document.scenes, key=lambda scene: scene.kind != "crashed")
    unsolved = [scene for scene in scenes if scene.kind != "solved"]
    text = pages.get_template("table1.html.j2").render(
        root="",
        back=back,
        table=document,
        columns=[cell.column for cell in document.rows[0].cells],
        goals=_goals(document.rows),
        fewest=min(row.planned for row in document.rows),
        paper_scenes=SCENES,
        judged_rows=sum(any(c.met is not None for c in row.cells) for row in document.rows),
        below_rows=[row for row in document.rows if any(c.met is False for c in row.cells)],
        unsolved=unsolved,
        counts={kind: sum(scene.kind == kind for scene in unsolved) for kind in KINDS},
        kinds=KINDS,
        kind_names=NAMES,
        runtimes=_runtimes(document),
        downloads=[
            (source.parent / name).relative_to(page.parent).as_posix()
            for name in ("table1.md", FILE)
            if (source.parent / name).is_file()
        ],
    )
    return write_text(page, text)


def _goals(rows: Sequence[Row]) -> dict[str, tuple[int, int]]:
    """Of each column with a goal, in how many of the judged rows it is met."""
    goals: dict[str, tuple[int, int]] = {}
    for row in rows:
        for cell in row.cells:
            if cell.met is not None:
                met, judged = goals.get(cell.column, (0, 0))
                goals[cell.column] = (met + cell.met, judged + 1)
    return goals


def _runtimes(document: Document) -> Runtimes | None:
    drawn = []
    for row in document.rows:
        taken = [
            (scene.name, float(scene.get("seconds") or 0), scene.kind == "solved")
            for scene in document.scenes
            if scene.record is not None and scene.name.rpartition("-")[0] == row.name
        ]
        median, longest = row.cell(MEDIAN), row.cell(LONGEST)
        paper = [cell.paper for cell in (median, longest) if cell and cell.paper is not None]
        drawn.append((row.name.replace("-", ", "), taken, median.ours if median else None, paper))
    return runtimes(drawn)
