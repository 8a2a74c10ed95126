"""The table itself: a list of columns, their figures over the scenes, and how they are written."""

from __future__ import annotations

import json
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from validation.jobs import Ended, row_of
from validation.studies.published import SCENES, figure

if TYPE_CHECKING:
    from rich.table import Table

SCHEMA = 1
NOTHING = "–"


@dataclass(frozen=True)
class Column:
    """A column of the table: which field of a scene's record, and what becomes of a row of it.

    ``published`` is the paper's column to stand beside; with ``goal`` ours must reach it.
    """

    title: str
    field: str
    figure: Callable[[Sequence[float]], float] = statistics.fmean
    published: str | None = None
    goal: bool = False

    @property
    def rate(self) -> bool:
        """Whether it is a share of the scenes; otherwise it is a runtime."""
        return self.figure is statistics.fmean

    def text(self, value: float | None) -> str:
        """A share with two decimals, seconds with two digits or more."""
        if value is None:
            return NOTHING
        return f"{value:.2f}" if self.rate else seconds(value)


# A method that is measured beside the paper's adds its columns here, and nowhere else.
COLUMNS = (
    Column("Random", "random", published="Random"),
    Column("V(p)", "votes", published="V(p)"),
    Column("Full", "full", published="Full", goal=True),
    Column("Solved", "solved", published="Solved", goal=True),
    Column("Oracle", "oracle"),
    Column("Median (s)", "seconds", statistics.median, "Median"),
    Column("Max (s)", "seconds", max, "Max"),
    Column("Search: Full", "ours_full", published="Full", goal=True),
    Column("Search: Solved", "ours_solved", published="Solved", goal=True),
    Column("Search: median (s)", "ours_seconds", statistics.median, "Median"),
    Column("Search: max (s)", "ours_seconds", max, "Max"),
)


@dataclass(frozen=True)
class Cell:
    """Our figure and the paper's, None where there is none; ``met`` None where no goal is set."""

    column: str
    ours: float | None
    paper: float | None
    met: bool | None
    text: str


@dataclass(frozen=True)
class Row:
    """A row: its scenes, how many have ended and how many of those crashed, and its cells."""

    name: str
    planned: int
    ended: int
    crashed: int
    cells: tuple[Cell, ...]

    @property
    def below(self) -> list[Cell]:
        """The cells that stay below the paper's."""
        return [cell for cell in self.cells if cell.met is False]


def tabulate(
    names: Iterable[str], ended: Mapping[str, Ended], columns: Sequence[Column] = COLUMNS
) -> list[Row]:
    """The rows, in the order of the names. A crashed scene counts in every rate, as not solved.

    A column that no record has a field for is left out.
    """
    rows: dict[str, list[str]] = {}
    for name in names:
        rows.setdefault(row_of(name), []).append(name)
    known = {field for scene in ended.values() for field in scene.record or ()}
    shown = [column for column in columns if column.field in known or not known]
    tabulated = []
    for row, planned in rows.items():
        scenes = [ended[name] for name in planned if name in ended]
        crashed = sum(scene.record is None for scene in scenes)
        cells = tuple(_cell(row, scenes, column) for column in shown)
        tabulated.append(Row(row, len(planned), len(scenes), crashed, cells))
    return tabulated


def _cell(row: str, scenes: Sequence[Ended], column: Column) -> Cell:
    values = [scene.record.get(column.field) for scene in scenes if scene.record is not None]
    if column.rate:
        known = [float(value or 0) for value in values] + [0.0] * (len(scenes) - len(values))
    else:  # what crashed took no time that says anything
        known = [float(value) for value in values if value is not None]
    ours = column.figure(known) if known else None
    paper = figure(row, column.published)
    met = None
    if column.goal and ours is not None and paper is not None:
        met = round(ours, 2) >= paper  # the paper's have two decimals
    text = column.text(ours) + ("" if paper is None else f" ({_paper(column, paper)})")
    return Cell(column.title, ours, paper, met, text)


def _paper(column: Column, value: float) -> str:
    return f"{value:.2f}" if column.rate else f"{value:g}"


