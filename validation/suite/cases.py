"""A suite is a TOML file with a row per case."""

from __future__ import annotations

import importlib.resources
import os
import tomllib
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError

from lightloc import Options, Paper
from lightloc.checks import printable
from lightloc.files import regular
from validation.methods import MEMORY_MB, SECONDS, Method

LARGEST, LONGEST = 1_000_000, 10_000  # else reading it takes minutes
Corner = tuple[float, float, float]


class Case(BaseModel):
    """One row: a scene, how it is observed, what must come out and how near.

    ``scene`` is a file, as its path from the suite's folder, or the name of a standard scene.
    ``lights``, rows of [x, y, z, intensity], take the place of the scene's own where given. With
    ``rendered``, the indirect light of what is found is rendered.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: str = Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$")  # a folder's name
    scene: str
    claim: str
    brdf: str = Field(min_length=1, max_length=40)  # the kind of material, as the report names it
    parameters: dict[str, float | str] = {}
    find: Literal["point"] | tuple[str, ...] = "point"  # or the ids of the lights to be found
    unit: str | None = None  # of length
    lights: tuple[tuple[float, float, float, float], ...] = ()
    transport: Literal["direct", "full"] = "direct"
    noise: float = Field(0.0, ge=0, lt=1)
    points: int = Field(4096, ge=1, le=200_000)
    spp: int = Field(256, ge=2, le=65_536)
    rendered: int = Field(0, ge=0, le=65_536)  # samples per light; 0: footnote 1 alone
    bounds: tuple[Corner, Corner] | None = None  # of the region that may hold lights
    seed: int = Field(0, ge=0)
    method: str = "search"  # or paper, or a function: module:function or file.py:function
    options: dict[str, Any] = {}  # of lightloc.Options, or of lightloc.Paper
    assumed: str = ""  # a scene of the same shapes, whose materials the search is told
    assumed_parameters: dict[str, float | str] = {}
    metric: str = ""  # a function of yours: module:function or file.py:function
    metric_most: float | None = None  # what the metric must not exceed
    repeats: int = Field(1, ge=1, le=1000)  # with the seeds that follow
    seconds: float = Field(SECONDS, gt=0)  # that a solver may take; ours, where a row says so
    memory_mb: int = Field(MEMORY_MB, ge=256)
    gated: bool = True
    closed_form: bool = False  # also judge B itself, in the integrating sphere
    position_percent: float = Field(gt=0)
    intensity_percent: float = Field(gt=0)
    _folder: Path = PrivateAttr(default=Path())  # of the suite
    _row: str = PrivateAttr(default="")
    _asked: bool = PrivateAttr(default=False)

    @property
    def alpha(self) -> float | None:
        value = self.parameters.get("alpha")
        return None if isinstance(value, str) else value

    @property
    def row(self) -> str:
        """The name in the suite's file: of a case by one of several methods, without the method."""
        return self._row or self.name

    @property
    def asked(self) -> bool:
        """Whether the method is the command line's, not the suite's."""
        return self._asked

    @property
    def solver(self) -> Method:
        """What finds the lights; looked for in the suite's folder."""
        return Method.of(self.method, self._folder)

    @property
    def measure(self) -> Method | None:
        """The function that measures the answer; looked for in the suite's folder."""
        return Method.of(self.metric, self._folder) if self.metric else None

    @property
    def scene_file(self) -> Path:
        """The file of the scene, whichever folder the suite is run from."""
        return self._file(self.scene)

    @property
    def assumed_file(self) -> Path | None:
        """That of the scene whose materials the search is told; None where they are its own."""
        return self._file(self.assumed) if self.assumed else None

    def _file(self, scene: str) -> Path:
        own, packaged = self._folder / scene, _packaged(scene, ".xml")
        return packaged if packaged and not os.path.isfile(own) else own


