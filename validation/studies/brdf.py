"""Study: rooms rendered in one material, and localized as if they were of another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from statistics import median

from validation.jobs import Ended, row_of
from validation.records import Heat, Tile
from validation.studies.brdf_rooms import MATERIALS
from validation.studies.brdf_trial import SURE, brdf
from validation.studies.many import converged
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    Measured,
    at_least,
    at_most,
    bounded,
    duration,
    records,
    tally,
    typical,
)
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study, pooled

ASSUMED = ("diffuse", "ggx3", "plastic3", "coat", "metal", "mixed")
TRANSPORTS = {"direct": "direct light", "full": "with indirect light"}


def names(per_row: int) -> list[str]:
    """All scenes: each material as each of `ASSUMED` and as what it is."""
    rows = [
        f"{rendered}-{assumed}-{transport}"
        for transport, rendered in product(TRANSPORTS, MATERIALS)
        for assumed in dict.fromkeys((rendered, *ASSUMED))
    ]
    return numbered(rows, per_row)


def right_model(record: Fields) -> bool:
    return bool(record["rendered"] == record["assumed"])


def wrong_model(record: Fields) -> bool:
    return not right_model(record)


def right(record: Fields) -> bool:
    """Whether every light is found, within four of its stated standard errors."""
    return record["found"] == record["lights"] and not record["outside"]


def sure_elsewhere(record: Fields) -> bool:
    return converged(record) and bool(record["outside"])


def bias(field: str) -> Measured:
    """The mean of a field over the scenes that have one, with its standard error."""

    def measure(scenes: Sequence[Ended]) -> Figure:
        each = [record[field] for record in records(scenes) if record[field] is not None]
        if not each:
            return NO_FIGURE
        mean = sum(each) / len(each)
        if len(each) == 1:
            return Figure(mean, f"{_short(mean, 2):+g}")
        spread = sum((x - mean) ** 2 for x in each) / (len(each) - 1)
        error = (spread / len(each)) ** 0.5
        return Figure(mean, f"{_short(mean, 2):+g} ± {_short(error, 1):g}", error)

    return measure


def _short(value: float, digits: int) -> float:
    """A value to that many digits, which prints as 10 and not as 1e+01."""
    return float(f"{value:.{digits}g}")


def label(row: str) -> str:
    """A row as a reader meets it.

    Examples
    --------
    >>> label("ggx3-diffuse-direct")
    'rough conductor, GGX α 0.3, as diffuse, direct light'
    """
    rendered, assumed, transport = row.split("-")
    said = "as it is" if rendered == assumed else f"as {MATERIALS[assumed][0]}"
    return f"{MATERIALS[rendered][0]}, {said}, {TRANSPORTS[transport]}"


def doubt(record: Fields) -> str | None:
    """A right model whose lights are not right, or a wrong one that is sure of wrong places."""
    if sure_elsewhere(record):
        return "converged, a light elsewhere"
    return "not right" if right_model(record) and not right(record) else None


def heat(scenes: Sequence[Ended]) -> list[Heat]:
    """A map for each transport: what was rendered by what was assumed, the truth first."""
    cells: dict[str, list[Fields]] = {}
    for record in records(scenes):
        cells.setdefault(row_of(record["name"]), []).append(record)
    return [
        Heat(
            title=said,
            down="rendered",
            across="assumed",
            rows=[title for title, _ in MATERIALS.values()],
            columns=["as it is", *(MATERIALS[name][0] for name in ASSUMED)],
            tiles=[
                [
                    tile(f"{rendered}-{assumed}-{transport}", cells)
                    for assumed in (rendered, *(None if a == rendered else a for a in ASSUMED))
                ]
                for rendered in MATERIALS
            ],
        )
        for transport, said in TRANSPORTS.items()
    ]


def tile(row: str, cells: Mapping[str, list[Fields]]) -> Tile | None:
    """What came out in a cell; None where nothing was run."""
    some = cells.get(row)
    if not some:
        return None
    hits = sum(record["found"] == record["lights"] for record in some)
    far = [record["position"] for record in some if record["position"] is not None]
    text = f"{hits} of {len(some)}" + (f", {median(far):.2g} %" if far else "")
    wrong = any(map(sure_elsewhere, some)) or any(right_model(r) and not right(r) for r in some)
    if wrong:
        return Tile(row, text, "failed")
    return Tile(row, text, "passed" if all(map(right, some)) else "shown")


STUDY = Study(
    name="brdf",
    title="What an assumed material costs",
    question="Rooms with two lights, all six walls of one material, rendered by Mitsuba with 1 % "
    "noise, are localized as if the walls were of that material and of six others, in direct "
    f"light and in all light. Where the material is right, all lights should be within {SURE:g} of "
    "their stated standard errors; where it is wrong, no answer should be sure of a wrong place.",
    per_row=3,
    names=names,
    one=brdf,
    measures=(
        Measure(
            "Right",
            f"all lights found, within {SURE:g} stated standard errors, of scenes whose material "
            "is as assumed",
            bounded(right, right_model),
            {EVERY: at_least(1.0)},
        ),
        Measure(
            "Sure elsewhere",
            "of the others, answers that converged with a true light outside of these errors, or "
            "not found",
            bounded(sure_elsewhere, wrong_model),
            {EVERY: at_most(0.01)},
        ),
        Measure(
            "Right count",
            "as many lights are found as there are",
            bounded(lambda r: r["found"] == r["lights"]),
        ),
        Measure(
            "Position (%)",
            "median of each scene's worst error of a light that was found, percent of the diagonal",
            typical("position"),
        ),
        Measure(
            "Intensity bias (%)",
            "mean by which all lights together are too bright, where the count is right",
            bias("brighter"),
        ),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Says first", "the kind of the first verdict", tally("named")),
        Measure("Median (s)", "of the search on one thread", duration()),
    ),
    label=label,
    said=pooled("Right", "Sure elsewhere", "Right count"),
    doubt=doubt,
    together=True,
    heat=heat,
    solvers=True,
)
