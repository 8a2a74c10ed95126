"""The fields of a `Localization`, by name, as plain values and as a file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lightloc.answer.basis import Assumption, Count, Noise, NoiseLaw, Way
from lightloc.answer.departed import Departed
from lightloc.answer.outliers import Outliers, Where
from lightloc.answer.verdicts import Kind, Verdict
from lightloc.files import archive, whole
from lightloc.given import Limits, PointLights

FORMAT = "lightloc-localization-1"

ARRAYS = (
    *("position_error", "intensity_error", "covariance", "bound", "resolution", "width"),
    *("residual", "direct", "sigma", "ambient"),
)
"""Fields that are arrays."""

LAW = ("read", "shot", "relative", "read_error", "shot_error", "relative_error")
"""Fields of the noise's law, as yet unknown to the first files of this format."""


def plain(found: Mapping[str, Any]) -> dict[str, Any]:
    """The answer without what it says of each observation, as JSON has it; None where unknown."""
    rows = zip(
        found["lights"].positions,
        found["lights"].intensities,
        found["position_error"],
        found["intensity_error"],
        found["bound"],
        found["width"],
        strict=True,
    )
    names = ("position", "intensity", "position_error", "intensity_error", "bound", "width")
    return {
        "format": FORMAT,
        "unit": found["lights"].unit,
        "intensity_unit": found["lights"].power,
        "lights": [
            {"light": i} | dict(zip(names, map(known, row), strict=True))
            for i, row in enumerate(rows, 1)
        ],
        "reason": found["reason"].name,
        "verdicts": [
            {"kind": v.kind.name, "lights": [i + 1 for i in v.lights], "sentence": v.sentence}
            for v in found["verdicts"]
        ],
        "chi2": known(found["chi2"]),
        "certificate": known(found["certificate"]),
        "ambient": known(found["ambient"]),
        "noise": {
            "law": found["noise"].law.name,
            "scale": known(found["noise"].scale),
            "scale_error": known(found["noise"].scale_error),
            "outliers": int(found["noise"].outliers.sum()),
            "share": known(found["noise"].share),
            **{name: known(getattr(found["noise"], name)) for name in LAW},
        },
        "limits": {
            "clipped": int(found["limits"].clipped.sum()),
            "floored": int(found["limits"].floored.sum()),
            "step": found["limits"].step,
        },
        "outlying": [
            {
                "where": group.where.name,
                "surface": group.surface,
                "observations": len(group.observations),
            }
            for group in found["outlying"]
        ],
        "counts": [
            {
                "lights": len(c.lights),
                "chi2": known(c.chi2),
                "likely": known(c.likely),
                "allowed": c.allowed,
            }
            for c in found["counts"]
        ],
        "relative": found["relative"],
        "assumed": [assumption.name for assumption in found["assumed"]],
        "way": found["way"].name,
        "why": found["why"],
        "departures": [
            {
                "kind": d.kind.name,
                "name": d.name,
                "values": known(d.values),
                "errors": known(d.errors),
                "share": known(d.share),
                "sentence": d.sentence,
            }
            for d in found["departures"]
        ],
    }


