"""Records read from disk and checked: a sentence says where a file is broken."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from validation.jobs import read_json
from validation.records.part import SCHEMA
from validation.records.result import Result, Suite

Model = TypeVar("Model")


def read_suite(out: Path) -> tuple[Suite, dict[str, Any]]:
    """Read OUT/suite.json; return it checked and as it stands.

    Raises
    ------
    ValueError
        If the file is missing or broken, or a case's name is no folder's name.
    """
    path = out / "suite.json"
    suite, content = read_checked(Suite, path)
    for name in suite.cases:
        if name in ("", ".", "..") or "/" in name or "\\" in name or "\0" in name:
            raise ValueError(f"{path} names a case {name!r}, which is not a folder's name.")
    if len(set(suite.cases)) < len(suite.cases):
        raise ValueError(f"{path} names a case twice.")
    return suite, content


def read_result(folder: Path) -> tuple[Result, dict[str, Any]]:
    """Read the result.json in a case's folder; return it checked and as it stands.

    Raises
    ------
    ValueError
        If the file is missing or broken, or speaks of lights that it does not list.
    """
    path = folder / "result.json"
    if not path.exists():
        raise ValueError(f"{path} is missing; `lightloc validate` goes on where it was stopped.")
    result, content = read_checked(Result, path)
    if result.name != folder.name:
        raise ValueError(f"{path} is the result of another case, {result.name!r}.")
    if result.outcome != "crashed" and (result.lights is None or result.comparison is None):
        raise ValueError(f"{path} has no lights or no comparison, yet its case did not crash.")
    if result.lights is not None and result.comparison is not None:
        true, found = len(result.lights.true), len(result.lights.found)
        pairs = result.comparison.pairs
        named_true = [*result.comparison.missed, *(pair.true for pair in pairs)]
        named_found = [*result.comparison.ghosts, *(pair.found for pair in pairs)]
        if max(named_true, default=-1) >= true or max(named_found, default=-1) >= found:
            raise ValueError(f"{path} compares a light that it does not list.")
    return result, content


def read_checked(model: type[Model], path: Path) -> tuple[Model, dict[str, Any]]:
    """Read one JSON file of this schema; return it checked and as it stands.

    Raises
    ------
    ValueError
        If the file is missing or broken; the sentence says where.
    """
    content = read_json(path)
    if content.get("schema") != SCHEMA:
        raise ValueError(f"{path} has schema {content.get('schema')!r}, and not {SCHEMA}.")
    try:
        return TypeAdapter(model).validate_python(content), content
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(step) for step in first["loc"])
        raise ValueError(f"{path} is broken at {where!r}: {first['msg']}.") from None
