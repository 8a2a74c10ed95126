"""What a case leaves for the report to draw: the room, the fields, the camera's view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import (
    Grid,
    Localization,
    Observations,
    PointLights,
    SolidAngle,
    intensity_distance,
    vote,
)
from lightloc.fields import NO_LIMITER
from lightloc.files import whole
from render import Room

SLICE = 16_000  # cells of the slice through D, L and V: about 140 x 115
MARGIN = 3.0  # standard errors by which D is raised, so that it stays a bound under noise
VOTE_RADIUS = 3  # cells; the limiters of a few thousand scattered points are coarse
VOTE_THRESHOLD = 0.5  # of the radius, where the paper's 0.05 needs sixty thousand points
VIEW_SPP, VIEW_WIDTH = 24, 208  # the picture only; the judge counts on the probes


def save_room(path: Path, room: Room, seen: Observations, found: Localization) -> None:
    """room.npz: triangles, observed points, B(q), residuals in standard errors, and outliers.

    Those are told by the number of their place among the names, from 1.
    """
    vertices, faces = render.triangles(room)
    outlier = np.zeros(len(seen), np.int32)
    for number, group in enumerate(found.outlying, start=1):
        outlier[group.observations] = number
    _save(
        path,
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        points=seen.positions.astype(np.float32),
        normals=seen.normals.astype(np.float32),
        radiance=seen.radiance.astype(np.float32),
        residual=found.residual.mean(axis=1).astype(np.float32),
        outlier=outlier,
        places=np.array([group.place for group in found.outlying], dtype=str),
    )


def save_fields(path: Path, room: Room, seen: Observations, found: Localization) -> None:
    """fields.npz: D, L and V of the direct light on the slice through the brightest true light.

    Where there is none, the slice lies in the middle.
    """
    lower, upper = seen.bounds
    at = room.lights.brightest_first().positions if len(room.lights) else seen.bounds.mean(axis=0)
    lower[2] = upper[2] = np.atleast_2d(at)[0, 2]
    grid = Grid.over([lower, upper], SLICE)
    q = seen.with_radiance(found.direct, found.sigma)
    D, L = intensity_distance(q, grid.points, room.geometry, margin=MARGIN)
    T = VOTE_THRESHOLD * q.diagonal / 2
    V = vote(grid, L[:, 0], SolidAngle(q.positions), T, VOTE_RADIUS).votes

    def image(values: NDArray) -> NDArray[Any]:
        return values.reshape(*grid.shape[:2], *values.shape[1:]).swapaxes(0, 1)

    none = L[:, 0] == NO_LIMITER
    limiter = np.where(none[:, None], np.nan, q.positions[np.where(none, 0, L[:, 0])])
    _save(
        path,
        D=image(D[:, 0]).astype(np.float32),
        L=image(np.where(none, -1, L[:, 0].astype(np.int64))).astype(np.int32),
        limiter=image(limiter).astype(np.float32),
        V=image(V.ravel()).astype(np.float32),
        extent=np.array([lower[0], upper[0], lower[1], upper[1]]),
        height=np.array(lower[2]),
    )


def save_view(folder: Path, room: Room, lights: PointLights, transport: Any, seed: int) -> None:
    """view.exr with all layers, and view.npz with the camera's view twice: true and found lights.

    A scene without a camera has no view, and its page says so.
    """
    if not room.scene.sensors():
        return

    def photograph(lit: Room) -> render.View:
        return render.photograph(
            lit, spp=VIEW_SPP, width=VIEW_WIDTH, seed=seed, transport=transport
        )

    true = photograph(room)
    render.write_exr(true, folder / "view.exr")
    found = photograph(render.relight(room, lights)).film if len(lights) else true.film * 0
    _save(folder / "view.npz", rendered=true.film, rerendered=found)


def _save(path: Path, **arrays: Any) -> None:
    with whole(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **arrays)
