"""A study as it is written: Markdown, JSON for the report, and a table for a terminal."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import compress
from shlex import quote
from typing import TYPE_CHECKING, Any

from validation.jobs import Ended, row_of
from validation.records import SCHEMA, Cell, Column, Document, MadeOn, Row, Scene
from validation.studies.study import EVERY, Study, outcome

if TYPE_CHECKING:
    from rich.table import Table

CRASHED = "crashed"


def command(study: Study, per_row: int, rows: Sequence[Row] = ()) -> str:
    """What repeats it; without the number of scenes where it is the study's own, and all rows."""
    some = [row.name for row in rows if row.ended and row.name != EVERY]
    more = "" if per_row == study.per_row else f" --scenes {per_row}"
    if 0 < len(some) < len({row_of(name) for name in study.names(1)}):
        more += "".join(f" --row {name}" for name in some)
    method = getattr(study.one, "method", None)
    if method is not None:
        more = f" --method {quote(method.said)}{more}"
    return f"lightloc study {study.name.partition('--')[0]}{more}"


def document(
    study: Study,
    per_row: int,
    rows: Sequence[Row],
    scenes: Sequence[Ended],
    made: Mapping[str, Any],
) -> str:
    """Everything that its page shows as JSON, a scene a line."""
    whole = Document(
        name=study.name,
        title=study.title,
        question=study.question,
        outcome=outcome(study, rows),
        command=command(study, per_row, rows),
        made=MadeOn(**made),
        spent=sum(scene.elapsed for scene in scenes),
        columns=[Column(title=m.title, meaning=m.meaning) for m in study.measures],
        rows=list(rows),
        curve=study.curve(rows, scenes) if scenes else None,
        heat=study.heat(scenes) if scenes else [],
        scenes=[_scene(study, scene) for scene in scenes],
    )
    head = {"schema": SCHEMA, **whole.model_dump(mode="json", exclude={"scenes"})}
    lines = ",\n".join(f"  {scene.model_dump_json()}" for scene in whole.scenes)
    start = json.dumps(head, indent=1, allow_nan=False, ensure_ascii=False).removesuffix("\n}")
    return f'{start},\n "scenes": [\n{lines}\n ]\n}}\n'


def _scene(study: Study, ended: Ended) -> Scene:
    return Scene(
        name=ended.name,
        elapsed=ended.elapsed,
        record=ended.record,
        error=ended.error,
        doubt=CRASHED if ended.record is None else study.doubt(ended.record),
    )


def markdown(study: Study, per_row: int, rows: Sequence[Row], made: Mapping[str, Any]) -> str:
    """The table as Markdown, with the question, what came out and what it was made from."""
    titles = [measure.title for measure in study.measures]
    lines = ["| | " + " | ".join(titles) + " |", "| --- " + "| ---: " * len(titles) + "|"]
    for row in rows:
        cells = [_mark(cell) for cell in row.cells]
        lines.append(f"| {row.label} | " + " | ".join(cells) + " |")
    versions = ", ".join(f"{name} {version}" for name, version in made["versions"].items())
    return "\n".join(
        [
            f"# {study.title}",
            "",
            study.question,
            "",
            " ".join(outcome(study, rows)),
            "",
            *lines,
            "",
            "In brackets: the goal. In bold: missed.",
            "",
            *(f"- {measure.title}: {measure.meaning}." for measure in study.measures),
            "",
            f"Made {made['date']} from commit {made['commit'] or 'unknown'}, {made['cpus']} CPUs "
            f"({made['machine']}), {versions}, by `{command(study, per_row, rows)}`.",
            "",
        ]
    )


def beside(cell: Cell) -> str:
    """The figure with its goal in brackets."""
    return cell.text if cell.goal is None else f"{cell.text} ({cell.goal})"


def _mark(cell: Cell) -> str:
    text = beside(cell)
    return f"**{text}**" if cell.met is False else text


def terminal(study: Study, rows: Sequence[Row]) -> Table:
    """The figures for a terminal: green where the goal is met, red where it is not.

    Rows of which nothing has been run are left out, unless that is all of them.
    """
    rows = [row for row in rows if row.ended] or rows
    from rich.table import Table
    from rich.text import Text

    drawn = Table(title=study.title, title_justify="left")
    drawn.add_column("", no_wrap=True)
    figures = [
        any(row.cells[i].value is not None for row in rows) for i in range(len(study.measures))
    ]
    for measure in compress(study.measures, figures):
        drawn.add_column(measure.title, justify="right", overflow="fold")
    colour = {True: "green", False: "red", None: ""}
    for row in rows:
        cells = [Text(beside(cell), colour[cell.met]) for cell in compress(row.cells, figures)]
        drawn.add_row(row.label, *cells)
    return drawn
