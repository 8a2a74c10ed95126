"""What a validation run leaves on disk, read and checked: suite.json and a result.json a case."""

from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from validation.jobs import read_json

SCHEMA = 1
Outcome = Literal["failed", "crashed", "shown", "passed"]
Count = Annotated[int, Field(ge=0)]
Real = float | None  # null where a number was not finite
Reals = Annotated[list[Real], BeforeValidator(lambda value: [] if value is None else value)]
Vector = Annotated[list[Real], Field(min_length=3, max_length=3)]
Vector3Error = Annotated[
    list[Real],
    BeforeValidator(lambda value: value or no_errors()),
    Field(min_length=3, max_length=3),
]


def no_errors() -> list[Real]:
    """Return the standard errors of a position whose errors are not known."""
    return [None, None, None]


class Part(BaseModel):
    """A checked piece of a result; fields of later writers are kept and not drawn."""

    model_config = ConfigDict(extra="allow", frozen=True)


Model = TypeVar("Model", bound=Part)


class TrueLight(Part):
    """A light of the scene: position (3,) in metres, intensity (c,) in W/sr."""

    position: Vector
    intensity: Reals


class FoundLight(TrueLight):
    """A found light with its standard errors and the bound D (Eq. 6) at its position."""

    position_error: Vector3Error = Field(default_factory=no_errors)
    intensity_error: Reals = Field(default_factory=list)
    bound: Reals = Field(default_factory=list)
    resolution: Real = None
    width: Real = None


class Lights(Part):
    """True and found lights of a case."""

    true: list[TrueLight]
    found: list[FoundLight]


class Pair(Part):
    """A true light and the found light matched to it."""

    true: Count
    found: Count
    distance: Real = None
    distance_percent: Real = None
    intensity_percent: Reals = Field(default_factory=list)


class Comparison(Part):
    """The judge's verdict on a case."""

    count_true: Count
    count_found: Count
    count_right: bool
    precision: Real = None
    recall: Real = None
    pairs: list[Pair] = Field(default_factory=list)
    missed: list[Count] = Field(default_factory=list)
    ghosts: list[Count] = Field(default_factory=list)
    worst_position_percent: Real = None
    worst_intensity_percent: Real = None


class Step(Part):
    """One line of the search's history."""

    step: str
    lights: Count | None = None
    chi2: Real = None
    detail: str = ""


class Said(Part):
    """A verdict: what the data can't decide, and about which lights."""

    kind: str
    lights: list[Count] = Field(default_factory=list)
    sentence: str


class Search(Part):
    """How the search went, and the named reason why it stopped."""

    reason: str
    message: str = ""
    history: list[Step] = Field(default_factory=list)
    chi2_per_dof: Real = None
    certificate: Real = None
    verdicts: list[Said] = Field(default_factory=list)


class Rerender(Part):
    """The observations against those that the found lights would give."""

    z_mean: Real = None
    z_std: Real = None
    relative_rms: Real = None


class Limits(Part):
    """What a gated case must keep to."""

    position_percent: Real = None
    intensity_percent: Real = None
    radius_percent: Real = None


class Made(Part):
    """When and with what a case was made."""

    date: str = ""
    commit: str | None = None
    versions: dict[str, str | None] = Field(default_factory=dict)


class MadeOn(Made):
    """When, with what and on what machine it was made."""

    cpus: int | None = None
    machine: str = ""


class ClosedForm(Part):
    """The integrating sphere: z-scores of B, and the direct light recovered (RMS, percent)."""

    z_mean: Real = None
    z_std: Real = None
    direct_rms_percent: Real = None


class Result(Part):
    """One case. A crashed case has no lights, comparison or search."""

    name: str = Field(min_length=1)
    scene: str
    claim: str
    brdf: str
    transport: str
    noise: float
    outcome: Outcome
    alpha: Real = None
    gated: bool = True
    why: list[str] = Field(default_factory=list)
    points: int | None = None
    spp: int | None = None
    rendered: int = 0
    seed: int | None = None
    parameters: dict[str, Any] = Field(default_factory=dict)
    limits: Limits | None = None
    diagonal: Real = None
    lights: Lights | None = None
    comparison: Comparison | None = None
    rerender: Rerender | None = None
    closed_form: ClosedForm | None = None
    search: Search | None = None
    seconds: dict[str, Real] = Field(default_factory=dict)
    peak_mb: Real = None
    command: str = ""
    made: Made = Field(default_factory=Made)


class Suite(Part):
    """The run as a whole; `cases` holds the names in the suite's order."""

    suite: str
    cases: list[str]
    started: str = ""
    seconds: Real = None
    peak_mb: Real = None
    failed: Count
    passed: Count
    shown: Count
    crashed: Count


def read_suite(out: Path) -> tuple[Suite, dict[str, Any]]:
    """Read OUT/suite.json; return it checked and as it stands.

    Raises:
        ValueError: the file is missing or broken, or a case's name is no folder's name.
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

    Raises:
        ValueError: the file is missing or broken, or speaks of lights that it does not list.
    """
    path = folder / "result.json"
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

    Raises:
        ValueError: the file is missing or broken; the sentence says where.
    """
    content = read_json(path)
    if content.get("schema") != SCHEMA:
        raise ValueError(f"{path} has schema {content.get('schema')!r}, and not {SCHEMA}.")
    try:
        return model.model_validate(content), content
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(step) for step in first["loc"])
        raise ValueError(f"{path} is broken at {where!r}: {first['msg']}.") from None
