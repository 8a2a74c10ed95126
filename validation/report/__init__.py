"""Draw a validation run as pages that open from disk: no rendering, and no network."""

from pathlib import Path

from validation.draw import script
from validation.jobs import write_text
from validation.records import read_result, read_suite
from validation.report.diff import write_diff
from validation.report.pages import TEMPLATES, environment, write_case, write_index
from validation.report.studies import find_all, write_study_page
from validation.report.tables import write_csv, write_json, write_junit

__all__ = ["write", "write_study", "write_diff", "write_junit"]

ASSETS = ("style.css", "report.js", "figures.js")


def write(out: Path) -> Path:
    """Draw the report of the run in OUT and return the path of its first page, OUT/index.html.

    Reads OUT/suite.json and OUT/cases/NAME/{result.json, room.npz, fields.npz, view.npz}; a
    case without its arrays gets a page that says so. Each OUT/studies/NAME/study.json gets a page
    that the first one links to.
    Writes index.html, assets/ and the cases' pages and pictures, and the merged results as
    report.json, report.csv and junit.xml. Every file is replaced whole, so a report can be
    redrawn while it is being read.

    Raises
    ------
        ValueError: suite.json, or the result.json of a case that it names, is missing or broken.
    """
    out = Path(out)
    suite, suite_content = read_suite(out)
    read = [read_result(out / "cases" / name) for name in suite.cases]
    results = [result for result, _ in read]
    pages = environment()
    _write_assets(out)
    for index in range(len(results)):
        write_case(out, suite, results, index, pages)
    write_json(out, suite_content, [content for _, content in read])
    write_csv(out, results)
    write_junit(out, suite, results)
    studies = [
        write_study_page(source, out / f"study-{source.parent.name}.html", pages, suite.suite)
        for source in find_all(out)
    ]
    return write_index(out, suite, results, pages, studies)


def write_study(out: Path) -> Path:
    """Draw OUT/study.json as OUT/index.html, with its assets in the folder above.

    Raises
    ------
        ValueError: the file is missing or broken.
    """
    study = write_study_page(out / "study.json", out / "index.html", environment(), root="../")
    _write_assets(out.parent)
    return study.page


def _write_assets(out: Path) -> None:
    """Copy what all pages share to OUT/assets."""
    for name in ASSETS:
        write_text(out / "assets" / name, (TEMPLATES / name).read_text(encoding="utf-8"))
    write_text(out / "assets" / "plotly.min.js", script())
