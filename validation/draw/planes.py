"""Slices of the fields D, L and V (Eq. 6, 7, 8) with walls, lights, and a colour bar."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from validation.draw.colours import place, png
from validation.draw.marks import Light, light_traces
from validation.draw.mesh import section, strokes
from validation.draw.page import bar, decades, figure, measured
from validation.records import UNKNOWN

D_PERCENTILES = (1.0, 99.0)  # D grows without bound near unlit corners; they'd eat the colours
FRAME = 0.035  # of a side: thickness of the walls' colours about the limiters
CELL_SHADES = 5  # neighbouring limiters differ in shade, so that the cells show (Figure 2b)
CELL_SHADE = 0.05  # of the brightness, per shade
BAR = {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "len": 0.9}
POINTED = "x %%{x:.4~r}%s, y %%{y:.4~r}%s: %%{%s:.3~r}<extra></extra>"

Array = NDArray[Any]


def slices(
    arrays: Mapping[str, Array],
    room: Mapping[str, Array] | None,
    lights: Sequence[Light],
    unit: str = "m",
    power: str = "W/sr",
) -> dict[str, go.Figure]:
    """D (ny, nx) of fields.npz, and L and V where it has them; row 0 of a field is at ymin.

    A limiter's place is (ny, nx, 3). The room has vertices (v, 3) and faces (f, 3), where it is
    known; the lights are those near the slice. Lengths are in the unit, D in the power.

    Raises
    ------
    ValueError
        The extent is no rectangle, or a field has the wrong shape.
    """
    extent, height = np.asarray(arrays["extent"], dtype=float).ravel(), float(arrays["height"])
    low, size = extent[::2], np.diff(extent)[::2]
    if extent.shape != (4,) or not np.isfinite([*extent, height]).all() or (size <= 0).any():
        raise ValueError(f"extent {extent.tolist()} or height {height} is no place in a room")
    plane = Plane(low, size, height, room, lights, unit, power)
    drawn = {"D": _draw_d(_field("D", arrays), plane)}
    if "limiter" in arrays:
        drawn["L"] = _draw_l(_field("limiter", arrays, 3), arrays.get("L"), plane)
    if "V" in arrays:
        drawn["V"] = _draw_v(_field("V", arrays), plane)
    return drawn


def _field(name: str, arrays: Mapping[str, Array], *more: int) -> Array:
    values = np.asarray(arrays[name], dtype=float)
    if values.size == 0 or values.ndim != 2 + len(more) or values.shape[2:] != more:
        raise ValueError(f"{name} has shape {values.shape}, and is no slice")
    return values


@dataclass(frozen=True, eq=False)
class Plane:
    """Where slices lie, and what is drawn over each: (2,) lowest corner and size, and z."""

    low: Array
    size: Array
    height: float
    room: Mapping[str, Array] | None
    lights: Sequence[Light]
    unit: str
    power: str

    def pointed(self, value: str) -> str:
        """What is said where the pointer is."""
        unit = "" if self.unit == UNKNOWN else f" {self.unit}"
        return POINTED % (unit, unit, value)

    def cells(self, shape: Sequence[int]) -> dict[str, float]:
        """Where the cells (ny, nx) of a field lie, the first one at low x and y."""
        step = self.size / shape[1::-1]
        (x0, y0), (dx, dy) = (self.low + step / 2).tolist(), step.tolist()
        return {"x0": x0, "y0": y0, "dx": dx, "dy": dy}

    def framed(self, shape: Sequence[int]) -> tuple[Array, dict[str, float], list[int]]:
        """Places (.., .., 3) of a field's cells and a frame of more about them.

        Returns where those cells lie, and how many rows and columns the frame adds at an end.
        """
        cells = self.cells(shape)
        (dx, dy), (ny, nx) = (cells["dx"], cells["dy"]), shape
        more = [int(np.ceil(FRAME * self.size.max() / step)) for step in (dy, dx)]
        y = cells["y0"] + dy * np.arange(-more[0], ny + more[0])
        x = cells["x0"] + dx * np.arange(-more[1], nx + more[1])
        at = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), self.height)], axis=-1)
        return at, {**cells, "x0": float(x[0]), "y0": float(y[0])}, more

    def drawn(self, field: Any, *more: Any, frame: float = 0.0) -> go.Figure:
        """A field, what it needs, the walls and the lights; room for a frame about it."""
        at = strokes(section(self.room, self.height)) if self.room is not None else np.zeros((2, 0))
        line = {"x": at[0], "y": at[1], "mode": "lines", "hoverinfo": "skip", "showlegend": False}
        walls = [
            go.Scatter(**line, line={"color": "rgba(0, 0, 0, 0.55)", "width": 3}),
            go.Scatter(**line, line={"color": "white", "width": 1.4}),
        ]
        ends = np.stack([self.low - frame, self.low + self.size + frame], axis=1).tolist()
        axis = {"ticks": "outside", "showgrid": False, "constrain": "domain"}
        return figure(
            [field, *more, *walls, *light_traces(self.lights)],
            margin={"l": 45, "r": 10, "t": 30, "b": 115},
            xaxis={**axis, "title": measured("x", self.unit), "range": ends[0]},
            yaxis={
                **axis,
                "title": measured("y", self.unit),
                "range": ends[1],
                "scaleanchor": "x",
            },
        )


def _draw_d(values: Array, plane: Plane) -> go.Figure:
    """D (ny, nx), logarithmic: darkest where it is 0, blank where it is not finite."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithm = np.log10(values)
    fine = logarithm[np.isfinite(logarithm)]
    low, high = np.percentile(fine, D_PERCENTILES).tolist() if fine.size else (0.0, 1.0)
    # One scale however little D varies, so that round-off is not drawn as structure.
    low, high = (low, high) if high - low > 0.01 else (low - 0.5, high + 0.5)
    shown = np.where(values == 0, low, np.where(np.isfinite(logarithm), logarithm, np.nan))
    scale = bar(measured("D", plane.power), "bottom", **BAR, **decades(low, high))
    said = {"customdata": values.astype(np.float32), "hovertemplate": plane.pointed("customdata")}
    return plane.drawn(_map(shown, plane, "viridis", (low, high), colorbar=scale, **said))


