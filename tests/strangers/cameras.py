"""No camera, several, and of every kind: points are observed alike."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import TWO, stranger
from strangers.words import (
    block,
    both,
    diffuse,
    film,
    moved,
    node,
    number,
    room,
    scaled,
    sensor,
    square,
    turned,
    whole,
)
from strangers.world import World

EYE, TARGET = (0.3, 0.3, 1.5), (3.0, 2.0, 1.0)


def scene(w: World, *cameras: str) -> list[str]:
    return [room(w), block(w), *cameras]


@stranger(lights=TWO)
def without_camera(w: World, folder: Path) -> list[str]:
    return scene(w)


@stranger(lights=TWO)
def three_cameras(w: World, folder: Path) -> list[str]:
    eyes = (EYE, (3.7, 0.3, 1.8), (3.5, 2.7, 0.6))
    return scene(w, *(sensor("perspective", w.aim(eye, (2, 1.5, 0.5))) for eye in eyes))


@stranger(lights=TWO)
def thin_lens(w: World, folder: Path) -> list[str]:
    lens = [number("aperture_radius", w.length(0.02)), number("focus_distance", w.length(2.0))]
    return scene(w, sensor("thinlens", w.aim(EYE, TARGET), number("fov", 50), *lens))


@stranger(lights=TWO)
def orthographic(w: World, folder: Path) -> list[str]:
    return scene(w, sensor("orthographic", w.aim((2, 1.5, 2.4), (2, 1.5, 0), up=(0, 1, 0))))


@stranger(lights=TWO)
def unknown_camera(w: World, folder: Path) -> list[str]:
    return scene(w, sensor("fisheye", w.aim(EYE, TARGET), number("kc", 0.1)))


@stranger(lights=TWO)
def cropped(w: World, folder: Path) -> list[str]:
    size = [whole("width", 64), whole("height", 48), whole("crop_width", 16)]
    size += [whole("crop_height", 12), whole("crop_offset_x", 20), whole("crop_offset_y", 8)]
    sampler = node("sampler", "stratified", whole("sample_count", 16))
    return scene(w, sensor("perspective", w.aim(EYE, TARGET), film("hdrfilm", *size), sampler))


@stranger(lights=TWO)
def outside_the_room(w: World, folder: Path) -> list[str]:
    """A camera behind a wall, as where that is hidden in the modeller."""
    return scene(w, sensor("perspective", w.aim((2, -5, 1.5), (2, 1.5, 1.0))))


@stranger()
def open_side(w: World, folder: Path) -> list[str]:
    """A stage of floor and two walls, seen by a camera in front."""
    floor = scaled(2, 1.5, 1) + moved(2, 1.5, 0)
    rear = scaled(2, 1.25, 1) + turned("x", 90.0) + moved(2, 3, 1.25)
    left = scaled(1.25, 1.5, 1) + turned("y", 90.0) + moved(0, 1.5, 1.25)
    walls = [square(w, put, both(diffuse(0.6))) for put in (floor, rear, left)]
    return [*walls, block(w), sensor("perspective", w.aim((4.5, -2, 2), (1.5, 2, 0.6)))]
