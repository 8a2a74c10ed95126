"""The page of a study: what was asked, what came out, the rows with their goals, and a curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment

from validation.draw import embedded, study_curve
from validation.jobs import write_text
from validation.records import Document, Row, Scene, read_checked
from validation.report.cells import write_cells
from validation.studies import NAMES

FILE = "study.json"
FOLDER = "studies"  # of a report, with a folder in it for each study
KINDS = {  # of scenes that are listed, and what each means
    "crashed": "the scene raised, or its process died",
    "shown": "not as it should be",
}
NAMED = {"crashed": "crashed", "shown": "look"}


def kind_of(scene: Scene) -> str:
    """A key of `KINDS`."""
    return "crashed" if scene.record is None else "shown"


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

    Raises
    ------
        ValueError: the file is missing or broken.
    """
    study, _ = read_checked(Document, source)
    cells = [cell for row in study.rows for cell in row.cells if cell.met is not None]
    listed = [scene for scene in study.scenes if scene.record is None or scene.doubt]
    listed.sort(key=lambda scene: kind_of(scene) != "crashed")
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
        cells=write_cells(study, page, pages, root),
        drawn=drawn,
        listed=listed,
        words=_words(study.rows),
        counts={kind: sum(kind_of(scene) == kind for scene in listed) for kind in KINDS},
        kinds=KINDS,
        kind_names=NAMED,
        kind_of=kind_of,
        curve=embedded(study_curve(study.curve)) if study.curve else None,
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
