"""What all figures share: marks, colours of the outline, B(q) along walls, files that repeat."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lightloc import Grid, Observations

# Vermilion and bluish green of Okabe and Ito: told apart by every common kind of colour vision.
RED, GREEN, BLUE = "#d55e00", "#009e73", "#0072b2"
TRUE: dict[str, Any] = {"marker": "o", "s": 26, "c": RED, "edgecolors": "white", "linewidths": 1.0}
FOUND: dict[str, Any] = {
    "marker": "o",
    "s": 170,
    "facecolors": "none",
    "edgecolors": GREEN,
    "linewidths": 2.0,
}
HALO: dict[str, Any] = {
    "marker": "o",
    "s": 170,
    "facecolors": "none",
    "edgecolors": "white",
    "linewidths": 3.2,
}
NOTHING = "#d9d9d9"  # where no observation limits a light
FIELD, VOTES = "viridis", "magma"

CHROMA = 0.13  # of the outline's colours in OKLCH: what sRGB holds at nearly every hue
LIGHTNESS = (0.64, 0.19)  # its middle, and how far it swings: with cos(hue), so that who sees
#                           no red and green still sees each place of the outline in a colour of
#                           its own

BAND, GAP, HEIGHT = 0.035, 0.015, 0.17  # of the side: the colour band, and B(q) on top of it
WIDE = BAND + 2 * GAP + HEIGHT
BRIGHT = 0.998  # quantile of V at the end of its colour bar: peaks are a few cells
SHARE = (0.02, 0.98)  # quantiles at the ends of a logarithmic colour bar
DARKER = 0.72  # of every other limiter in a close-up
DPI = 110
SALT = "lightloc"  # SVG ids are hashes with this, so that they repeat


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure with its captions.

    Args:
        number: of the paper's figure.
        title: ours, short.
        paper: what the paper's figure shows, in our words.
        ours: what this one shows, with its measured figures.
        figure: to be written.
    """

    number: int
    title: str
    paper: str
    ours: str
    figure: Figure

    @property
    def name(self) -> str:
        return f"figure{self.number}"


Draw = Callable[[Callable[[float], None]], Drawing]
"""Compute and draw; told a function that takes the share that is done."""


def canvas(width: float, height: float, title: str) -> Figure:
    """An empty figure, inches, with our own short title."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize=12)
    return figure


def written(figure: Figure, kind: str) -> bytes:
    """The figure as "png" or "svg": the same bytes for the same data, without a date."""
    import matplotlib

    without = {"Date": None} if kind == "svg" else {"Software": None}
    file = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": SALT}):
        figure.savefig(file, format=kind, dpi=DPI, metadata=without)
    return file.getvalue()


def outline_colours(along: NDArray, length: float) -> NDArray[np.float64]:
    """(n, 3) colours of places on an outline, once round the circle of hues: Figure 1d's."""
    from validation.draw import oklch, srgb

    turn = 2 * np.pi * np.asarray(along) / length
    middle, swing = LIGHTNESS
    return srgb(oklch(middle + swing * np.cos(turn), np.full_like(turn, CHROMA), turn)) / 255.0


def striped(colours: NDArray) -> NDArray[np.float64]:
    """The same with every other place darker: for close-ups, where neighbours look alike."""
    shade = np.where(np.arange(len(colours)) % 2, DARKER, 1.0)
    return colours * shade[:, None]


def picture(values: NDArray, grid: Grid) -> NDArray[Any]:
    """Values (g, ...) over a flat grid as rows of pixels from the bottom up."""
    nx, ny, _ = grid.shape
    return np.asarray(values).reshape(nx, ny, *np.shape(values)[1:]).swapaxes(0, 1)


def field(axes: Axes, values: NDArray, grid: Grid, label: str, cmap: str = FIELD) -> Any:
    """D or I, logarithmic, with its colour bar; grey where it is infinite."""
    from matplotlib.colors import LogNorm

    fine = np.isfinite(values) & (values > 0)
    low, high = np.quantile(values[fine], SHARE)
    image = axes.imshow(
        picture(np.where(fine, values, np.nan), grid),
        norm=LogNorm(low, high),
        cmap=cmap,
        **_placed(grid),
    )
    axes.add_patch(_nothing(grid))
    _bar(axes, image, label, extend="both")
    return image


