"""The page of two runs: what changed from one to the other, and the same the other way round."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from validation.diff import Kind, changes
from validation.jobs import write_text
from validation.records import Result
from validation.report.pages import TEMPLATES, environment

Run = tuple[str, Sequence[Result]]
"""The name of a run, as a user reads it, and its results."""


def write_diff(page: Path, before: Run, after: Run) -> Path:
    """Draw two runs as one page that needs no other file."""
    ways = [
        (one[0], two[0], changes(one[1], two[1])) for one, two in ((before, after), (after, before))
    ]
    text = (
        environment()
        .get_template("diff.html.j2")
        .render(
            ways=ways,
            kinds=list(Kind),
            style=(TEMPLATES / "style.css").read_text(encoding="utf-8"),
        )
    )
    return write_text(page, text)
