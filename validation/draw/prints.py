"""Print figures (matplotlib): a canvas, its panels and legend, lights, and files that repeat."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from validation.draw.marks import FOUND, HALO, TRUE

DPI = 110
STEM = {"color": "#555555", "linewidth": 0.7, "zorder": 8}
SALT = "lightloc"  # SVG ids are hashes with this, so that they repeat


def canvas(width: float, height: float, title: str) -> Figure:
    """An empty figure, inches, with our own short title."""
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize=12)
    return figure


def written(figure: Figure, kind: str) -> bytes:
    """The figure as "png" or "svg": the same bytes for the same data, without a date."""
    without = {"Date": None} if kind == "svg" else {"Software": None}
    file = BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": SALT}):
        figure.savefig(file, format=kind, dpi=DPI, metadata=without)
    return file.getvalue()


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
    """A square about a position (3,), to be added to axes as a patch."""
    x, y = np.asarray(middle)[:2] - reach
    return Rectangle((x, y), 2 * reach, 2 * reach, fill=False, edgecolor=colour, linewidth=1.4)


def true(axes: Any, positions: ArrayLike, **changed: Any) -> None:
    """True lights (k, 3): filled, red."""
    _marked(axes, positions, zorder=6, **{**TRUE, "label": "true", **changed})


def found(axes: Any, positions: ArrayLike, label: str = "found", **changed: Any) -> None:
    """Candidates or found lights (k, 3): open circles, green, on the plane on a white ring."""
    if axes.name != "3d":
        _marked(axes, positions, zorder=4, **HALO)
    _marked(axes, positions, zorder=5, **{**FOUND, "label": label, **changed})


def _marked(axes: Any, positions: ArrayLike, **mark: Any) -> None:
    """Marks, in space each over a thin line from the floor that says where it is."""
    at = np.asarray(positions, dtype=float)
    if axes.name != "3d":
        axes.scatter(*at[:, :2].T, **mark)
        return
    for x, y, z in at:
        axes.plot([x, x], [y, y], [axes.get_zlim()[0], z], **STEM)
    axes.scatter(*at.T, depthshade=False, **{**mark, "zorder": 10})


def bar(axes: Axes, image: Any, label: str, **how: Any) -> None:
    """A colour bar beside a panel."""
    figure = axes.get_figure()
    assert figure is not None
    drawn = figure.colorbar(image, ax=axes, **{"shrink": 0.7, "pad": 0.02, **how})
    drawn.set_label(label, fontsize=8)
    drawn.ax.tick_params(labelsize=8)


def legend(figure: Figure, *axes: Axes) -> None:
    """One legend below all panels, an entry a mark."""
    entries: dict[str, Any] = {}
    for panel in axes:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=len(entries), fontsize=9
    )
