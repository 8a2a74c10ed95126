"""Rooms in three dimensions as the figures need them: observed, voted on, drawn as points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import render
from lightloc import Geodesic, Observations, Paper, PointLights, Votes
from lightloc.fit import Problem
from lightloc.paper import State, iterate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS, SEED = 16_000, 1
# Coarser than the paper's 512 cells and 60 000 points, and T with them: 15 % of the radius for its
# 5 %, so that T holds several cells and several times the points' spacing. H starts low enough
# for more than one peak, and what lies within 20 % of the radius is one light.
OPTIONS = Paper(
    cells_3d=56,
    threshold=0.15,
    height=2.4e-4,
    lowering=0.75,
    merge=0.2,
    association=0.2,
    increment=2.0,
    radius=1,
)
SAME_AS_TRUTH = 1e-5  # of the mean of B^2: lights with a smaller error explain B
VIEW = (24.0, -62.0)  # elevation and azimuth of the drawings, degrees
FAINT, POWER = 0.02, 1.5  # opacity of the least V, and how fast it grows: the cloud's inside shows
DOT, ZOOM = 7.0, 0.97


@dataclass(frozen=True, eq=False)
class Solid:
    """A 3D room and what is seen of it: q, with its noise where it has some."""

    room: render.Room
    q: Observations
    options: Paper = OPTIONS

    @property
    def lights(self) -> PointLights:
        return self.room.lights

    @property
    def radius(self) -> float:
        """The scene's, metres."""
        return self.q.diagonal / 2

    @cached_property
    def surface(self) -> Geodesic:
        return Geodesic.of(self.q.positions, self.q.normals, self.options.threshold * self.radius)

    def low_error(self) -> float:
        """The MSE at which lights explain B: of the noise, or of the arithmetic without any."""
        B, sigma = self.q.radiance, self.q.known_sigma
        return SAME_AS_TRUTH * float(np.square(B).mean()) + 1.05 * float(np.square(sigma).mean())

    def steps(self) -> Iterator[State]:
        """The published algorithm with these options."""
        sigma = self.q.known_sigma
        sigma = sigma if (sigma > 0).all() else np.ones_like(sigma)
        problem = Problem.of(self.q, sigma, self.room.geometry, self.q.bounds)
        return iterate(problem, self.surface, self.radius, self.low_error(), self.options)


def observed(room: render.Room) -> Solid:
    """Direct light without noise."""
    return Solid(room, render.observe(room, points=POINTS, seed=SEED, transport="direct"))


def space(figure: Figure, place: Any, title: str, bounds: NDArray) -> Any:
    """3D axes with the room's edges, metres, equal."""
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


def cloud(axes: Any, votes: Votes, figure: Figure) -> None:
    """The medial axis' cells coloured with V, the faint ones nearly clear; with a colour bar."""
    import matplotlib
    from matplotlib.colors import Normalize

    on = votes.medial_axis & (votes.votes > 0)
    V, points = votes.votes[on], votes.grid.points[on.ravel()]
    order = np.argsort(V)
    V, points = V[order], points[order]
    scale = Normalize(0, V.max())
    colours = matplotlib.colormaps[CLOUD](scale(V))
    colours[:, 3] = FAINT + (1 - FAINT) * scale(V) ** POWER
    axes.scatter(
        *points.T, c=colours, s=DOT, linewidths=0, depthshade=False, rasterized=True, zorder=1
    )
    bar = figure.colorbar(
        matplotlib.cm.ScalarMappable(scale, CLOUD), ax=axes, shrink=0.55, pad=0.17
    )
    bar.set_label("V(p), limiters a triangle of the sphere", fontsize=8)
    bar.ax.tick_params(labelsize=7)


CLOUD = "viridis_r"  # dark where V is large: on white paper the maxima stand out


def marked(axes: Any, positions: ArrayLike, floor: float, **mark: Any) -> None:
    """Marks in 3D, each over a thin line from the floor that says where it is."""
    for p in np.asarray(positions):
        axes.plot([p[0]] * 2, [p[1]] * 2, [floor, p[2]], color="#555555", linewidth=0.7, zorder=8)
    axes.scatter(*np.asarray(positions).T, depthshade=False, zorder=10, **mark)


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
