"""One room in many materials: the scene `box_kinds`, all six walls of one BSDF."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import render
from render import Room
from validation.studies.rivals import random_lights

SCENE = "box_kinds"
MATERIALS: dict[str, tuple[str, dict[str, Any]]] = {
    "diffuse": ("diffuse", {"material": "diffuse"}),
    "rough6": ("rough diffuse, Oren-Nayar α 0.6", {"material": "rough_diffuse", "alpha": 0.6}),
    "ggx1": ("rough conductor, GGX α 0.1", {"material": "conductor", "alpha": 0.1}),
    "ggx3": ("rough conductor, GGX α 0.3", {"material": "conductor", "alpha": 0.3}),
    "ggx8": ("rough conductor, GGX α 0.8", {"material": "conductor", "alpha": 0.8}),
    "beckmann3": ("rough conductor, Beckmann α 0.3", {"material": "beckmann", "alpha": 0.3}),
    "brushed": ("rough conductor, α 0.15 × 0.5", {"material": "brushed"}),
    "plastic05": ("rough plastic α 0.05", {"material": "plastic", "alpha": 0.05}),
    "plastic3": ("rough plastic α 0.3", {"material": "plastic", "alpha": 0.3}),
    "coat": ("principled, clear coat", {"material": "coat"}),
    "sheen": ("principled, sheen", {"material": "sheen"}),
    "metal": ("principled, metal", {"material": "metal"}),
    "textured": ("diffuse, textured", {"material": "textured"}),
    "bumps": ("diffuse, bumps", {"material": "bumps"}),
    "measured": ("measured cloth", {"material": "measured"}),
    "mixed": ("diffuse and conductor, half each", {"material": "mixed"}),
}
"""What a reader calls each, and the scene's parameters."""


@cache
def room_of(material: str) -> Room:
    """The room in that material, with the scene's lights, which are to be replaced."""
    return render.load(SCENE, **MATERIALS[material][1])


def lit(room: Room, count: int, rng: np.random.Generator) -> Room:
    """The room with so many lights, in free space and apart."""
    return render.relight(room, random_lights(room, count, rng))