def votes(axes: Axes, values: NDArray, grid: Grid) -> Any:
    """V(p), linear, with its colour bar."""
    top = np.quantile(values, BRIGHT)
    image = axes.imshow(
        picture(values.ravel(), grid), cmap=VOTES, vmin=0, vmax=top, **_placed(grid)
    )
    _bar(axes, image, "V(p), limiters a pixel of the circle", extend="max")
    return image


def limiters(axes: Axes, L: NDArray, grid: Grid, colours: NDArray) -> Any:
    """L(p), each cell in its limiter's colour."""
    from matplotlib.colors import to_rgb

    known = len(colours) > L
    shown = np.where(known[:, None], colours[np.where(known, L, 0)], to_rgb(NOTHING))
    return axes.imshow(picture(shown, grid), **_placed(grid))


def walls(axes: Axes, q: Observations, colours: NDArray) -> None:
    """B(q) along the walls of a room of side 1, outside, over a band of the limiters' colours."""
    from matplotlib.collections import PolyCollection

    x, out, B = q.positions[:, :2], -q.normals[:, :2], q.radiance[:, :1]
    half = out[:, ::-1] * [1, -1] * 4 / len(q) / 2
    foot = x + (GAP + BAND) * out
    tall = foot + (GAP + HEIGHT * np.maximum(B, 0) / B.max()) * out
    for low, high in ((x + GAP * out, foot), (foot + GAP * out, tall)):
        cells = np.stack([low - half, low + half, high + half, high - half], axis=1)
        axes.add_collection(
            PolyCollection(list(cells), facecolors=colours, edgecolors=colours, linewidths=0.3)
        )
    axes.set_xlim(-WIDE, 1 + WIDE)
    axes.set_ylim(-WIDE, 1 + WIDE)


def plane(axes: Axes, title: str) -> None:
    """Axes of a 2D room: metres, equal, ticks on the room only."""
    axes.set_title(title, fontsize=10)
    axes.set_aspect("equal")
    axes.set_xticks([0, 0.5, 1])
    axes.set_yticks([0, 0.5, 1])
    axes.set_xlabel("x in m", fontsize=9)
    axes.set_ylabel("y in m", fontsize=9)
    axes.tick_params(labelsize=8)
    for side in axes.spines.values():
        side.set_visible(False)


def frame(middle: ArrayLike, reach: float, colour: str = "black") -> Any:
    """A square about a position, to be added to axes as a patch."""
    from matplotlib.patches import Rectangle

    x, y = np.asarray(middle)[:2] - reach
    return Rectangle((x, y), 2 * reach, 2 * reach, fill=False, edgecolor=colour, linewidth=1.4)


def true(axes: Axes, positions: ArrayLike, **changed: Any) -> None:
    """True lights: filled, red."""
    x, y = np.asarray(positions)[:, :2].T
    axes.scatter(x, y, zorder=6, **{**TRUE, "label": "true", **changed})


def found(axes: Axes, positions: ArrayLike, label: str = "found", **changed: Any) -> None:
    """Candidates or found lights: open circles, green, on a white ring."""
    x, y = np.asarray(positions)[:, :2].T
    axes.scatter(x, y, zorder=4, **HALO)
    axes.scatter(x, y, zorder=5, **{**FOUND, "label": label, **changed})


def legend(figure: Figure, *axes: Axes) -> None:
    """One legend below all panels, an entry a mark."""
    entries: dict[str, Any] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=len(entries), fontsize=9
    )


def _nothing(grid: Grid) -> Any:
    """What shows through where no observation limits a light."""
    from matplotlib.patches import Rectangle

    width, height = (grid.upper - grid.lower)[:2]
    return Rectangle(tuple(grid.lower[:2]), width, height, color=NOTHING, zorder=-1)


def _placed(grid: Grid) -> dict[str, Any]:
    (x0, y0, _), (x1, y1, _) = grid.lower, grid.upper
    return {"extent": (x0, x1, y0, y1), "origin": "lower", "interpolation": "nearest"}


def _bar(axes: Axes, image: Any, label: str, **options: Any) -> None:
    figure = axes.get_figure()
    assert figure is not None
    bar = figure.colorbar(image, ax=axes, shrink=0.7, pad=0.02, **options)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=8)
