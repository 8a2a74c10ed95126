"""All results as other programs read them: report.json, report.csv and junit.xml."""

import csv
import json
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from validation.jobs import write_bytes, write_text
from validation.records import SCHEMA, Result, Suite
from validation.report.words import plain

COLUMNS = (
    *("name", "scene", "brdf", "alpha", "transport", "noise", "gated", "outcome"),
    *("count_true", "count_found", "precision", "recall"),
    *("worst_position_percent", "worst_intensity_percent", "z_mean", "z_std", "relative_rms"),
    *("reason", "chi2_per_dof", "certificate", "points", "spp", "rendered", "seed"),
    *("method", "is_unexplained"),
    *("seconds", "peak_mb", "diagonal", "why", "claim", "command", "date", "commit"),
)


def write_json(out: Path, suite: dict[str, Any], cases: Sequence[dict[str, Any]]) -> Path:
    """Write OUT/report.json: the suite's file and every case's result, merged."""
    merged = {"schema": SCHEMA, "suite": suite, "cases": list(cases)}
    text = json.dumps(merged, indent=1, ensure_ascii=False, allow_nan=False)
    return write_text(out / "report.json", text + "\n")


def write_csv(out: Path, results: Sequence[Result]) -> Path:
    """Write OUT/report.csv: a header and a line per case, empty where there is no number."""
    text = StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_csv_row(result) for result in results)
    return write_text(out / "report.csv", text.getvalue())


def write_junit(out: Path, suite: Suite, results: Sequence[Result]) -> Path:
    """Write OUT/junit.xml: failed is a failure, crashed an error, shown passes with a note."""
    root = ElementTree.Element(
        "testsuite",
        name=plain(suite.suite),
        tests=str(len(results)),
        failures=str(sum(result.outcome == "failed" for result in results)),
        errors=str(sum(result.outcome == "crashed" for result in results)),
        skipped="0",
        time=f"{suite.seconds or 0.0:.3f}",
        timestamp=plain(suite.started),
    )
    for result in results:
        case = ElementTree.SubElement(
            root,
            "testcase",
            classname=plain(result.scene),
            name=plain(result.name),
            time=f"{result.seconds.get('total') or 0.0:.3f}",
        )
        why = plain("\n".join(result.why))
        if result.outcome in ("failed", "crashed"):
            kind = "failure" if result.outcome == "failed" else "error"
            message = why.strip().splitlines()[-1 if kind == "error" else 0] if why.strip() else ""
            note = ElementTree.SubElement(case, kind, message=message or result.outcome)
            note.text = f"{plain(result.claim)}\n{why}\nrepeat with: {plain(result.command)}"
        elif result.outcome == "shown":
            note = ElementTree.SubElement(case, "system-out")
            note.text = f"Shown, and not gated. {why}".strip()
    ElementTree.indent(root)
    return write_bytes(
        out / "junit.xml", ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    )


def _csv_row(result: Result) -> dict[str, Any]:
    row: dict[str, Any] = {}
    parts = (result.search, result.rerender, result.comparison, result.made, result)
    for part in parts:  # later parts win, so that a name of the case itself is the case's
        if part is not None:
            row.update({key: getattr(part, key) for key in COLUMNS if hasattr(part, key)})
    row["seconds"] = result.seconds.get("total")
    row["why"] = " | ".join(result.why)
    return row
