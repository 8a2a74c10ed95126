"""The report's pages: an index with the matrix of cases, and a page per case."""

import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from validation.draw import embedded, room, search_curve
from validation.jobs import write_text
from validation.records import Result, Suite
from validation.report.matrix import matrix
from validation.report.pictures import draw_view
from validation.report.rows import light_marks, light_rows
from validation.report.slices import draw_slices
from validation.report.solvers import solvers
from validation.report.studies import StudyPage

from . import words

TEMPLATES = Path(__file__).parent / "templates"
ORDER = ("failed", "crashed", "shown", "passed")  # what needs a look comes first
FILES = {
    "result.json": "everything on this page",
    "printed.txt": "what the solver printed, and where it raised",
    "view.exr": "the camera's view, for an EXR viewer such as tev",
    "observations.npz": "what the search was given",
    "room.npz": "the room, the observed points and their residuals",
    "fields.npz": "the slices of D, L and V",
    "view.npz": "the camera's view as arrays",
}

Drawn = TypeVar("Drawn")


@dataclass(frozen=True)
class Piece(Generic[Drawn]):
    """A part of a page that may be missing, and the plain sentence that then stands for it."""

    drawn: Drawn | None
    missing: str


def environment() -> Environment:
    """Return the templates, which escape whatever they are given."""
    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    names = (
        "number",
        "percent",
        "measures",
        "seconds",
        "material",
        "noise",
        "plain",
        "briefly",
        "solver",
        "moment",
    )
    made.filters.update({name: getattr(words, name) for name in names})
    made.filters["url"] = lambda text: quote(text, safe="")
    made.filters["in_its_unit"] = words.length
    made.globals.update(symbols=words.SYMBOLS, meanings=words.MEANINGS, order=ORDER)
    return made


def write_index(
    out: Path,
    suite: Suite,
    results: Sequence[Result],
    pages: Environment,
    studies: Sequence[StudyPage] = (),
) -> Path:
    """Write OUT/index.html, with links to the pages of studies that were run."""
    first = sorted(results, key=lambda result: ORDER.index(result.outcome))
    counts = {outcome: sum(r.outcome == outcome for r in results) for outcome in ORDER}
    text = pages.get_template("index.html.j2").render(
        root="",
        suite=suite,
        studies=studies,
        results=first,
        matrix=matrix(results),
        counts=counts,
        unexplained=sum(result.is_unexplained for result in results),
        solvers=solvers(results, ORDER),
        versions=_versions(results),
        downloads=("report.json", "report.csv", "junit.xml"),
    )
    return write_text(out / "index.html", text)


def write_case(
    out: Path, suite: Suite, results: Sequence[Result], index: int, pages: Environment
) -> Path:
    """Write OUT/cases/NAME/index.html and the pictures beside it."""
    result = results[index]
    folder = out / "cases" / result.name
    lights = light_marks(result)
    solid, fields, view = (_load(folder / f"{name}.npz") for name in ("room", "fields", "view"))
    curve = search_curve(result.search.history) if result.search else None
    text = pages.get_template("case.html.j2").render(
        root="../../",
        suite=suite,
        result=result,
        before=results[index - 1] if index > 0 else None,
        after=results[index + 1] if index + 1 < len(results) else None,
        room=_draw(
            solid, lambda arrays: embedded(room(arrays, lights, result.unit)), "the room in 3D"
        ),
        view=_draw(view, lambda arrays: draw_view(folder, arrays), "the camera's view"),
        slices=_draw(
            fields,
            lambda arrays: draw_slices(arrays, solid.drawn, lights, result),
            "the slices",
        ),
        lights=light_rows(result),
        curve=embedded(curve) if curve else None,
        timings=_timings(result),
        files=[(name, text) for name, text in FILES.items() if (folder / name).is_file()],
    )
    return write_text(folder / "index.html", text)


def _load(path: Path) -> Piece[dict[str, Any]]:
    if not path.is_file():
        return Piece(None, f"this case left no {path.name}")
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return Piece({name: arrays[name] for name in arrays.files}, "")
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error):
        return Piece(None, f"{path.name} is broken")


def _draw(
    loaded: Piece[dict[str, Any]], draw: Callable[[dict[str, Any]], Drawn], what: str
) -> Piece[Drawn]:
    if loaded.drawn is None:
        return Piece(None, f"There is no picture of {what}: {loaded.missing}.")
    try:
        return Piece(draw(loaded.drawn), "")
    except KeyError as error:
        return Piece(None, f"There is no picture of {what}: its file lacks {error}.")
    except (ValueError, IndexError, TypeError) as error:
        return Piece(None, f"There is no picture of {what}: {error}.")


def _versions(results: Sequence[Result]) -> dict[str, str]:
    """List what the cases were made with; more than one where a run was taken up again."""
    seen: dict[str, list[str]] = {}
    for result in results:
        made = {**result.made.versions, "commit": result.made.commit}
        for name, version in made.items():
            if version and version not in seen.setdefault(name, []):
                seen[name].append(version)
    return {name: " and ".join(versions) for name, versions in seen.items() if versions}


def _timings(result: Result) -> list[tuple[str, float]]:
    return [(name, s) for name, s in result.seconds.items() if name != "total" and s is not None]
