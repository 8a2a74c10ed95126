"""A suite is a TOML file with a row per case."""

from __future__ import annotations

import importlib.resources
import tomllib
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError

Corner = tuple[float, float, float]


class Case(BaseModel):
    """One row: a scene, how it is observed, what must come out and how near.

    ``scene`` is a file, as its path from the suite's folder, or the name of a standard scene.
    ``lights``, rows of [x, y, z, intensity], take the place of the scene's own where given. With
    ``rendered``, the indirect light of what is found is rendered.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$")  # a folder's name
    scene: str
    claim: str
    brdf: Literal["diffuse", "conductor", "plastic", "mixed"]
    parameters: dict[str, float] = {}
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
    gated: bool = True
    closed_form: bool = False  # also judge B itself, in the integrating sphere
    position_percent: float = Field(gt=0)
    intensity_percent: float = Field(gt=0)
    _folder: Path = PrivateAttr(default=Path())  # of the suite

    @property
    def alpha(self) -> float | None:
        return self.parameters.get("alpha")

    @property
    def scene_file(self) -> Path:
        """The file of the scene, whichever folder the suite is run from."""
        own = self._folder / self.scene
        packaged = _packaged(self.scene, ".xml")
        return packaged if packaged and not own.is_file() else own


def read_suite(path: str | Path) -> tuple[str, list[Case]]:
    """(name, cases) of a suite: a TOML file, or the name of one that comes with the package.

    What stands under ``[defaults]`` holds for every row that does not say otherwise.
    Raises ValueError naming the file, the case and the field.
    """
    file = _packaged(str(path), ".toml") or Path(path)
    if not file.is_file():
        raise ValueError(f"{path}: no such suite file")
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: {error}") from None
    defaults = content.get("defaults", {})
    rows = content.get("case", [])
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f"{file}: has no [[case]]")
    if not isinstance(defaults, dict):
        raise ValueError(f"{file}: defaults is no table; expected [defaults]")
    cases = []
    for row in rows:
        try:
            case = Case(**{**defaults, **row})
        except ValidationError as error:
            first = error.errors()[0]
            field = ".".join(str(part) for part in first["loc"]) or "row"
            name = row.get("name", "?")
            raise ValueError(f"{file}: case '{name}': {field}: {first['msg']}") from None
        case._folder = file.parent
        cases.append(case)
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{file}: two cases are called '{name}'")
    return str(content.get("name", file.stem)), cases


def _packaged(name: str, suffix: str) -> Path | None:
    """The file of that name that comes with the package; None where there is none."""
    if Path(name).name != name:
        return None
    file = Path(str(importlib.resources.files("scenes"))) / f"{name.removesuffix(suffix)}{suffix}"
    return file if file.is_file() else None