def read_suite(path: str | Path) -> tuple[str, list[Case]]:
    """(name, cases) of a suite: a TOML file, or the name of one that comes with the package.

    What stands under ``[defaults]`` holds for every row that does not say otherwise.
    Raises ValueError naming the file, the case and the field.
    """
    file = _packaged(str(path), ".toml") or Path(path)
    if not os.path.exists(file):  # no error of a name that no file could have
        raise ValueError(f"{path}: no such suite file")
    try:
        text = regular(file).read_text(encoding="utf-8")
        if len(text) > LARGEST or max(map(len, text.split("\n"))) > LONGEST:
            raise ValueError(f"is longer than {LARGEST} characters, or a line than {LONGEST}")
        content = tomllib.loads(text)
    except RecursionError:
        raise ValueError(f"{file}: is nested too deep") from None
    except (OSError, ValueError) as error:
        said = str(error).removeprefix(f"{file}: ")
        raise ValueError(f"{file}: {printable(said)}") from None
    defaults = content.get("defaults", {})
    rows = content.get("case", [])
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"{file}: has no [[case]]")
    if not isinstance(defaults, dict):
        raise ValueError(f"{file}: defaults is no table; expected [defaults]")
    for key in defaults:
        if key not in Case.model_fields:
            near = get_close_matches(key, Case.model_fields, n=1)
            also = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(printable(f"{file}: [defaults]: there is no key '{key}'{also}"))
    cases = []
    for row in rows:
        try:
            case = Case(**{**defaults, **row})
        except ValidationError as error:
            said = printable(f"case '{row.get('name', '?')}': {wrong(error)}")
            raise ValueError(f"{file}: {said}") from None
        case._folder = file.parent
        try:
            case.solver, settings(case)  # what is none is said before any case runs
            if case.measure and case.measure.is_own:
                raise ValueError(f"metric '{case.metric}': expected a function of yours")
        except ValueError as error:
            said = printable(f"case '{case.name}': {error}")
            raise ValueError(f"{file}: {said}") from None
        cases += repeated(case)
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{file}: two cases are called '{name}'")
    name = content.get("name", file.stem)
    if not isinstance(name, str):
        raise ValueError(f"{file}: its name is no text")
    return name, cases


def repeated(case: Case) -> list[Case]:
    """The case as often as its row asks for, each time with the next seed: box_one-r1, -r2."""
    if case.repeats == 1:
        return [case]
    each = []
    for i in range(case.repeats):
        one = case.model_copy(update={"name": f"{case.name}-r{i + 1}", "seed": case.seed + i})
        each.append(one)
    return each


def by_methods(rows: Sequence[Case], methods: Sequence[str], folder: Path) -> list[Case]:
    """The rows by each of the methods in place of their own, which are looked for in a folder.

    Of several, a case goes by its row's name and the method's: box_one--grid.

    Raises ValueError where a method is none, or two go by one name.
    """
    named = [Method.of(text, folder) for text in methods]
    labels = [one.label for one in named]
    for label in labels:
        if labels.count(label) > 1:
            raise ValueError(f"--method: two go by the name '{label}'")
    result = []
    for one in named:
        for row in rows:
            name = row.name if len(named) == 1 else f"{row.name}--{one.label}"
            options = row.options if one.name == row.method else {}
            case = row.model_copy(update={"name": name, "method": one.said, "options": options})
            case._row, case._asked = row.name, True
            result.append(case)
    return result


def wrong(error: ValidationError) -> str:
    """What is wrong with a row: of a key that there is not, the nearest that there is."""
    first = error.errors()[0]
    field = ".".join(str(part) for part in first["loc"]) or "row"
    if first["type"] != "extra_forbidden":
        return f"{field}: {first['msg']}"
    near = get_close_matches(field, Case.model_fields, n=1)
    return f"there is no key '{field}'{f'; did you mean {near[0]}?' if near else ''}"


def settings(case: Case) -> Options | Paper | None:
    """The row's options; None where it has none, or its method takes none.

    Raises ValueError where the method does not have one, or not such a value.
    """
    if not case.options:
        return None
    if not case.solver.is_own:
        raise ValueError(f"options: method '{case.method}' takes none")
    kind = Paper if case.method == "paper" else Options
    for name in case.options:
        if name not in kind.__dataclass_fields__:
            near = get_close_matches(name, kind.__dataclass_fields__, n=1)
            also = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(f"options: there is no '{name}'{also}")
    values: Any = {k: tuple(v) if isinstance(v, list) else v for k, v in case.options.items()}
    try:
        return Paper(**values) if case.method == "paper" else Options(**values)
    except TypeError as error:
        raise ValueError(f"options: {error}") from None


def is_packaged(suite: str) -> bool:
    """Whether it is the name of a suite that comes with the package."""
    return _packaged(suite, ".toml") is not None


def _packaged(name: str, suffix: str) -> Path | None:
    """The file of that name that comes with the package; None where there is none."""
    if Path(name).name != name:
        return None
    file = Path(str(importlib.resources.files("scenes"))) / f"{name.removesuffix(suffix)}{suffix}"
    return file if os.path.isfile(file) else None
