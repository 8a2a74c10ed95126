"""Draw a validation run as pages that open from disk: no rendering, and no network."""

from pathlib import Path

from plotly.offline import get_plotlyjs

from .disk import write_text
from .pages import TEMPLATES, environment, write_case, write_index
from .read import read_result, read_suite
from .tables import write_csv, write_json, write_junit

__all__ = ["write"]

ASSETS = ("style.css", "report.js", "room.js")


def write(out: Path) -> Path:
    """Draw the report of the run in OUT and return the path of its first page, OUT/index.html.

    Reads OUT/suite.json and OUT/cases/NAME/{result.json, room.npz, fields.npz, view.npz}; a
    case without its arrays gets a page that says so. Writes index.html, assets/ and the cases'
    pages and pictures, and the merged results as report.json, report.csv and junit.xml. Every
    file is replaced whole, so a report can be redrawn while it is being read.

    Raises:
        ValueError: suite.json, or the result.json of a case that it names, is missing or broken.
    """
    out = Path(out)
    suite, suite_content = read_suite(out)
    read = [read_result(out / "cases" / name) for name in suite.cases]
    results = [result for result, _ in read]
    pages = environment()
    for asset in ASSETS:
        write_text(out / "assets" / asset, (TEMPLATES / asset).read_text(encoding="utf-8"))
    write_text(out / "assets" / "plotly.min.js", get_plotlyjs())
    for index in range(len(results)):
        write_case(out, suite, results, index, pages)
    write_json(out, suite_content, [content for _, content in read])
    write_csv(out, results)
    write_junit(out, suite, results)
    return write_index(out, suite, results, pages)
