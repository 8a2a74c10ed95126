"""Shapes that stand in several places."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import TWO, stranger
from strangers.things import cuboid, obj
from strangers.words import diffuse, moved, ref, room, scaled, shape, string, turned
from strangers.world import World

SEAT = shape(
    "cube", f'<transform name="to_world">{scaled(0.25, 0.25, 0.05)}</transform>', diffuse(0.4)
)
BACK = shape(
    "cube",
    f'<transform name="to_world">{scaled(0.25, 0.04, 0.3)}{moved(0, 0.2, 0.3)}</transform>',
    diffuse(0.6, 0.3, 0.2),
)


def chairs(w: World, *places: str) -> list[str]:
    """A group of two shapes, and where it stands."""
    group = shape("shapegroup", SEAT, BACK, id="chair")
    return [room(w), group, *(shape("instance", ref("chair"), w.place(put)) for put in places)]


@stranger(lights=TWO)
def group_of_two(w: World, folder: Path) -> list[str]:
    return chairs(w, moved(1, 1, 0.5), moved(3, 2, 0.5))


@stranger(lights=TWO)
def rotated_instances(w: World, folder: Path) -> list[str]:
    return chairs(
        w,
        turned("z", 40.0) + moved(1, 1, 0.5),
        turned("x", 90.0) + turned("z", -70.0) + moved(3, 2, 0.6),
    )


@stranger(lights=TWO)
def scaled_instances(w: World, folder: Path) -> list[str]:
    return chairs(w, scaled(2, 2, 2) + moved(1, 1, 0.5), scaled(0.5, 0.8, 1.2) + moved(3, 2, 0.5))


@stranger(lights=TWO)
def mirrored_instances(w: World, folder: Path) -> list[str]:
    return chairs(w, scaled(-1, 1, 1) + moved(1, 1, 0.5), scaled(1, -1.2, 1) + moved(3, 2, 0.5))


@stranger()
def mesh_instances(w: World, folder: Path) -> list[str]:
    """A mesh on disk, of which there are three."""
    name = obj(World(), folder / "stool.obj", *cuboid((-0.2, -0.2, 0), (0.2, 0.2, 0.5)))
    group = shape("shapegroup", shape("obj", string("filename", name), diffuse(0.4)), id="stool.1")
    at = [moved(1, 1, 0.01), moved(3, 2, 0.01), turned("z", 30.0) + moved(2, 2.4, 0.01)]
    return [room(w), group, *(shape("instance", ref("stool.1"), w.place(put)) for put in at)]
