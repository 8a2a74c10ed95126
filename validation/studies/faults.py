"""Study: rooms of which something is believed that is not so: is it told, and as what?"""

from __future__ import annotations

from collections.abc import Sequence

from validation.jobs import Ended
from validation.studies.fault import fault
from validation.studies.fault_models import MODELS
from validation.studies.many import converged
from validation.studies.measures import (
    NO_FIGURE,
    Fields,
    Figure,
    at_least,
    at_most,
    bounded,
    duration,
    none,
    records,
    tally,
    typical,
    worst,
)
from validation.studies.scenes import numbered
from validation.studies.study import EVERY, Measure, Study, pooled

LABELS = {
    "right": "nothing wrong (control)",
    "firefly": "one firefly",
    "albedo-10": "one albedo ± 10 %",
    "albedo-30": "one albedo ± 30 %",
    "roughness-20": "roughness ± 20 %",
    "roughness-50": "roughness ± 50 %",
    "lambert": "a glossy floor taken for diffuse",
    "normals": "normals 5° off",
    "missing": "a block that is not in the model",
    "extra": "a block that is not there",
    "lamp-walls": "lamps cos^m, m 1 to 15",
    "lamp-floor": "the same over a floor alone",
    "area": "lights 0.4 to 0.8 m wide",
    "window": "a window",
    "gamma": "gamma 2.2",
    "panel": "a panel under the ceiling",
    "led": "an LED over a plane",
}
SOUND = ("right", "firefly")  # rows of which nothing is wrong
KINDS = {  # that name the fault rightly
    "albedo-10": ("MATERIAL",),
    "albedo-30": ("MATERIAL",),
    "roughness-20": ("MATERIAL",),
    "roughness-50": ("MATERIAL",),
    "lambert": ("MATERIAL",),
    "normals": ("GEOMETRY", "MATERIAL"),  # a wall that is turned is a wall that is too bright
    "missing": ("GEOMETRY",),
    "extra": ("GEOMETRY",),
    "lamp-walls": ("EMISSION",),
    "lamp-floor": ("EMISSION",),
    "area": ("EXTENDED",),
    "window": ("OUTSIDE", "EXTENDED"),  # it is wide, too
    "gamma": ("ENCODING",),
    "panel": ("EMISSION", "EXTENDED"),  # it is both
    "led": ("EMISSION",),
}


def row(record: Fields) -> str:
    return str(record["name"]).rpartition("-")[0]


def wrong(record: Fields) -> bool:
    return row(record) not in SOUND


def sound(record: Fields) -> bool:
    return not wrong(record)


def told(record: Fields) -> bool:
    return wrong(record) and bool(record["told"])


def too_many(record: Fields) -> bool:
    return bool(record["found"] > record["lights"] + record["more"])


def sure_of_it(record: Fields) -> bool:
    return too_many(record) and converged(record)


def sure_elsewhere(record: Fields) -> bool:
    """Whether it converged with a true light outside four of its stated standard errors."""
    return converged(record) and bool(record["outside"])


def named(record: Fields) -> bool:
    return record["named"] in KINDS.get(row(record), ())


def slower(scenes: Sequence[Ended]) -> Figure:
    """The time beside that of the right model: of nineteen scenes in twenty no more than this."""
    ratios = [r["seconds"] / r["right_seconds"] for r in records(scenes) if wrong(r)]
    if not ratios:
        return NO_FIGURE
    value = worst(ratios)
    return Figure(value, f"{value:.1f}")


def doubt(record: Fields) -> str | None:
    said = ["too many lights"] * too_many(record)
    said += ["converged, a light elsewhere"] * sure_elsewhere(record)
    if told(record) and not named(record):
        said.append(f"named as {record['named']}")
    if sound(record) and not converged(record):
        said.append(record["reason"])
    return ", ".join(said) or None


STUDY = Study(
    name="faults",
    title="What is believed of the room is wrong",
    question="What becomes of an answer where a material, a normal, an occluder, a lamp or the "
    "encoding is not as believed, with 1 % noise whose standard error every other scene does not "
    "state? No lights should be claimed that are not there, no answer should be sure of a wrong "
    "place, the fault should be named, and it should not take long.",
    per_row=25,
    names=lambda per_row: numbered(list(MODELS), per_row),
    one=fault,
    measures=(
        Measure(
            "Too many",
            "of the scenes with a fault, those with more lights found than there are",
            bounded(too_many, wrong),
            {EVERY: at_most(0.02)},
        ),
        Measure(
            "Sure of them",
            "the same of answers that converged",
            bounded(sure_of_it, wrong),
            {EVERY: none()},
        ),
        Measure(
            "Sure elsewhere",
            "answers that converged with a true light outside four of its stated standard errors "
            "along some axis, or not found",
            bounded(sure_elsewhere),
            {EVERY: at_most(0.01)},
        ),
        Measure("Told", "no fit from the truth explains the data", bounded(told, wrong)),
        Measure(
            "Named first",
            "of those, the answers whose first verdict of a kind of fault is of the right one",
            bounded(named, told),
            {EVERY: at_least(0.85)},
        ),
        Measure(
            "Converged where right",
            "of the scenes without a fault, the answers that converged with the right number",
            bounded(lambda r: converged(r) and r["found"] == r["lights"], sound),
        ),
        Measure("Named", "the first verdict of a kind of fault", tally("named")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure("Median (s)", "of the search on one thread", duration()),
        Measure(
            "of the right model",
            "the same where all is as believed",
            duration(field="right_seconds"),
        ),
        Measure("Slower", "the ratio of the two, 95th percentile", slower, {EVERY: at_most(3.0)}),
        Measure("Max (s)", "of the search on one thread", duration(max)),
    ),
    label=lambda row: LABELS[row],
    said=pooled("Too many", "Sure elsewhere", "Named first"),
    doubt=doubt,
    together=True,
)
