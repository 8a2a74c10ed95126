"""The room in 3D: its edges, the observed points in colour, and the lights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from validation.draw.marks import GREEN, OUTLIER, Light, light_traces
from validation.draw.mesh import creases, strokes
from validation.draw.page import QUIET, bar, decades, figure, measured

POINTS_MOST, MANY = 20_000, 15_000  # a browser turns so many smoothly; of so many, small ones
FACES_MOST = 100_000  # beyond it the walls' edges are drawn, and not their faces
MERGE = 1e-6  # of the diagonal: vertices closer than that are one
DECADES_MOST = 3.0  # of radiance in the colour bar; darker points take its lowest colour
ON_WALL = 1e-4  # of the diagonal: a point closer to the bounding box than that is on a wall
RESIDUAL_LIMIT = 4.0  # standard errors at the ends of the residual's colour bar
SHADES = ["#343a42", "#ffffff"]  # of B: grey, so that lights stand out in their colours
RESIDUALS = ["#69b7ff", "#3f78b5", "#6a7078", "#b5742a", "#ffae42"]  # from blue to orange
PADDING = 0.04  # of the diagonal, around the room
EYE = np.array([-0.55, -1.02, 0.6])  # of the room's diagonal, from its middle
BAR = {"len": 0.7, "x": 1, "xpad": 4, "xanchor": "right"}
BARE = dict.fromkeys(("showbackground", "showgrid", "zeroline", "showspikes"), False)

Array = NDArray[Any]


def room(arrays: Mapping[str, Array], lights: Sequence[Light], unit: str = "m") -> go.Figure:
    """Draw room.npz's arrays and a case's lights, lengths being in a unit.

    Points (m, 3) carry their normals in `customdata`, inwards: the file's, else the bounding box's
    for points on it, else 0. By them the page leaves out points that turn their back to the viewer.

    Raises
    ------
    ValueError
        An array has the wrong shape, or a face names no vertex.
    """
    vertices, faces = _mesh(arrays)
    points = _shaped("points", arrays["points"], 3)
    radiance = arrays["radiance"].reshape(len(points), -1).mean(axis=1)
    residual = arrays.get("residual", np.full(len(points), np.nan)).ravel()
    if residual.size != len(points):
        raise ValueError(f"residual has {residual.size} values for {len(points)} points")
    every = np.concatenate([vertices, points])
    every = every[np.isfinite(every).all(axis=1)]
    if len(every) == 0:
        raise ValueError("it holds no finite point")
    low, high = every.min(axis=0), every.max(axis=0)
    diagonal = float(np.linalg.norm(high - low))
    normals = _normals(arrays.get("normals"), points, low, high)
    seen = slice(None, None, max(1, -(-len(points) // POINTS_MOST)))
    said = np.column_stack([normals, radiance, residual])[seen].astype(np.float32)
    looks = [_brightness(radiance[seen])]
    looks += [_residual(residual[seen])] if np.isfinite(residual).any() else []
    dots = [_dots(points[seen], said, look) for look in looks]
    for other in dots[1:]:
        other.visible = "legendonly"  # until the page's buttons ask for it
    edges = strokes(creases(vertices, faces, MERGE * diagonal))
    still = [
        _faces(vertices, faces if len(faces) <= FACES_MOST else faces[:0]),
        _lines(edges, "#5d6875", 2),
        _lines(_links(lights), GREEN, 4),
        *light_traces(lights, go.Scatter3d),
        *_outliers(points, arrays.get("outlier"), arrays.get("places")),
    ]
    shown = figure([*dots, *still], **_space(low, high, PADDING * diagonal, unit))
    if len(said) < len(points):
        note = f"{len(said):,} of {len(points):,} points are drawn"
        at = {"x": 0, "y": 1, "xref": "paper", "yref": "paper"}
        shown.add_annotation(text=note, showarrow=False, **at)
    return shown


def _normals(normals: Array | None, points: Array, low: Array, high: Array) -> Array:
    if normals is not None and normals.shape == points.shape:
        return normals
    near = ON_WALL * float(np.linalg.norm(high - low))
    return (np.abs(points - low) < near) * 1.0 - (np.abs(points - high) < near)


def _dots(points: Array, said: Array, look: dict[str, Any]) -> go.Scatter3d:
    return go.Scatter3d(
        **_axes(points.T),
        mode="markers",
        marker={"size": 2.5 if len(points) > MANY else 3.2, **look},
        customdata=said,
        hovertemplate="B %{customdata[3]:.3~r}<br>z %{customdata[4]:.2f}<extra></extra>",
        showlegend=False,
    )


def _brightness(radiance: Array) -> dict[str, Any]:
    lit = radiance[np.isfinite(radiance) & (radiance > 0)]
    top = float(np.log10(lit.max())) if lit.size else 0.0
    low = max(float(np.log10(lit.min())), top - DECADES_MOST) if lit.size else -1.0
    high = top if top > low else low + 1
    dark = np.where(np.isfinite(radiance), 10**low, np.nan)
    return {
        "color": np.log10(np.where(radiance > 10**low, radiance, dark)).astype(np.float32),
        "cmin": low,
        "cmax": high,
        "colorscale": SHADES,
        "colorbar": bar("B in W·sr⁻¹·m⁻²", "right", **BAR, **decades(low, high)),
    }


def _residual(residual: Array) -> dict[str, Any]:
    return {
        "color": residual.astype(np.float32),
        "cmin": -RESIDUAL_LIMIT,
        "cmax": RESIDUAL_LIMIT,
        "colorscale": RESIDUALS,
        "colorbar": bar("residual in standard errors", "right", **BAR),
    }


def _outliers(points: Array, outlier: Array | None, places: Array | None) -> list[go.Scatter3d]:
    """Crosses on the outliers: ``outlier`` (m,) is the number of each one's place, from 1."""
    if outlier is None or places is None:
        return []
    if outlier.shape != points.shape[:1]:
        raise ValueError(f"outlier has {outlier.size} values for {len(points)} points")
    shown = [(place, points[outlier == i]) for i, place in enumerate(places.tolist(), start=1)]
    symbol, colour = OUTLIER
    mark = {"symbol": symbol, "size": 5, "color": colour}
    return [
        go.Scatter3d(
            **_axes(at.T),
            mode="markers",
            marker=mark,
            name="outlier",
            showlegend=not i,
            legendgroup="outlier",
            hovertext=f"outlier, {place}",
            hoverinfo="text",
        )
        for i, (place, at) in enumerate(shown)
        if len(at)
    ]


