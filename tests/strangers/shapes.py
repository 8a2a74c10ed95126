"""Shapes of every kind, and lights in odd places among them."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import ONE, TWO, stranger
from strangers.things import cuboid, globe, obj
from strangers.words import (
    ball,
    block,
    both,
    bsdf,
    diffuse,
    moved,
    number,
    room,
    scaled,
    shape,
    string,
    turned,
    yes,
)
from strangers.world import World


@stranger(lights=TWO)
def round_things(w: World, folder: Path) -> list[str]:
    """A disk and a cylinder."""
    table = w.place(scaled(0.5, 0.5, 1) + moved(2, 1.5, 0.8))
    foot = w.place(scaled(0.1, 0.1, 0.8) + moved(2, 1.5, 0))
    return [
        room(w),
        shape("disk", table, both(diffuse(0.4))),
        shape("cylinder", foot, diffuse(0.6, 0.4, 0.3)),
    ]


@stranger()
def smooth_mesh(w: World, folder: Path) -> list[str]:
    """A coarse ball of quadrangles that looks round by its normals."""
    name = obj(w, folder / "ball.obj", *globe((2.6, 1.9, 0.5), 0.45))
    return [room(w), shape("obj", string("filename", name), diffuse(0.5))]


@stranger()
def flat_mesh(w: World, folder: Path) -> list[str]:
    """The same without them."""
    name = obj(w, folder / "ball.obj", *globe((2.6, 1.9, 0.5), 0.45)[:2])
    return [room(w), shape("obj", string("filename", name), yes("face_normals"), diffuse(0.5))]


@stranger()
def hair(w: World, folder: Path) -> list[str]:
    """Curves in the way of light."""
    strands = [
        "\n".join(f"{w.point(2 + 0.1 * i, 1.5, 0.1 * j)} {w.length(0.02)}" for j in range(6))
        for i in range(6)
    ]
    (folder / "hair.txt").write_text("\n\n".join(strands) + "\n")
    return [room(w), shape("bsplinecurve", string("filename", "hair.txt"), diffuse(0.3))]


@stranger()
def placed_mesh(w: World, folder: Path) -> list[str]:
    """A mesh on disk that its transform mirrors and turns."""
    name = obj(World(), folder / "block.obj", *cuboid((0, 0, 0), (0.5, 0.6, 0.9)))
    put = w.place(scaled(-1, 1, 1) + turned("z", 20.0) + moved(2.4, 1.2, 0.01))
    return [room(w), shape("obj", string("filename", name), put, diffuse(0.4))]


@stranger(lights=(((2.05, 1.5, 0.95), (0.5,)), *ONE))
def light_on_a_block(w: World, folder: Path) -> list[str]:
    """Five centimetres above it."""
    return [room(w), block(w)]


@stranger(lights=(*ONE, ((6.0, 4.0, 5.0), (30.0,))))
def light_outside(w: World, folder: Path) -> list[str]:
    """A lamp that the walls of the room keep out, and one within."""
    return [room(w), block(w), ball(w, (7, 4, 3), 0.5, diffuse(0.5), id="moon")]


@stranger(lights=(((1.2, 2.1, 1.9), (2.0, 0.0, 0.0)), ((3.1, 0.8, 1.1), (0.0, 0.0, 3.0))))
def red_and_blue(w: World, folder: Path) -> list[str]:
    return [room(w), block(w)]


@stranger(lights=TWO)
def metal_room(w: World, folder: Path) -> list[str]:
    """Walls of rough aluminium, and a smooth ball in them."""
    wall = bsdf("roughconductor", string("material", "Al"), number("alpha", 0.5))
    return [room(w, both(wall)), ball(w, (2.6, 1.9, 0.5), 0.45, diffuse(0.5))]
