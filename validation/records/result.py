"""What a validation run leaves on disk: suite.json, and a result.json per case."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from validation.records.part import Count, Made, Part, Real, Reals, Vector

UNKNOWN = "unit"
"""A scene's unit of length of which nobody has said which it is."""

UNEXPLAINED = ("no_gain", "most_lights", "misfit", "out_of_time")
"""Reasons of an answer that says itself that it does not explain the data, or was cut short."""

Outcome = Literal["failed", "crashed", "shown", "passed"]


def no_errors() -> list[float | None]:
    """The standard errors of a position whose errors are not known."""
    return [None, None, None]


Errors = Annotated[
    list[Real],
    BeforeValidator(lambda value: value or no_errors()),
    Field(min_length=3, max_length=3),
]


class TrueLight(Part):
    """A light of the scene: position (3,) and intensity (c,), in the result's unit of length."""

    position: Vector
    intensity: Reals


class FoundLight(TrueLight):
    """A found light with its standard errors and the bound D (Eq. 6) at its position."""

    position_error: Errors = Field(default_factory=no_errors)
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
    remarks: list[str] = Field(default_factory=list)  # of noise, outliers, what was left out


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
    method: str = "search"
    options: dict[str, Any] = Field(default_factory=dict)
    assumed: str = ""  # the scene whose materials the search was told
    metrics: dict[str, Real] = Field(default_factory=dict)  # the user's own
    limits: Limits | None = None
    diagonal: Real = None
    unit: str = "m"  # of length
    power: str = "W/sr"  # what intensities are in
    lights: Lights | None = None
    comparison: Comparison | None = None
    rerender: Rerender | None = None
    closed_form: ClosedForm | None = None
    search: Search | None = None
    seconds: dict[str, Real] = Field(default_factory=dict)
    peak_mb: Real = None
    command: str = ""
    made: Made = Field(default_factory=Made)

    @property
    def is_unexplained(self) -> bool:
        """Whether it passed with an answer that does not believe itself."""
        said = self.search.reason.lower() if self.search else ""
        return self.outcome == "passed" and said in UNEXPLAINED


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
    unexplained: Count = 0
