"""Figure 5: two lights and three lights in rooms of three dimensions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import intensity_distance
from lightloc.paper import State
from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import apart
from validation.figures.solid import OPTIONS, POINTS, Solid, observed

TWO, THREE = "box_two", "paper_three"
SLICE = 180  # pixels along the slice's length
ITERATIONS = 8  # about what the second room takes

TITLE = "Two and three lights in three dimensions"
PAPER = (
    "Synthetic 3D rooms. With two lights the maxima of V(p) give both at once: D(p) on a planar "
    "slice (a), the medial axis coloured with V (b). With three lights (c) the first maxima give "
    "two (d, green circles); after a few iterations the third is revealed (e, blue circle)."
)


@dataclass(frozen=True, eq=False)
class Data:
    """Both rooms, the first state of each, the last of the second.

    ``slice`` is D on the vertical plane through both lights: (h, w) W/sr, and its extent along
    the plane and in z, metres; ``on_slice`` the lights in it, (2, 2).
    """

    two: Solid
    three: Solid
    of_two: State
    first: State
    last: State
    slice: NDArray[np.float64]
    extent: tuple[float, float, float, float]
    on_slice: NDArray[np.float64]

    def off(self, state: State, solid: Solid) -> NDArray[np.float64]:
        """How far each candidate lies from the nearest true light, metres."""
        return apart(state.candidates, solid.lights.positions).min(axis=1)


def data(watch: Callable[[float], None]) -> Data:
    two = observed(render.load(TWO))
    of_two = next(two.steps())
    watch(0.3)
    three = observed(render.load(THREE))
    first = last = None
    for state in three.steps():
        if state.votes is not None:
            first, last = first or state, state
        watch(0.3 + 0.7 * min(1.0, state.iteration / ITERATIONS))
    assert first is not None and last is not None
    return Data(two, three, of_two, first, last, *sliced(two))


def sliced(
    solid: Solid,
) -> tuple[NDArray[np.float64], tuple[float, float, float, float], NDArray[np.float64]]:
    """D on the vertical plane through the two lights, its extent, and the lights in it."""
    a, b = solid.lights.positions
    along = (b - a) * [1, 1, 0]
    along /= np.linalg.norm(along)
    low, high = solid.q.bounds
    with np.errstate(divide="ignore"):
        ends = np.sort(np.stack([(low - a) / along, (high - a) / along])[:, :2], axis=0)
    start, stop = ends[0].max(), ends[1].min()
    height = round(SLICE * (high[2] - low[2]) / (stop - start))
    s = start + (np.arange(SLICE) + 0.5) / SLICE * (stop - start)
    z = low[2] + (np.arange(height) + 0.5) / height * (high[2] - low[2])
    foot = a * [1, 1, 0]
    points = foot + s[None, :, None] * along + z[:, None, None] * np.array([0, 0, 1.0])
    D, _ = intensity_distance(solid.q, points.reshape(-1, 3), solid.room.geometry)
    lights = np.array([[(p - a) @ along - start, p[2]] for p in (a, b)])
    extent = (0.0, float(stop - start), float(low[2]), float(high[2]))
    return D[:, 0].reshape(height, SLICE), extent, lights


def drawing(watch: Callable[[float], None]) -> Drawing:
    d = data(watch)
    figure = draw.canvas(14.0, 9.0, f"Figure 5. {TITLE}")
    places = figure.add_gridspec(2, 6)
    cut(figure.add_subplot(places[0, :3]), d)
    b = draw.space(figure, places[0, 3:], "(b) medial axis with V(p), two lights", d.two.q.bounds)
    draw.cloud(b, d.of_two.votes)  # type: ignore[arg-type]
    show(b, d.two, d.of_two.candidates)
    bounds = d.three.q.bounds
    c = draw.space(figure, places[1, :2], "(c) B(q) and three lights", bounds)
    draw.radiance_points(c, d.three.q)
    show(c, d.three, None)
    titles = ("(d) V(p) at first", f"(e) V(p), iteration {d.last.iteration}")
    for place, title, state in zip(
        (places[1, 2:4], places[1, 4:]), titles, (d.first, d.last), strict=True
    ):
        axes = draw.space(figure, place, title, bounds)
        draw.cloud(axes, state.votes)  # type: ignore[arg-type]
        new = (
            apart(state.candidates, d.first.candidates).min(axis=1) > OPTIONS.merge * d.three.radius
        )
        show(axes, d.three, state.candidates[~new])
        if new.any():
            new_ones = {"edgecolors": draw.BLUE, "linestyles": "--"}
            draw.found(axes, state.candidates[new], "new candidate", **new_ones)
    draw.legend(figure, b, axes)
    share = 100 * d.off(d.of_two, d.two) / d.two.radius
    found = d.last.tried
    ours = (
        f"Scenes {TWO} and {THREE}, {POINTS} points, {OPTIONS.cells_3d} cells along the longest "
        f"side, T = {OPTIONS.threshold:.0%} of the radius (the paper: 512 cells, 60 000 points, "
        f"5 %), distances along the surface. Two lights: the {len(d.of_two.candidates)} "
        f"candidates lie {share.min():.1f} to {share.max():.1f} % of the radius from the lights. "
        f"Three lights: {len(d.first.candidates)} candidates at first; the published algorithm, "
        f"with increments of {OPTIONS.increment:g} W/sr, sees the third in iteration "
        f"{d.last.iteration}"
        + (
            f" and then finds {len(found)} lights, mean squared error {d.last.mse:.1g}."
            if found is not None
            else "."
        )
    )
    return Drawing(5, TITLE, PAPER, ours, figure)


def cut(axes: Any, d: Data) -> None:
    """(a) the slice through both lights."""
    draw.logarithmic(axes, d.slice, d.extent, "D in W/sr", shrink=0.6)
    axes.set_title("(a) D(p) on the vertical plane through both lights", fontsize=10)
    axes.set_xlabel("along the plane, m", fontsize=9)
    axes.set_ylabel("z in m", fontsize=9)
    axes.tick_params(labelsize=8)
    draw.true(axes, d.on_slice)


def show(axes: Any, solid: Solid, candidates: NDArray | None) -> None:
    """True lights and candidates in 3D."""
    draw.true(axes, solid.lights.positions)
    if candidates is not None and len(candidates):
        draw.found(axes, candidates, "candidate", linestyles="--")
