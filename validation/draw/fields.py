"""Fields of a flat room in print: D and V with colour bars, L in the outline's colours, B(q)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from validation.draw.colours import oklch, srgb
from validation.draw.prints import bar

if TYPE_CHECKING:
    from lightloc import Grid, Observations

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


def outline_colours(along: NDArray, length: float) -> NDArray[np.float64]:
    """(n, 3) colours of places on an outline, once round the circle of hues: Figure 1d's."""
    turn = 2 * np.pi * np.asarray(along) / length
    middle, swing = LIGHTNESS
    return srgb(oklch(middle + swing * np.cos(turn), np.full_like(turn, CHROMA), turn)) / 255.0


def picture(values: NDArray, grid: Grid) -> NDArray[Any]:
    """Values (g, ...) over a flat grid as rows of pixels from the bottom up."""
    nx, ny, _ = grid.shape
    return np.asarray(values).reshape(nx, ny, *np.shape(values)[1:]).swapaxes(0, 1)


def field(axes: Axes, values: NDArray, grid: Grid, label: str) -> None:
    """D or I (g,), logarithmic, with its colour bar; grey where it is infinite."""
    (x0, y0, _), (x1, y1, _) = grid.lower, grid.upper
    logarithmic(axes, picture(values, grid), (x0, x1, y0, y1), label)
    axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, color=NOTHING, zorder=-1))


def logarithmic(
    axes: Axes, rows: NDArray, extent: tuple[float, float, float, float], label: str, **how: Any
) -> None:
    """Rows of a field from the bottom up, over (x0, x1, y0, y1), with their colour bar."""
    fine = np.isfinite(rows) & (rows > 0)
    image = axes.imshow(
        np.where(fine, rows, np.nan),
        extent=extent,
        origin="lower",
        interpolation="nearest",
        norm=LogNorm(*np.quantile(rows[fine], SHARE)),
        cmap=FIELD,
    )
    bar(axes, image, label, extend="both", **how)


def votes(axes: Axes, values: NDArray, grid: Grid) -> None:
    """V(p), linear, with its colour bar."""
    top = np.quantile(values, BRIGHT)
    image = axes.imshow(
        picture(values.ravel(), grid), cmap=VOTES, vmin=0, vmax=top, **_placed(grid)
    )
    bar(axes, image, "V(p), limiters a pixel of the circle", extend="max")


def limiters(axes: Axes, L: NDArray, grid: Grid, colours: NDArray) -> None:
    """L(p), each cell in its limiter's colour."""
    known = len(colours) > L
    shown = np.where(known[:, None], colours[np.where(known, L, 0)], to_rgb(NOTHING))
    axes.imshow(picture(shown, grid), **_placed(grid))


def walls(axes: Axes, q: Observations, colours: NDArray) -> None:
    """B(q) along the walls of a room of side 1, outside, over a band of the limiters' colours."""
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


def _placed(grid: Grid) -> dict[str, Any]:
    (x0, y0, _), (x1, y1, _) = grid.lower, grid.upper
    return {"extent": (x0, x1, y0, y1), "origin": "lower", "interpolation": "nearest"}
