"""Study: models that are wrong in one way each: how far off, how many ghosts, and is it noticed."""

from __future__ import annotations

from collections.abc import Sequence

from validation.records import Row
from validation.studies import scenes, wrong_models
from validation.studies.measures import (
    Fields,
    at_least,
    duration,
    none,
    share,
    tally,
    total,
    typical,
    worst,
)
from validation.studies.study import Measure, Study

LABELS = {
    "right": "nothing wrong (control)",
    "albedo_by_wall": "albedo 10 % off, smooth on a wall",
    "albedo_by_point": "albedo 10 % off, by point",
    "normals_by_wall": "normals 5° off, by wall",
    "normals_by_point": "normals 5° off, by point",
    "alpha": "α 20 % off (3D, metal and plastic)",
    "outliers": "5 % outliers",
    "area": "lights 5 % of the side wide",
}
WRONG = [row for row in wrong_models.MODELS if row != "right"]


def noticed(record: Fields) -> bool:
    """Whether the answer says that the model does not explain the data."""
    named = {"UNEXPLAINED", "EXTENDED"}.intersection(record["verdicts"])
    return record["reason"] == "NO_GAIN" or bool(named)


def doubt(record: Fields) -> str | None:
    said = [] if noticed(record) or record["name"].startswith("right-") else ["not noticed"]
    ghosts = record["ghosts"]
    said += [f"{ghosts} ghost{'s' * (ghosts > 1)}"] * bool(ghosts)
    said += [f"{record['missed']} missed"] * bool(record["missed"])
    return ", ".join(said) or None


def said(rows: Sequence[Row]) -> str:
    ghosts, moved, unflagged = (
        sum(row.cell(title).value or 0 for row in rows)
        for title in ("Ghosts", "From the truth", "Unflagged")
    )
    return (
        f"{ghosts:.0f} ghost lights in all, {unflagged:.0f} of them without a verdict; a fit that "
        f"starts at the true lights, their number told, has {moved:.0f}."
    )


STUDY = Study(
    name="wrong",
    title="Wrong models",
    question="What becomes of the answer where the model of the room is wrong? The answer should "
    "say that the model does not explain the data, and no ghost lights should appear. The data "
    "state 1 % noise, and have it.",
    per_row=50,
    names=lambda per_row: scenes.numbered(list(wrong_models.MODELS), per_row),
    one=wrong_models.wrong,
    measures=(
        Measure(
            "Noticed",
            "the answer says that the model does not explain the data",
            share(noticed),
            dict.fromkeys(WRONG, at_least(1.0)) | {"right": none()},
        ),
        Measure(
            "Ghosts",
            "found lights that lie near no true one, in all scenes",
            total("ghosts"),
            none(),
        ),
        Measure(
            "From the truth",
            "ghosts that a fit leaves which starts at the true lights, their number told: the "
            "wrong model explains more with them there",
            total("displaced"),
        ),
        Measure(
            "Too many",
            "scenes in which more lights are found than there are",
            share(lambda record: record["found"] > record["lights"]),
        ),
        Measure("Unflagged", "ghosts that no verdict names", total("unflagged")),
        Measure(
            "Missed", "true lights that no found one lies near, in all scenes", total("missed")
        ),
        Measure(
            "Position (%)",
            "median of each scene's worst error, percent of the side",
            typical("position"),
        ),
        Measure(
            "Position 95th", "of those errors, the 95th percentile", typical("position", worst)
        ),
        Measure("Intensity (%)", "median of each scene's worst error", typical("intensity")),
        Measure(
            "Intensity 95th", "of those errors, the 95th percentile", typical("intensity", worst)
        ),
        Measure("χ²", "median of chi-square per residual", typical("chi2")),
        Measure("Reasons", "why the searches stopped", tally("reason")),
        Measure("Verdicts", "scenes with a verdict of that kind", tally("verdicts")),
        Measure("Median (s)", "of the search on one thread", duration()),
    ),
    label=lambda row: LABELS[row],
    said=said,
    doubt=doubt,
    solvers=True,
)
