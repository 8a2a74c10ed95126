"""Light of every kind beside the point lights that are to be found."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strangers.scene import ONE, TWO, stranger
from strangers.things import cuboid, picture, ply, tiles
from strangers.words import (
    ball,
    block,
    both,
    box,
    diffuse,
    emitter,
    moved,
    number,
    rgb,
    room,
    scaled,
    shape,
    square,
    string,
    texture,
    turned,
)
from strangers.world import World

UNDER = scaled(0.4, 0.3, 1) + turned("x", 180.0) + moved(2.5, 1, 2.4)  # the ceiling, facing down


def area(*radiance: str) -> str:
    return emitter("area", *radiance)


def plain(value: float) -> str:
    return area(rgb("radiance", value))


def yard(w: World) -> list[str]:
    """Open to the sky: ground, a wall, a block and a ball, a centimetre above the ground.

    Faces that coincide, of which one is lit from below, are one or the other by rounding.
    """
    ground = scaled(3, 2.5, 1) + moved(2, 1.5, 0)
    wall = scaled(2, 1, 1) + turned("x", 90.0) + moved(2, 3, 1)
    return [
        square(w, ground, diffuse(0.4), id="ground"),
        square(w, wall, both(), id="wall"),
        box(w, (1.8, 1.2, 0.01), (2.3, 1.8, 0.9), diffuse(0.3)),
        ball(w, (3, 2.2, 0.41), 0.4, diffuse(0.6)),
    ]


@stranger()
def panel(w: World, folder: Path) -> list[str]:
    return [room(w), square(w, UNDER, plain(3.0), id="panel")]


@stranger()
def bulb(w: World, folder: Path) -> list[str]:
    return [room(w), ball(w, (3, 1, 1.8), 0.15, plain(8.0))]


@stranger()
def glowing_mesh(w: World, folder: Path) -> list[str]:
    name = ply(w, folder / "tube.ply", *cuboid((1, 1, 2.2), (2.4, 1.1, 2.3)))
    return [room(w), block(w), shape("ply", string("filename", name), plain(3.0))]


@stranger()
def glowing_picture(w: World, folder: Path) -> list[str]:
    """A screen: radiance that a bitmap gives."""
    name = picture(folder / "screen.exr", tiles(np.random.default_rng(5), low=0.0, high=6.0))
    shown = texture("bitmap", string("filename", name), '<boolean name="raw" value="true"/>')
    shown = shown.replace("<texture", '<texture name="radiance"', 1)
    return [room(w), square(w, UNDER, area(shown))]


@stranger()
def constant_sky(w: World, folder: Path) -> list[str]:
    return [*yard(w), emitter("constant", rgb("radiance", "0.3 0.35 0.4"))]


@stranger()
def picture_sky(w: World, folder: Path) -> list[str]:
    """An environment with a bright patch."""
    sky = np.full((16, 32, 3), 0.2)
    sky[3:5, 8:11] = (6.0, 5.0, 4.0)
    name = picture(folder / "sky.exr", sky)
    turn = f'<transform name="to_world">{turned("x", 90.0)}</transform>'
    return [*yard(w), emitter("envmap", string("filename", name), number("scale", 0.8), turn)]


@stranger()
def spot(w: World, folder: Path) -> list[str]:
    aim = w.aim((3, 2, 2.3), (1, 1, 0))
    cone = number("cutoff_angle", 35) + number("beam_width", 20)
    return [room(w), block(w), emitter("spot", aim, rgb("intensity", w.power(4.0)), cone)]


@stranger()
def sun(w: World, folder: Path) -> list[str]:
    beam = f'<vector name="direction" value="{w.vector(0.3, 0.4, -1)}"/>'
    return [*yard(w), emitter("directional", beam, rgb("irradiance", "1.5 1.4 1.2"))]


@stranger()
def projector(w: World, folder: Path) -> list[str]:
    name = picture(folder / "slide.exr", tiles(np.random.default_rng(6)))
    slide = texture("bitmap", string("filename", name), '<boolean name="raw" value="true"/>')
    slide = slide.replace("<texture", '<texture name="irradiance"', 1)
    beam = [w.aim((3, 2, 2.3), (1, 1, 0)), number("fov", 50), number("scale", w.power(4.0))]
    return [room(w), emitter("projector", *beam, slide)]


@stranger()
def sunsky(w: World, folder: Path) -> list[str]:
    to = f'<vector name="sun_direction" value="{w.vector(0.4, 0.3, 0.8)}"/>'
    scale = number("sun_scale", 0.5) + number("sky_scale", 1.0)
    return [*yard(w), emitter("sunsky", to, number("turbidity", 4), scale)]


@stranger(lights=TWO)
def several(w: World, folder: Path) -> list[str]:
    return [*panel(w, folder), *spot(w, folder)[1:], ball(w, (0.6, 0.7, 0.5), 0.1, plain(4.0))]


@stranger(lights=ONE, find=["lamp_1"])
def one_by_name(w: World, folder: Path) -> list[str]:
    """Two point lights, of which the user looks for one."""
    other = f'<point name="position" value="{w.point(3.1, 0.8, 1.1)}"/>'
    return [room(w), block(w), emitter("point", other, rgb("intensity", w.power(3.0)), id="known")]


@stranger(lights=())
def no_light_to_find(w: World, folder: Path) -> list[str]:
    return panel(w, folder)


@stranger(lights=(((1.2, 2.1, 1.9), (2.0, 1.0, 0.5)), ((3.1, 0.8, 1.1), (0.5, 1.5, 3.0))))
def coloured_lights(w: World, folder: Path) -> list[str]:
    return [room(w), block(w), box(w, (3, 2, 0), (3.5, 2.5, 0.5), diffuse(0.6, 0.3, 0.2))]
