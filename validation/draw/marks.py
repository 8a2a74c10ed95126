"""How lights are marked, said once for pages (Plotly) and for print (matplotlib)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import plotly.graph_objects as go

# Vermilion, bluish green and blue of Okabe and Ito: told apart by every common kind of colour
# vision.
RED, GREEN, BLUE = "#d55e00", "#009e73", "#0072b2"

TRUE: dict[str, Any] = {"marker": "o", "s": 26, "c": RED, "edgecolors": "white", "linewidths": 1.0}
FOUND: dict[str, Any] = {
    "marker": "o",
    "s": 170,
    "facecolors": "none",
    "edgecolors": GREEN,
    "linewidths": 2.0,
}
HALO: dict[str, Any] = {**FOUND, "edgecolors": "white", "linewidths": 3.2}

Kind = Literal["true", "missed", "found", "ghost"]
SYMBOLS: dict[Kind, tuple[str, str]] = {  # of Plotly; open ones let the light beneath show
    "true": ("circle", RED),
    "missed": ("square", RED),
    "found": ("circle-open", GREEN),
    "ghost": ("diamond-open", GREEN),
}
OUTLIER = ("x", "#cc79a7")  # reddish purple, told apart like the others
SOLID, OPEN = 8, 15  # pixels across


@dataclass(frozen=True)
class Light:
    """A light on a page's figure; "missed" and "ghost" are those without a partner.

    ``at`` is its place (3,) in metres and ``partner`` that of the true light for which a found one
    stands; ``text`` is what pointing at it shows.
    """

    kind: Kind
    at: Sequence[float | None]
    text: str
    partner: Sequence[float | None] | None = None


def light_traces(lights: Sequence[Light], scatter: type = go.Scatter) -> list[Any]:
    """A trace a kind: on the plane, open marks over white ones, or with Scatter3d in space."""
    solid = scatter is go.Scatter3d
    drawn = []
    for kind, (symbol, colour) in SYMBOLS.items():
        some = [light for light in lights if light.kind == kind]
        if not some:
            continue
        axes = "xyz" if solid else "xy"
        at = dict(zip(axes, zip(*(light.at for light in some), strict=True), strict=False))
        ring = symbol.endswith("open")
        mark = {"symbol": symbol, "size": OPEN if ring else SOLID, "color": colour}
        mark["line"] = {"color": colour if ring else "white", "width": 2.2 if ring else 1.2}
        if ring and not solid:
            under = {**mark, "color": "white", "line": {"color": "white", "width": 4.5}}
            drawn.append(
                scatter(**at, mode="markers", marker=under, hoverinfo="skip", showlegend=False)
            )
        text = [light.text for light in some]
        own = {"name": kind, "hovertext": text, "hoverinfo": "text", "showlegend": True}
        drawn.append(scatter(**at, mode="markers", marker=mark, **own))
    return drawn