def _draw_v(values: Array, plane: Plane) -> go.Figure:
    """V (ny, nx), from 0."""
    fine = values[np.isfinite(values)]
    most = float(fine.max()) if fine.size and fine.max() > 0 else 1.0
    scale = bar(
        measured("mean distance between<br>neighbouring limiters", plane.unit),
        "bottom",
        **BAR,
    )
    said = {"hovertemplate": plane.pointed("z")}
    return plane.drawn(_map(values, plane, "magma", (0.0, most), colorbar=scale, **said))


def _draw_l(limiter: Array, index: Array | None, plane: Plane) -> go.Figure:
    """The limiters' places (ny, nx, 3) as colours, framed by those of the walls about them.

    ``index`` (ny, nx) says which observation each is, below 0 for none.
    """
    known = np.asarray(np.isfinite(limiter).all(axis=-1))
    shade = np.full(known.shape, CELL_SHADES // 2)
    if index is not None and index.shape == known.shape:
        known &= index >= 0
        shade = (np.where(known, index, 0).astype(np.int64) * 2654435761 >> 7) % CELL_SHADES
    places = np.asarray(plane.room["vertices"]) if plane.room is not None else limiter[known]
    levels = places[:, 2] if len(places) else np.array([plane.height])
    low = np.array([*plane.low, levels.min()], dtype=float)
    high = np.array([*(plane.low + plane.size), levels.max()], dtype=float)
    walls, cells, (deep, wide) = plane.framed(known.shape)
    walls[deep:-deep, wide:-wide] = np.where(known[..., None], limiter, low)
    light = np.pad(
        1 + CELL_SHADE * (shade - CELL_SHADES // 2), ((deep,), (wide,)), constant_values=1
    )
    opaque = np.pad(known, ((deep,), (wide,)), constant_values=True)
    shaded = place(np.clip(walls, low, high), low, high) * light[..., None]
    painted = np.dstack([np.clip(np.round(shaded), 0, 255), 255 * opaque]).astype(np.uint8)
    source = "data:image/png;base64," + base64.b64encode(png(painted)).decode("ascii")
    return plane.drawn(
        go.Image(source=source, hoverinfo="skip", **cells),
        _heights(low, high, plane.unit),
        frame=FRAME * plane.size.max(),
    )


def _heights(low: Array, high: Array, unit: str) -> go.Scatter:
    """Nothing but the colour bar of places above the middle of the right-hand wall."""
    levels = np.linspace(low[2], high[2], 9)
    right = [place(np.array([high[0], (low[1] + high[1]) / 2, z]), low, high) for z in levels]
    marker = {
        "color": [low[2]],
        "cmin": low[2],
        "cmax": high[2],
        "colorscale": [f"rgb{tuple(colour.tolist())}" for colour in right],
        "colorbar": bar(
            measured("height of that surface", unit) + ",<br>in the hue of the right-hand wall",
            "bottom",
            **BAR,
        ),
    }
    return go.Scatter(x=[None], y=[None], mode="markers", marker=marker, showlegend=False)


def _map(
    values: Array, plane: Plane, colours: str, ends: tuple[float, float], **more: Any
) -> go.Heatmap:
    z, (low, high) = values.astype(np.float32), ends
    cells = plane.cells(values.shape)
    return go.Heatmap(z=z, zmin=low, zmax=high, colorscale=colours, **cells, **more)
