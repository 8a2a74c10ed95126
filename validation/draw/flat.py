"""A box-shaped room laid flat: the walls about the floor, and the ceiling beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from validation.draw.marks import Light, light_traces
from validation.draw.page import bar, figure

DOT = 5
EDGE = {"color": "rgba(139, 149, 161, 0.7)", "width": 1}
POINTED = (
    "x %%{customdata[0]:.2f}, y %%{customdata[1]:.2f}, z %%{customdata[2]:.2f}: "
    "%s %%{marker.color:.3~r}<extra></extra>"
)


def unfolded(
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    lights: Sequence[Light],
    name: str,
    colours: tuple[str, float, float],
) -> go.Figure:
    """(n,) values at (n, 3) points of a box's walls, and lights at their place above the floor.

    ``colours`` are a scale, and the values at its ends.
    """
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    flat = flattened(points, np.stack([low, low + size])).astype(np.float32)
    scale, least, most = colours
    walls = go.Scatter(
        x=flat[:, 0],
        y=flat[:, 1],
        mode="markers",
        showlegend=False,
        customdata=points.astype(np.float32),
        hovertemplate=POINTED % name,
        marker={
            "size": DOT,
            "color": values.astype(np.float32),
            "colorscale": scale,
            "cmin": least,
            "cmax": most,
            "colorbar": bar(name, "right"),
        },
    )
    above = [replace(light, at=(np.asarray(light.at, float) - low).tolist()) for light in lights]
    axis = {"visible": False}
    return figure(
        [_edges(size), walls, *light_traces(above)],
        margin={"l": 5, "r": 5, "t": 30, "b": 5},
        xaxis=axis,
        yaxis={**axis, "scaleanchor": "x"},
    )


def flattened(points: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) where (n, 3) points of a box's walls come to lie once it is laid flat.

    Examples
    --------
    >>> room = np.array([[0.0, 0, 0], [4, 3, 2]])
    >>> walls = np.array([[1.0, 1, 0], [0, 1, 0.5], [4, 1, 0.5], [1, 3, 0.5], [1, 1, 2]])
    >>> flattened(walls, room).tolist()
    [[1.0, 1.0], [-0.5, 1.0], [4.5, 1.0], [1.0, 3.5], [9.0, 1.0]]
    """
    w, d, h = bounds[1] - bounds[0]
    x, y, z = (points - bounds[0]).T
    wall = np.argmin(np.abs([z, x, w - x, y, d - y, h - z]), axis=0)
    laid = [(x, y), (-z, y), (w + z, y), (x, -z), (x, d + z), (2 * w + h - x, y)]
    return np.stack([np.choose(wall, [each[i] for each in laid]) for i in range(2)], axis=1)


def _edges(size: NDArray[np.float64]) -> go.Scatter:
    """The six walls' outlines."""
    w, d, h = size
    corners = [(0, 0, w, d), (-h, 0, h, d), (w, 0, h, d), (0, -h, w, h), (0, d, w, h)]
    x: list[float | None] = []
    y: list[float | None] = []
    for left, bottom, wide, high in [*corners, (w + h, 0, w, d)]:
        x += [left, left + wide, left + wide, left, left, None]
        y += [bottom, bottom, bottom + high, bottom + high, bottom, None]
    return go.Scatter(x=x, y=y, mode="lines", line=EDGE, hoverinfo="skip", showlegend=False)
