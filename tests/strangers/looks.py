"""Textures and BSDFs."""

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
    bsdf,
    diffuse,
    number,
    rgb,
    room,
    scaled,
    shape,
    string,
    texture,
    yes,
)
from strangers.world import World

RAW = '<boolean name="raw" value="true"/>'


def named(name: str, what: str) -> str:
    return what.replace("<texture", f'<texture name="{name}"', 1)


def bitmap(name: str, file: str, *inside: str) -> str:
    return named(name, texture("bitmap", string("filename", file), *inside))


def things(w: World, look: str) -> list[str]:
    """A room with a block and a ball that look so."""
    return [room(w), block(w, look), ball(w, (3, 2.2, 0.4), 0.4, look)]


@stranger(lights=TWO)
def bitmap_walls(w: World, folder: Path) -> list[str]:
    """Walls as a picture in sRGB has them."""
    name = picture(folder / "paint.png", tiles(np.random.default_rng(1)))
    return [room(w, both(bsdf("diffuse", bitmap("reflectance", name)))), block(w)]


@stranger(lights=TWO)
def bitmap_in_an_exr(w: World, folder: Path) -> list[str]:
    name = picture(folder / "paint.exr", tiles(np.random.default_rng(2)))
    sharp = string("filter_type", "nearest")
    return [room(w, both(bsdf("diffuse", bitmap("reflectance", name, RAW, sharp)))), block(w)]


@stranger(lights=TWO)
def chequered(w: World, folder: Path) -> list[str]:
    many = f'<transform name="to_uv">{scaled(5, 5, 1)}</transform>'
    colours = rgb("color0", "0.7 0.6 0.5") + rgb("color1", "0.1 0.2 0.2")
    tile = named("reflectance", texture("checkerboard", colours, many))
    return [room(w, both(bsdf("diffuse", tile))), block(w)]


@stranger()
def coloured_vertices(w: World, folder: Path) -> list[str]:
    vertices, faces = cuboid((1.8, 1.2, 0.01), (2.3, 1.8, 0.9))
    colours = np.random.default_rng(3).uniform(0.2, 0.8, vertices.shape)
    name = ply(w, folder / "block.ply", vertices, faces, colours)
    paint = named("reflectance", texture("mesh_attribute", string("name", "vertex_color")))
    return [room(w), shape("ply", string("filename", name), bsdf("diffuse", paint))]


def slopes(folder: Path) -> str:
    """A normal map that leans a little, here and there."""
    lean = np.random.default_rng(4).uniform(-0.15, 0.15, (16, 16, 2))
    n = np.concatenate([lean, np.ones((16, 16, 1))], axis=2)
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    return picture(folder / "normals.exr", (n + 1) / 2)


@stranger()
def normal_map(w: World, folder: Path) -> list[str]:
    lean = bitmap("normalmap", slopes(folder), RAW)
    return things(w, bsdf("normalmap", lean, diffuse(0.5)))


@stranger()
def bump_map(w: World, folder: Path) -> list[str]:
    heights = np.repeat(np.random.default_rng(7).uniform(0, 1, (16, 16, 1)), 3, axis=2)
    name = picture(folder / "heights.exr", heights)
    dents = texture("bitmap", string("filename", name), RAW)
    return things(w, bsdf("bumpmap", dents, diffuse(0.5), number("scale", w.length(0.02))))


@stranger()
def blend(w: World, folder: Path) -> list[str]:
    parts = diffuse(0.6, 0.3, 0.2), bsdf("roughconductor", number("alpha", 0.3))
    return things(w, bsdf("blendbsdf", number("weight", 0.4), *parts))


@stranger()
def principled(w: World, folder: Path) -> list[str]:
    paint = rgb("base_color", "0.6 0.4 0.2") + number("roughness", 0.5) + number("metallic", 0.3)
    return things(w, bsdf("principled", paint, number("clearcoat", 0.4), number("sheen", 0.2)))


@stranger()
def rough_plastic(w: World, folder: Path) -> list[str]:
    paint = rgb("diffuse_reflectance", "0.4 0.2 0.1") + number("alpha", 0.15)
    return things(w, bsdf("roughplastic", string("distribution", "ggx"), paint, yes("nonlinear")))


@stranger()
def beckmann_plastic(w: World, folder: Path) -> list[str]:
    return things(w, bsdf("roughplastic", string("distribution", "beckmann"), number("alpha", 0.2)))


@stranger()
def smooth_plastic(w: World, folder: Path) -> list[str]:
    return things(w, bsdf("plastic", rgb("diffuse_reflectance", "0.5 0.3 0.2")))


@stranger()
def gold(w: World, folder: Path) -> list[str]:
    kind = string("material", "Au") + string("distribution", "ggx")
    return things(w, bsdf("roughconductor", kind, number("alpha", 0.3)))


@stranger()
def brushed_metal(w: World, folder: Path) -> list[str]:
    kind = string("material", "Cu") + number("alpha_u", 0.2) + number("alpha_v", 0.5)
    return things(w, bsdf("roughconductor", kind))


@stranger()
def glass(w: World, folder: Path) -> list[str]:
    return [room(w), block(w), ball(w, (3, 2.2, 0.4), 0.4, bsdf("dielectric"))]


@stranger()
def frosted_glass(w: World, folder: Path) -> list[str]:
    kind = number("alpha", 0.3) + string("int_ior", "bk7")
    return [room(w), block(w), ball(w, (3, 2.2, 0.4), 0.4, bsdf("roughdielectric", kind))]


@stranger()
def mirror(w: World, folder: Path) -> list[str]:
    return [
        room(w),
        block(w, bsdf("conductor", string("material", "Ag"))),
        *things(w, diffuse())[2:],
    ]


@stranger(lights=TWO)
def plastic_room(w: World, folder: Path) -> list[str]:
    """Walls that shine on both sides."""
    shiny = bsdf("roughplastic", string("distribution", "ggx"), number("alpha", 0.3))
    return [room(w, both(shiny)), block(w)]


@stranger()
def opaque_mask(w: World, folder: Path) -> list[str]:
    """A mask that hides nothing."""
    return things(w, bsdf("mask", number("opacity", 1), diffuse(0.4)))


@stranger(lights=ONE)
def without_bsdf(w: World, folder: Path) -> list[str]:
    """Shapes that say nothing about how they look."""
    return [room(w), block(w, id="a"), box(w, (3, 2, 0), (3.5, 2.5, 0.5))]
