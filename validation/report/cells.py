"""A page for each tile of a study's map: B, the residual, the lights, the command."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jinja2 import Environment

from validation.draw import Light, embedded, unfolded
from validation.jobs import row_of, write_text
from validation.records import Document, Scene
from validation.report.words import intensity

BRIGHT = 0.95  # quantile of B at the bright end of its colours: beside a light it is far more
FAR = 5.0  # standard errors at the ends of the residual's colours
METRES = "m"


def write_cells(study: Document, page: Path, pages: Environment, root: str = "") -> str:
    """Write a page for each row of a study that has a map, in a folder beside the study's page.

    Returns
    -------
    str
        The folder's name; empty where the study has no map.
    """
    if not study.heat:
        return ""
    folder = f"{page.stem}-cells"
    scenes: dict[str, list[Scene]] = {}
    for scene in study.scenes:
        scenes.setdefault(row_of(scene.name), []).append(scene)
    for row in study.rows:
        if row.name in scenes:
            text = pages.get_template("cell.html.j2").render(
                root=f"{root}../",
                back=page.name,
                study=study,
                row=row,
                scenes=scenes[row.name],
                figures=drawn(scenes[row.name]),
                command=f"{study.command.partition(' --row ')[0]} --row {row.name}",
            )
            write_text(page.parent / folder / f"{row.name}.html", text)
    return folder


def drawn(scenes: Sequence[Scene]) -> list[tuple[str, str]]:
    """B and the residual of the first scene that kept them, each with its title."""
    kept = next((one for one in scenes if one.get("walls")), None)
    if kept is None:
        return []
    values = np.frombuffer(base64.b64decode(kept.get("walls")), np.float16).reshape(-1, 5)
    points, B, residual = values[:, :3].astype(float), *values[:, 3:].T.astype(float)
    lights = [
        *(
            Light("true", light[:3], text("true", i, light))
            for i, light in each(kept, "true_lights")
        ),
        *(
            Light("found", light[:3], text("found", i, light))
            for i, light in each(kept, "found_lights")
        ),
    ]
    top = float(np.quantile(B, BRIGHT))
    return [
        ("B(q)", embedded(unfolded(points, B, lights, "B", ("Magma", 0.0, top)))),
        (
            "Residual, standard errors",
            embedded(unfolded(points, residual, lights, "residual", ("RdBu_r", -FAR, FAR))),
        ),
    ]


def each(scene: Scene, field: str) -> enumerate[list[float]]:
    """The lights of a record, numbered from 1."""
    return enumerate(scene.get(field) or [], start=1)


def text(kind: str, number: int, light: Sequence[float]) -> str:
    return f"{kind} light {number}: {intensity(light[3:4], METRES)}"