def seconds(value: float) -> str:
    """Seconds for a narrow cell.

    >>> [seconds(value) for value in (0.0214, 0.318, 2.5, 83.4, 442.0)]
    ['0.021', '0.32', '2.5', '83', '442']
    """
    if value < 1:
        return f"{value:.2g}"
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def verdict(rows: Sequence[Row]) -> str:
    """What the table shows, in a sentence or three."""
    ended, planned = sum(row.ended for row in rows), sum(row.planned for row in rows)
    if not ended:
        return "No scene has been run yet."
    below = [f"{row.name} {cell.column} {cell.text}" for row in rows for cell in row.below]
    goals = {cell.column: None for row in rows for cell in row.cells if cell.met is not None}
    said = []
    if below:
        said.append(f"Below the paper: {', '.join(below)}.")
    elif goals:
        every = "every row" if all(row.ended for row in rows) else "every row that was run"
        said.append(f"{' and '.join(goals)} reach the paper's figures in {every}.")
    if crashed := sum(row.crashed for row in rows):
        said.append(f"{crashed} of {ended} scenes crashed.")
    if ended < planned:
        said.append(f"{ended} of {planned} scenes have been run.")
    if (fewest := min(row.planned for row in rows)) < SCENES:
        said.append(f"A row has {fewest} scene{'s' * (fewest > 1)} here, the paper's {SCENES}.")
    return " ".join(said)


def label(row: str) -> str:
    """A row's name as a reader meets it.

    >>> label("noisy-5")
    'noisy, 5'
    """
    return row.replace("-", ", ")


def document(rows: Sequence[Row], scenes: Sequence[Ended], made: Mapping[str, Any]) -> str:
    """The table as JSON, a scene a line: what made it, the verdict, the rows and every record."""
    head = {
        "schema": SCHEMA,
        "made": dict(made),
        "verdict": verdict(rows),
        "spent": spent(scenes),
        "rows": [asdict(row) for row in rows],
    }
    lines = ",\n".join(
        "  " + json.dumps(_without_print(scene), allow_nan=False) for scene in scenes
    )
    start = json.dumps(head, indent=1, allow_nan=False, ensure_ascii=False).removesuffix("\n}")
    return f'{start},\n "scenes": [\n{lines}\n ]\n}}\n'


def _without_print(scene: Ended) -> dict[str, Any]:
    return {key: value for key, value in asdict(scene).items() if key != "fingerprint"}


def spent(scenes: Sequence[Ended], field: str = "seconds") -> str:
    """How long the method took over all scenes, and every column together, on one core."""
    method = sum(scene.record.get(field) or 0.0 for scene in scenes if scene.record)
    every = sum(scene.elapsed for scene in scenes)
    return (
        f"The method took {_duration(method)} of one core for {len(scenes)} scenes, "
        f"all columns together {_duration(every)}."
    )


def _duration(value: float) -> str:
    return f"{value:.0f} s" if value < 120 else f"{value / 60:.0f} min"


def markdown(rows: Sequence[Row], scenes: Sequence[Ended], made: Mapping[str, Any]) -> str:
    """The table as Markdown, with the verdict and what it was made from."""
    titles = [cell.column for cell in rows[0].cells] if rows else []
    lines = ["| lights | " + " | ".join(titles) + " |", "| --- " + "| ---: " * len(titles) + "|"]
    for row in rows:
        cells = [f"**{cell.text}**" if cell.met is False else cell.text for cell in row.cells]
        lines.append(f"| {label(row.name)} | " + " | ".join(cells) + " |")
    versions = ", ".join(f"{name} {version}" for name, version in made["versions"].items())
    return "\n".join(
        [
            "# Table 1",
            "",
            "Each cell: ours (the paper's). In bold: below the paper's.",
            "",
            *lines,
            "",
            verdict(rows),
            "",
            spent(scenes),
            "",
            f"Made {made['date']} from commit {made['commit'] or 'unknown'}, "
            f"{made['cpus']} CPUs ({made['machine']}), {versions}.",
            "",
        ]
    )


def terminal(rows: Sequence[Row]) -> Table:
    """The table for a terminal: green where the paper is reached, red where it is not."""
    from rich.table import Table
    from rich.text import Text

    drawn = Table(title="Table 1: ours (the paper's)", title_justify="left")
    drawn.add_column("lights", no_wrap=True)
    for cell in rows[0].cells if rows else ():
        drawn.add_column(cell.column, justify="right")
    colour = {True: "green", False: "red", None: ""}
    for number, row in enumerate(rows):
        after = rows[number + 1].name if number + 1 < len(rows) else ""
        last = after.partition("-")[0] != row.name.partition("-")[0]
        cells = [Text(cell.text, colour[cell.met]) for cell in row.cells]
        drawn.add_row(label(row.name), *cells, end_section=last)
    return drawn
