"""Curves of pages: a search's chi-square, and what a study measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go

from validation.draw.page import QUIET, SERIES, figure
from validation.records import Curve, Line, Step

STEP_TICKS = 8
FEW = 12  # so many places along x are written one by one


def search_curve(history: Sequence[Step]) -> go.Figure | None:
    """Chi-square against the step, logarithmic where every value is above zero.

    None where fewer than two steps have one.
    """
    known = [
        (i, step.chi2, step) for i, step in enumerate(history, start=1) if step.chi2 is not None
    ]
    if len(known) < 2:
        return None
    x, y, steps = zip(*known, strict=True)
    drawn = go.Scatter(
        x=x,
        y=y,
        mode="lines+markers",
        marker={"size": 8},
        hovertext=[_step_text(step) for step in steps],
        hovertemplate="step %{x}, %{hovertext}: χ² = %{y:.4~r}<extra></extra>",
    )
    every = -(-len(history) // STEP_TICKS)
    return figure(
        [drawn],
        margin={"l": 60, "r": 10, "t": 10, "b": 40},
        xaxis={"title": "step", "tick0": 1, "dtick": every, "showgrid": False},
        yaxis={
            "title": "χ² per residual",
            "type": "log" if min(y) > 0 else "linear",
            "exponentformat": "power",
        },
    )


def study_curve(curve: Curve) -> go.Figure:
    """What a study measured; a dashed line has the colour of the line before it."""
    places = sorted({x for line in curve.lines for x in line.x})
    few = {"tickvals": places, "ticktext": [f"{x:g}" for x in places]}
    drawn, colour = [], -1
    for line in curve.lines:
        colour += line.kind != "dash" or colour < 0
        drawn.append(_line(line, SERIES[colour % len(SERIES)]))
    shown = figure(
        drawn,
        margin={"l": 60, "r": 20, "t": 10, "b": 50},
        bargap=0.04,
        showlegend=True,
        xaxis={
            "title": curve.x,
            "type": "log" if curve.log_x else "linear",
            **(few if len(places) <= FEW else {}),
        },
        yaxis={"title": curve.y, "rangemode": "tozero"},
    )
    for y, text in curve.levels:
        shown.add_hline(
            y, line={"color": QUIET, "width": 1, "dash": "dot"}, annotation={"text": text}
        )
    return shown


def _line(line: Line, colour: str) -> Any:
    if line.kind == "bar":
        return go.Bar(name=line.name, x=line.x, y=line.y, marker={"color": colour, "opacity": 0.6})
    dash = line.kind == "dash"
    return go.Scatter(
        name=line.name,
        x=line.x,
        y=line.y,
        mode="lines" if line.kind == "smooth" else "lines+markers",
        line={"color": colour, "width": 1.5 if dash else 2, "dash": "dash" if dash else "solid"},
        marker={"size": 4 if dash else 7},
        error_y={"array": line.error, "thickness": 1.2, "width": 3} if line.error else None,
    )


def _step_text(step: Step) -> str:
    return step.step if step.lights is None else f"{step.step}, {step.lights} lights"