def _faces(vertices: Array, faces: Array) -> go.Mesh3d:
    i, j, k = faces.T.astype(np.int32)
    look = {"color": "#aab4c0", "opacity": 0.06, "flatshading": True}
    return go.Mesh3d(**_axes(vertices.T), i=i, j=j, k=k, hoverinfo="skip", **look)


def _lines(at: Array, colour: str, width: float) -> go.Scatter3d:
    line = {"color": colour, "width": width}
    return go.Scatter3d(**_axes(at), mode="lines", line=line, hoverinfo="skip", showlegend=False)


def _links(lights: Sequence[Light]) -> Array:
    """From each found light to its true one."""
    pairs = [(light.partner, light.at) for light in lights if light.partner is not None]
    return strokes(np.array(pairs, dtype=float).reshape(-1, 2, 3))


def _axes(at: Array) -> dict[str, Array]:
    return dict(zip("xyz", at.astype(np.float32), strict=True))


def _space(low: Array, high: Array, padding: float, unit: str) -> dict[str, Any]:
    """The unit along each axis, the same length, seen from above a corner."""
    size = high - low + 2 * padding
    aspect = size / size.max()
    look = {**BARE, "color": QUIET, "nticks": 5, "tickfont": {"size": 10}}
    axes = {
        f"{name}axis": {
            **look,
            "range": [*ends],
            "title": {"text": measured(name, unit), "font_size": 11},
        }
        for name, ends in zip("xyz", np.stack([low - padding, high + padding], axis=1), strict=True)
    }
    camera = {"eye": _axes(EYE * np.linalg.norm(aspect)), "center": {"x": 0, "y": 0, "z": -0.09}}
    return {
        "margin": dict.fromkeys("lrtb", 0),
        "legend": {"y": 0, "yanchor": "bottom"},
        "scene": {
            **axes,
            "domain": {"x": [0, 0.88]},
            "aspectmode": "manual",
            "aspectratio": _axes(aspect),
            "camera": camera,
        },
    }


def _mesh(arrays: Mapping[str, Array]) -> tuple[Array, Array]:
    vertices = _shaped("vertices", arrays["vertices"], 3)
    faces = _shaped("faces", arrays["faces"], 3).astype(np.int64)
    if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
        raise ValueError("a face names a vertex that does not exist")
    return vertices, faces


def _shaped(name: str, array: Array, width: int) -> Array:
    if array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f"{name} has shape {array.shape}, and not (n, {width})")
    return array
