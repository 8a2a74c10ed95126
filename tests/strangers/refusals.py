"""What can't be rendered, or is not modelled: one true sentence, with the file and the line."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import stranger
from strangers.words import (
    ball,
    block,
    bsdf,
    diffuse,
    emitter,
    node,
    number,
    rgb,
    room,
    shape,
    string,
    texture,
)
from strangers.world import World


def around(w: World, *inside: str) -> list[str]:
    """A room with a ball that has this inside."""
    return [room(w), ball(w, (3, 2.2, 0.4), 0.4, *inside)]


FOG = node("medium", "homogeneous", number("scale", 0.1), name="interior")
LEAF = texture("checkerboard").replace("<texture", '<texture name="opacity"')
HOT = (
    '<spectrum name="radiance" type="blackbody"><float name="temperature" value="3000"/></spectrum>'
)


@stranger(refused=("medium", "not modelled"))
def fog(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("null"), FOG)


@stranger(refused=("medium", "not modelled"))
def smoke_in_glass(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("dielectric"), FOG)


@stranger(refused=("see-through",))
def window(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("thindielectric"))


@stranger(refused=("see-through",))
def leaf(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("mask", LEAF, diffuse(0.4)))


@stranger(refused=("blackbody", "RGB"))
def hot_panel(w: World, folder: Path) -> list[str]:
    return around(w, emitter("area", HOT))


@stranger(refused=("'directionalarea'", "one direction"))
def laser_panel(w: World, folder: Path) -> list[str]:
    return around(w, emitter("directionalarea", rgb("radiance", 1.5)))


@stranger(refused=("'timed_sunsky'", "moves with time"))
def sky_by_the_hour(w: World, folder: Path) -> list[str]:
    return [room(w), emitter("timed_sunsky", number("turbidity", 3))]


@stranger(refused=("gone.ply", "no such file"))
def missing_mesh(w: World, folder: Path) -> list[str]:
    return [room(w), shape("ply", string("filename", "gone.ply"), diffuse())]


@stranger(refused=("gone.png", "No such file"))
def missing_picture(w: World, folder: Path) -> list[str]:
    shown = texture("bitmap", string("filename", "gone.png"))
    return around(w, bsdf("diffuse", shown.replace("<texture", '<texture name="reflectance"')))


@stranger(refused=("no bsdf 'phong'",), version="0.5.0")
def phong(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("phong", number("exponent", 30)))


@stranger(refused=("no bsdf 'ward'",), version="0.6.0")
def ward(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("ward", number("alphaU", 0.1)))


@stranger(refused=("no shape 'heightfield'",), version="0.5.0")
def height_field(w: World, folder: Path) -> list[str]:
    return [room(w), shape("heightfield", string("filename", "hills.exr"))]


@stranger(refused=("no emitter 'sky'",), version="0.6.0")
def old_sky(w: World, folder: Path) -> list[str]:
    return [room(w), emitter("sky", number("turbidity", 3))]


@stranger(refused=("bsdf 'diffuse'", "property 'gloss'"))
def unknown_property(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("diffuse", number("gloss", 0.2)))


@stranger(refused=("undefined parameter: $shade",))
def missing_parameter(w: World, folder: Path) -> list[str]:
    return around(w, bsdf("diffuse", rgb("reflectance", "$shade")))


@stranger(refused=("<luminaire>",), version="0.3.0")
def luminaire(w: World, folder: Path) -> list[str]:
    return [room(w), block(w), emitter("constant").replace("emitter", "luminaire")]


@stranger(refused=("has no point emitter 'desk'",), find=["desk"], line=False)
def another_name(w: World, folder: Path) -> list[str]:
    return [room(w), block(w)]
