"""Plotly figures as pages hold them: one look, no network, the same bytes for the same data."""

from __future__ import annotations

import math
from typing import Any

import plotly.graph_objects as go
from plotly.io.json import to_json_plotly
from plotly.offline import get_plotlyjs

from validation.records import UNKNOWN

QUIET, FAINT = "#8b95a1", "rgba(139, 149, 161, 0.28)"  # of lines, on light and on dark pages
CLEAR = "rgba(0,0,0,0)"
SERIES = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9")  # Okabe and Ito
DECADES_FEW = 1.5  # a bar of fewer decades gets ticks at 1, 2 and 5 too
AXIS = {"gridcolor": FAINT, "linecolor": QUIET, "tickcolor": QUIET, "zeroline": False}
# The page's style sheet gives texts its own colours.
TEMPLATE = go.layout.Template(
    layout={
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": QUIET},
        "hoverlabel": {"font": {"family": "system-ui, sans-serif", "size": 12}},
        "paper_bgcolor": CLEAR,
        "plot_bgcolor": CLEAR,
        "modebar": {"bgcolor": CLEAR, "color": QUIET},
        "colorway": SERIES,
        "legend": {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom", "bgcolor": CLEAR},
        "xaxis": {**AXIS, "automargin": True},
        "yaxis": {**AXIS, "automargin": True},
        "hovermode": "closest",
    }
)
# Buttons are named and no server is given: plotly's own set offers to upload the data.
CONFIG = {
    "displaylogo": False,
    "responsive": True,
    "plotlyServerURL": "",
    "modeBarButtons": [["toImage", "resetViews"]],
}


def figure(traces: list[Any], **layout: Any) -> go.Figure:
    """A figure in our look."""
    return go.Figure(traces, {"template": TEMPLATE, **layout})


def embedded(drawn: go.Figure) -> str:
    """A figure as JSON for the page's script element, safe in HTML."""
    whole = {**drawn.to_dict(), "config": CONFIG}
    return str(to_json_plotly(whole, engine="json"))


def script() -> str:
    """plotly.js, which every page of a report shares."""
    return str(get_plotlyjs())


def measured(name: str, unit: str) -> str:
    """What an axis or a colour bar is called; a name alone where nobody knows the unit.

    Examples
    --------
    >>> measured("x", "cm"), measured("x", "unit"), measured("D", "")
    ('x in cm', 'x', 'D')
    """
    return name if unit in ("", UNKNOWN) else f"{name} in {unit}"


def bar(title: str, side: str, **options: Any) -> dict[str, Any]:
    """A slim colour bar, and on which side of it its title is."""
    return {"title": {"text": title, "side": side}, "thickness": 10, "outlinewidth": 0, **options}


def decades(low: float, high: float) -> dict[str, list[Any]]:
    """Ticks of a colour bar of logarithms to base 10."""
    steps = (1, 2, 5) if high - low < DECADES_FEW else (1,)
    powers = range(math.floor(low), math.ceil(high) + 1)
    values = [step * 10.0**power for power in powers for step in steps]
    inside = [value for value in values if low <= math.log10(value) <= high]
    inside = inside if len(inside) > 1 else [10.0**low, 10.0**high]
    return {
        "tickvals": [math.log10(value) for value in inside],
        "ticktext": [f"{value:.3g}" for value in inside],
    }
