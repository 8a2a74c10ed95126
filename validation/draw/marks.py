"""How lights are marked in print (matplotlib)."""

from __future__ import annotations

from typing import Any

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
