"""Surfaces seen from either side, or from the one that their normals do not say."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import ONE, TWO, stranger
from strangers.things import cuboid, ply
from strangers.words import (
    ball,
    block,
    both,
    box,
    diffuse,
    moved,
    room,
    scaled,
    shape,
    square,
    string,
    turned,
    yes,
)
from strangers.world import World

WALLS = {  # put where a square's normal looks into the room
    "floor": scaled(2, 1.5, 1) + moved(2, 1.5, 0),
    "ceiling": scaled(2, 1.5, 1) + turned("x", 180.0) + moved(2, 1.5, 2.5),
    "left": scaled(1.25, 1.5, 1) + turned("y", 90.0) + moved(0, 1.5, 1.25),
    "right": scaled(1.25, 1.5, 1) + turned("y", -90.0) + moved(4, 1.5, 1.25),
    "front": scaled(2, 1.25, 1) + turned("x", -90.0) + moved(2, 0, 1.25),
    "rear": scaled(2, 1.25, 1) + turned("x", 90.0) + moved(2, 3, 1.25),
}


@stranger(lights=TWO)
def modelled_from_outside(w: World, folder: Path) -> list[str]:
    """A cube whose normals look away from the room."""
    return [room(w), block(w, both(diffuse(0.3)))]


@stranger()
def one_sided_room(w: World, folder: Path) -> list[str]:
    """Six squares that look inward, without a twosided BSDF."""
    return [square(w, put, diffuse(0.5), id=name) for name, put in WALLS.items()]


@stranger()
def turned_away(w: World, folder: Path) -> list[str]:
    """Two-sided walls of which some look outward."""
    over = {name: turned("x", 180.0) if name in ("left", "rear", "floor") else "" for name in WALLS}
    return [square(w, over[name] + put, both(), id=name) for name, put in WALLS.items()]


@stranger(lights=TWO)
def partition(w: World, folder: Path) -> list[str]:
    """A wall without thickness between two lights."""
    wall = scaled(0.9, 1.2, 1) + turned("y", 90.0) + moved(2.1, 1.3, 0.9)
    return [room(w), square(w, wall, both(diffuse(0.4)), id="partition")]


@stranger(lights=TWO)
def two_coloured_partition(w: World, folder: Path) -> list[str]:
    """Another paint on each side of it."""
    wall = scaled(0.9, 1.2, 1) + turned("y", 90.0) + moved(2.1, 1.3, 0.9)
    return [room(w), square(w, wall, both(diffuse(0.6, 0.2, 0.2), diffuse(0.2, 0.3, 0.6)))]


@stranger()
def inside_out(w: World, folder: Path) -> list[str]:
    """A mesh whose triangles are wound the wrong way, painted on both sides."""
    vertices, faces = cuboid((1.8, 1.2, 0.01), (2.3, 1.8, 0.9))
    name = ply(w, folder / "block.ply", vertices, faces[:, ::-1])
    return [room(w), shape("ply", string("filename", name), both(diffuse(0.4)))]


@stranger()
def one_sided_mesh(w: World, folder: Path) -> list[str]:
    """A room as a mesh that looks inward, without a twosided BSDF."""
    vertices, faces = cuboid((0, 0, 0), (4, 3, 2.5))
    name = ply(w, folder / "room.ply", vertices, faces[:, ::-1])
    return [shape("ply", string("filename", name), diffuse(0.5)), block(w)]


@stranger(lights=(*ONE, ((6.0, 4.5, 2.5), (6.0,))))
def house_in_a_yard(w: World, folder: Path) -> list[str]:
    """A closed box within a larger one, a light in each."""
    yard = box(w, (-3, -3, -0.5), (7, 6, 4), both(diffuse(0.3)), id="yard")
    return [room(w), yard]


@stranger(lights=TWO)
def flipped_sphere(w: World, folder: Path) -> list[str]:
    """A round room that looks inward."""
    return [ball(w, (2, 1.5, 1.25), 2.4, yes("flip_normals"), diffuse(0.5)), block(w)]
