"""Trials in rooms that another renderer made and saw: one camera, sigma unknown, few lights each.

A room is a file ``NAME.npz`` in one of the folders that the environment variable `FOLDERS` names;
where it names none, there are no trials. Each holds

    vertices (v, 3), faces (f, 3), face_albedo (f,)           diffuse triangles with two sides
    positions, normals, directions (n, 3), albedo (n,)        the points that the camera saw
    direct, total (n, k)                                      their radiance by each light alone
    light_positions (k, 3), light_intensities (k,)            the truth

so that sums of columns are the same room under fewer lights.
"""

from __future__ import annotations

import itertools
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import lightloc
import render
from lightloc import Geometry, Lambert, Localization, Observations, PointLights, cramer_rao
from validation.judge import compare

FOLDERS = "LIGHTLOC_ROOMS"
"""The environment variable: folders of rooms, as PATH names folders of programs."""

TRANSPORTS = {"direct": "direct", "all": "total"}
"""Of a row's name, and the columns that it means."""

FEWEST, MOST = 2, 4
"""Lights of a trial."""

POINTS = 4000
"""Observations, of those that the camera saw."""

TOLD = 0.01
"""A trial counts where the bound allows this, in the unit of length."""


@dataclass(frozen=True)
class CyclesTrial:
    """One room under some of its lights: a line of a study's data.

    Parameters
    ----------
    name
        The row and the subset's number, as ``all-library-007``.
    lights, found
        How many there are, and how many the answer has.
    counted
        Whether the count is right.
    off
        The worst distance of a light from its own, cm; None where the count is wrong.
    intensity
        The worst error of an intensity, percent; None where the count is wrong.
    bound
        The largest Cramér-Rao bound of a position, cm, from the answer's errors.
    due
        Whether the bound is less than 1 cm, so that the count is to be right.
    reason, way
        Why the search stopped, and how interreflected light was treated.
    verdicts
        The kinds of what the data can't decide.
    chi2
        Chi-square per residual, robust.
    seconds
        Of the search, rendering included.
    """

    name: str
    lights: int
    found: int
    counted: bool
    off: float | None
    intensity: float | None
    bound: float
    due: bool
    reason: str
    way: str
    verdicts: list[str]
    chi2: float
    seconds: float


def files() -> dict[str, Path]:
    """The rooms there are, by name."""
    folders = [Path(name) for name in os.environ.get(FOLDERS, "").split(os.pathsep) if name]
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.npz"))}


def subsets(lights: int) -> list[tuple[int, ...]]:
    """All sets of two to four of so many lights, in a fixed order.

    Examples
    --------
    >>> subsets(3)
    [(0, 1), (0, 2), (1, 2), (0, 1, 2)]
    """
    counts = range(FEWEST, MOST + 1)
    return [some for count in counts for some in itertools.combinations(range(lights), count)]


def names(per_row: int) -> list[str]:
    """Trials of each room and kind of light: all subsets, or so many of them evenly spread."""
    found = []
    for room, file in files().items():
        with np.load(file) as seen:
            every = len(subsets(len(seen["light_intensities"])))
        some = np.unique(np.linspace(0, every - 1, min(per_row, every)).round().astype(int))
        found += [f"{kind}-{room}-{i:03d}" for kind in TRANSPORTS for i in some]
    return found


def one(name: str) -> CyclesTrial:
    """One trial: ``all-library-007``."""
    kind, room, number = name.split("-")
    with np.load(files()[room]) as file:
        seen = dict(file)
    some = list(subsets(len(seen["light_intensities"]))[int(number)])
    q = observations(seen, some, kind, int(number))
    space = geometry(seen["vertices"], seen["faces"], seen["face_albedo"])
    clock = time.perf_counter()
    answer = lightloc.localize(q, space)
    return judged(name, answer, truth(seen, some), q, space, time.perf_counter() - clock)


def observations(
    seen: dict[str, NDArray], some: list[int], kind: str, seed: int = 0
) -> Observations:
    """What the camera saw of some lights, at `POINTS` of its points; nobody knows the errors."""
    n = len(seen["positions"])
    rows = np.sort(np.random.default_rng(seed).permutation(n)[:POINTS])
    return Observations(
        positions=seen["positions"][rows],
        normals=seen["normals"][rows],
        directions=seen["directions"][rows],
        radiance=seen[TRANSPORTS[kind]][rows][:, some].sum(axis=1, dtype=float),
        material=Lambert(albedo=seen["albedo"][rows].astype(float)),
        interreflected=kind == "all",
    )


def truth(seen: dict[str, NDArray], some: list[int]) -> PointLights:
    """These lights."""
    return PointLights(seen["light_positions"][some], seen["light_intensities"][some])


def geometry(vertices: NDArray, faces: NDArray, albedo: NDArray) -> Geometry:
    """The room's triangles as a scene that can render: a mesh for each albedo."""
    with tempfile.TemporaryDirectory() as folder:
        parts = []
        for number, value in enumerate(np.unique(albedo)):
            write_ply(Path(folder) / f"{number}.ply", vertices, faces[albedo == value])
            parts.append(
                f'<shape type="ply"><string name="filename" value="{number}.ply"/>'
                '<boolean name="face_normals" value="true"/><bsdf type="twosided">'
                f'<bsdf type="diffuse"><rgb name="reflectance" value="{value:.9g}"/></bsdf>'
                "</bsdf></shape>"
            )
        # a scene without a light is no room; it is not used
        text = f'<scene version="3.0.0">{"".join(parts)}<emitter type="point"/></scene>'
        (Path(folder) / "room.xml").write_text(text)
        return render.load(Path(folder) / "room.xml").geometry


def write_ply(file: Path, vertices: NDArray, faces: NDArray) -> None:
    """Write the vertices that some faces have, and the faces."""
    used, own = np.unique(faces, return_inverse=True)
    rows = np.zeros(len(faces), dtype=[("n", "u1"), ("vertices", "<i4", 3)])
    rows["n"], rows["vertices"] = 3, own.reshape(-1, 3)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(used)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    content = header.encode() + np.asarray(vertices[used], "<f4").tobytes() + rows.tobytes()
    file.write_bytes(content)


def judged(
    name: str,
    answer: Localization,
    true: PointLights,
    q: Observations,
    space: Geometry,
    seconds: float,
) -> CyclesTrial:
    """The answer beside the truth."""
    counted = len(answer.lights) == len(true)
    pairs = compare(answer.lights, true, radius=np.inf).pairs if counted else ()
    bound = cramer_rao(q.with_radiance(q.radiance, answer.sigma, False), true, space)
    least = float(np.linalg.norm(bound.position, axis=1).max())
    brighter = [
        abs(answer.lights.intensities[p.found, 0] / true.intensities[p.true, 0] - 1) for p in pairs
    ]
    return CyclesTrial(
        name=name,
        lights=len(true),
        found=len(answer.lights),
        counted=counted,
        off=100 * max(pair.distance for pair in pairs) if counted else None,
        intensity=100 * float(max(brighter)) if counted else None,
        bound=100 * least,
        due=least < TOLD,
        reason=answer.reason.name,
        way=answer.way.name,
        verdicts=sorted({verdict.kind.name for verdict in answer.verdicts}),
        chi2=float(answer.chi2),
        seconds=round(seconds, 3),
    )