def known(value: Any) -> Any:
    """Numbers, or an array of any shape, as JSON has them: None where one is not finite.

    Examples
    --------
    >>> known(np.array([1.5, np.nan]))
    [1.5, None]
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list):
        return [known(v) for v in value]
    return value if math.isfinite(value) else None


def write(found: Mapping[str, Any], path: str | Path) -> None:
    """Write ``.npz``: `plain` as JSON under ``answer``, and all that is an array by its name."""
    answer = plain(found) | {
        "verdicts": [
            {"kind": v.kind.name, "lights": list(v.lights), "sentence": v.sentence}
            for v in found["verdicts"]
        ],
        "chi2": found["chi2"],
        "certificate": found["certificate"],
        "inseparable": found["inseparable"],
        "history": [vars(step) for step in found["history"]],
    }
    keys: dict[str, Any] = {"format": np.array(FORMAT), "answer": np.array(json.dumps(answer))}
    keys |= {name: found[name] for name in ARRAYS}
    keys |= {"outliers": found["noise"].outliers}
    keys |= {"clipped": found["limits"].clipped, "floored": found["limits"].floored}
    for i, group in enumerate(found["outlying"]):
        keys[f"outlying.{i}"] = group.observations
    sets = {"": found["lights"]} | {f"counts.{i}.": c.lights for i, c in enumerate(found["counts"])}
    for prefix, lights in sets.items():
        keys[f"{prefix}positions"] = lights.positions
        keys[f"{prefix}intensities"] = lights.intensities
    with whole(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, **keys)


def read(path: str | Path) -> dict[str, Any]:
    """What `write` wrote; of the reason and the steps, their plain values.

    Raises ValueError naming the file where it is missing, broken or of another format, and KeyError
    where a field is missing or unknown.
    """
    keys = archive(path, "localization", (FORMAT,))

    try:
        answer = json.loads(str(keys["answer"]))
    except json.JSONDecodeError:
        raise ValueError(f"{path}: field answer is no JSON") from None

    def lights(prefix: str = "") -> PointLights:
        own = answer["unit"], answer["intensity_unit"]
        return PointLights(keys[f"{prefix}positions"], keys[f"{prefix}intensities"], *own)

    noise, counts = answer["noise"], answer["counts"]
    found = lights()
    (k, c), shape = found.intensities.shape, keys["residual"].shape
    for name, want in {
        **dict.fromkeys(("resolution", "width"), (k,)),
        **dict.fromkeys(("intensity_error", "bound"), (k, c)),
        **dict.fromkeys(("direct", "sigma", "outliers"), shape),
        "position_error": (k, 3),
        **dict.fromkeys(("clipped", "floored"), shape[:1]),
        "ambient": shape[1:],
    }.items():
        if keys[name].shape != want:
            raise ValueError(f"{path}: {name} has shape {keys[name].shape}; expected {want}")
    pairs = [tuple(pair) for pair in answer["inseparable"]]
    of = [i for each in (*pairs, *(v["lights"] for v in answer["verdicts"])) for i in each]
    if not all(i in range(k) for i in of) or any(len(pair) != 2 for pair in pairs):
        raise ValueError(f"{path}: names a light that it does not hold")
    return {
        "lights": found,
        **{name: keys[name] for name in ARRAYS},
        **{name: answer[name] for name in ("chi2", "certificate", "relative")},
        "inseparable": tuple(pairs),
        "verdicts": tuple(
            Verdict(Kind[v["kind"]], tuple(v["lights"]), v["sentence"]) for v in answer["verdicts"]
        ),
        "noise": Noise(
            NoiseLaw[noise["law"]],
            np.array(noise["scale"], float),
            np.array(noise["scale_error"], float),
            keys["outliers"],
            noise.get("share", float(keys["outliers"].mean())),
            **{name: np.array(noise.get(name, [None] * c), float) for name in LAW},
        ),
        "limits": Limits(keys["clipped"], keys["floored"], float(answer["limits"]["step"])),
        "outlying": tuple(
            Outliers(Where[group["where"]], keys[f"outlying.{i}"], group["surface"])
            for i, group in enumerate(answer["outlying"])
        ),
        "counts": tuple(
            Count(
                lights(f"counts.{i}."), c["chi2"], c["likely"], c.get("allowed", c["likely"] == 1)
            )
            for i, c in enumerate(counts)
        ),
        "assumed": tuple(Assumption[name] for name in answer["assumed"]),
        "way": Way[answer["way"]],
        "why": str(answer.get("why", "")),
        "departures": tuple(
            Departed(
                Kind[d["kind"]],
                d["name"],
                np.array(d["values"], float),
                np.array(d["errors"], float),
                d["share"],
                d["sentence"],
            )
            for d in answer.get("departures", ())
        ),
        "reason": answer["reason"],
        "history": answer["history"],
    }
