"""Rooms of three dimensions in print: edges, clouds of votes, points of walls, marks."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from validation.draw.prints import bar

if TYPE_CHECKING:
    from lightloc import Observations, Votes

VIEW = (24.0, -62.0)  # elevation and azimuth of the drawings, degrees
FAINT, POWER = 0.02, 1.5  # opacity of the least V, and how fast it grows: the cloud's inside shows
DOT, ZOOM = 7.0, 0.97
CLOUD = "viridis_r"  # dark where V is large: on white paper the maxima stand out


def space(figure: Figure, place: Any, title: str, bounds: NDArray) -> Any:
    """3D axes with the edges of a room within bounds (2, 3), metres, equal."""
    axes: Any = figure.add_subplot(place, projection="3d", computed_zorder=False)
    axes.set_title(title, fontsize=10)
    axes.view_init(*VIEW)
    axes.set_box_aspect(bounds[1] - bounds[0], zoom=ZOOM)
    axes.set_proj_type("persp", focal_length=0.5)
    corners = np.array(list(product(*bounds.T)))
    for pane in (axes.xaxis, axes.yaxis, axes.zaxis):
        pane.set_pane_color("white")
    for a, b in ((a, b) for i, a in enumerate(corners) for b in corners[:i]):
        if np.count_nonzero(a != b) == 1:
            axes.plot(*np.stack([a, b]).T, color="#808080", linewidth=0.8)
    for low, high, name in zip(*bounds, "xyz", strict=True):
        getattr(axes, f"set_{name}lim")(low, high)
        getattr(axes, f"set_{name}label")(f"{name} in m", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=4)
    axes.grid(False)
    return axes


def cloud(axes: Any, votes: Votes) -> None:
    """The medial axis' cells coloured with V, the faint ones nearly clear; with a colour bar."""
    on = votes.medial_axis & (votes.votes > 0)
    V, points = votes.votes[on], votes.grid.points[on.ravel()]
    order = np.argsort(V)
    V, points = V[order], points[order]
    scale = Normalize(0, V.max())
    colours = colormaps[CLOUD](scale(V))
    colours[:, 3] = FAINT + (1 - FAINT) * scale(V) ** POWER
    axes.scatter(
        *points.T, c=colours, s=DOT, linewidths=0, depthshade=False, rasterized=True, zorder=1
    )
    label = "V(p), limiters a triangle of the sphere"
    bar(axes, ScalarMappable(scale, CLOUD), label, shrink=0.55, pad=0.17)


def radiance_points(
    axes: Any, q: Observations, some: NDArray[np.intp] | slice = slice(None)
) -> None:
    """B(q) at its points, grey, brighter where B is; the far walls only, to see inside."""
    B = q.radiance[some].mean(axis=1)
    shade = np.clip(B / np.quantile(B, 0.98), 0, 1) ** (1 / 2.2)
    facing = q.normals[some] @ _to_viewer()
    far = facing > 0
    axes.scatter(
        *q.positions[some][far].T,
        c=np.repeat(shade[far, None], 3, axis=1),
        s=DOT,
        linewidths=0,
        depthshade=False,
        rasterized=True,
        zorder=0,
    )


def _to_viewer() -> NDArray[np.float64]:
    up, around = np.deg2rad(VIEW)
    return np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
