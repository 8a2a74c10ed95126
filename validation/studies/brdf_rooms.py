"""One room in many materials: all six walls of one BSDF, written as Mitsuba has it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

import render
from lightloc import PointLights
from render import Room
from validation.studies.rivals import random_lights

WIDTH, DEPTH, HEIGHT = 5.5, 4.5, 2.9  # metres
WAVES, SWELL = 24, 0.02  # of the bumps: their number along a wall, their height

CONDUCTOR = """<bsdf type="roughconductor" id="wall">
<string name="distribution" value="{kind}"/>{roughness}
<spectrum name="eta" value="1.2"/><spectrum name="k" value="7"/></bsdf>"""
PLASTIC = """<bsdf type="roughplastic" id="wall"><string name="distribution" value="ggx"/>
<float name="alpha" value="{alpha}"/><rgb name="diffuse_reflectance" value="0.5"/></bsdf>"""
PRINCIPLED = (
    """<bsdf type="principled" id="wall"><rgb name="base_color" value="0.5"/>{more}</bsdf>"""
)


def values(**numbers: float) -> str:
    """Properties of a plugin, in XML."""
    return "".join(f'<float name="{name}" value="{x}"/>' for name, x in numbers.items())


def conductor(kind: str, **alpha: float) -> str:
    return CONDUCTOR.format(kind=kind, roughness=values(**alpha))


def principled(**more: float) -> str:
    return PRINCIPLED.format(more=values(**more))


MATERIALS: dict[str, tuple[str, str]] = {
    "diffuse": (
        "diffuse",
        '<bsdf type="diffuse" id="wall"><rgb name="reflectance" value="0.5"/></bsdf>',
    ),
    "ggx1": ("rough conductor, GGX α 0.1", conductor("ggx", alpha=0.1)),
    "ggx3": ("rough conductor, GGX α 0.3", conductor("ggx", alpha=0.3)),
    "ggx8": ("rough conductor, GGX α 0.8", conductor("ggx", alpha=0.8)),
    "beckmann3": ("rough conductor, Beckmann α 0.3", conductor("beckmann", alpha=0.3)),
    "brushed": ("rough conductor, α 0.15 × 0.5", conductor("ggx", alpha_u=0.15, alpha_v=0.5)),
    "plastic05": ("rough plastic α 0.05", PLASTIC.format(alpha=0.05)),
    "plastic3": ("rough plastic α 0.3", PLASTIC.format(alpha=0.3)),
    "coat": ("principled, clear coat", principled(roughness=0.6, clearcoat=1, clearcoat_gloss=0.7)),
    "sheen": ("principled, sheen", principled(roughness=0.8, sheen=1)),
    "metal": ("principled, metal", principled(roughness=0.5, metallic=0.8)),
    "textured": (
        "diffuse, textured",
        '<bsdf type="diffuse" id="wall"><texture type="checkerboard" name="reflectance">'
        '<rgb name="color0" value="0.3"/><rgb name="color1" value="0.7"/>'
        '<transform name="to_uv"><scale x="4" y="4"/></transform></texture></bsdf>',
    ),
    "bumps": (
        "diffuse, bumps",
        '<bsdf type="bumpmap" id="wall"><texture type="bitmap" name="arbitrary">'
        '<string name="filename" value="bumps.png"/><boolean name="raw" value="true"/></texture>'
        f'<float name="scale" value="{SWELL}"/><bsdf type="diffuse">'
        '<rgb name="reflectance" value="0.5"/></bsdf></bsdf>',
    ),
    "mixed": (
        "diffuse and conductor, half each",
        '<bsdf type="blendbsdf" id="wall"><float name="weight" value="0.5"/><bsdf type="diffuse">'
        '<rgb name="reflectance" value="0.5"/></bsdf>'
        + conductor("ggx", alpha=0.3).replace(' id="wall"', "")
        + "</bsdf>",
    ),
}
"""What a reader calls each, and the BSDF."""

WALLS = (  # half sides, turn about an axis, and middle of each wall; normals inward
    ("floor", (WIDTH / 2, DEPTH / 2), "", (WIDTH / 2, DEPTH / 2, 0)),
    ("ceiling", (WIDTH / 2, DEPTH / 2), 'x="1" angle="180"', (WIDTH / 2, DEPTH / 2, HEIGHT)),
    ("west", (HEIGHT / 2, DEPTH / 2), 'y="1" angle="90"', (0, DEPTH / 2, HEIGHT / 2)),
    ("east", (HEIGHT / 2, DEPTH / 2), 'y="1" angle="-90"', (WIDTH, DEPTH / 2, HEIGHT / 2)),
    ("south", (WIDTH / 2, HEIGHT / 2), 'x="1" angle="-90"', (WIDTH / 2, 0, HEIGHT / 2)),
    ("north", (WIDTH / 2, HEIGHT / 2), 'x="1" angle="90"', (WIDTH / 2, DEPTH, HEIGHT / 2)),
)


def room_of(material: str) -> Room:
    """The room in that material, with one light, which is to be replaced."""
    _, bsdf = MATERIALS[material]
    shapes = [
        f'<shape type="rectangle" id="{name}"><transform name="to_world">'
        f'<scale x="{a}" y="{b}"/>{f"<rotate {turn}/>" if turn else ""}'
        f'<translate x="{p[0]}" y="{p[1]}" z="{p[2]}"/></transform><ref id="wall"/></shape>'
        for name, (a, b), turn, p in WALLS
    ]
    light = '<emitter type="point"><point name="position" x="2" y="2" z="1.5"/></emitter>'
    with tempfile.TemporaryDirectory(prefix="lightloc-") as folder:
        file = Path(folder) / f"{material}.xml"
        if material == "bumps":
            imsave(file.with_name("bumps.png"), bumps(), cmap="gray", vmin=0, vmax=1)
        file.write_text(f'<scene version="3.0.0">{bsdf}{"".join(shapes)}{light}</scene>')
        return render.load(file, unit="m")


def bumps() -> NDArray[np.float64]:
    """(h, w) heights of a surface that swells and falls, 0 to 1."""
    x = np.linspace(0, 2 * np.pi * WAVES, 1024, endpoint=False)
    return 0.5 + np.outer(np.sin(x), np.sin(x)) / 2


def lit(room: Room, count: int, rng: np.random.Generator) -> Room:
    """The room with so many lights, in free space and apart."""
    lights: PointLights = random_lights(room, count, rng)
    return render.relight(room, lights)
