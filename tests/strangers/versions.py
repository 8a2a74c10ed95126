"""Files of Mitsuba 0.5 to 3, and files in several parts."""

from __future__ import annotations

from pathlib import Path

from strangers.scene import TWO, Light, stranger
from strangers.things import cuboid, ply
from strangers.words import (
    ball,
    block,
    both,
    box,
    bsdf,
    diffuse,
    emitter,
    film,
    node,
    number,
    ref,
    rgb,
    room,
    sensor,
    shape,
    string,
    value,
    whole,
    yes,
)
from strangers.world import World


def old(place: str) -> str:
    return place.replace("to_world", "toWorld")


def old_lamp(w: World, light: Light, name: str) -> str:
    """A light whose position is the origin of a transform."""
    (x, y, z), intensity = light
    put = old(w.place(f'<translate x="{x}" y="{y}" z="{z}"/>'))
    power = w.power(*intensity).replace(" ", ", ")
    return emitter("point", put, rgb("intensity", power), id=name)


@stranger(version="0.5.0", lamp=old_lamp, lights=TWO)
def old_camera(w: World, folder: Path) -> list[str]:
    """Camel case, lookAt, the film and the sampler of 0.5."""
    eye = old(w.aim((0.3, 0.3, 1.5), (3, 2, 1), tag="lookAt"))
    picture = film(
        "hdrfilm", string("pixelFormat", "rgb"), '<boolean name="banner" value="false"/>'
    )
    sampler = node("sampler", "ldsampler", whole("sampleCount", 64))
    camera = sensor("perspective", eye, string("fovAxis", "smaller"), number("fov", 60))
    pot = ball(w, (2.6, 1.9, 0.4), 0.4, bsdf("roughplastic", number("intIOR", 1.4)))
    return [
        '<integrator type="path"><integer name="maxDepth" value="8"/></integrator>',
        camera.replace("</sensor>", f"{picture}{sampler}</sensor>"),
        room(w).replace("to_world", "toWorld"),
        pot,
    ]


@stranger(version="0.5.0", lamp=old_lamp)
def old_spectra(w: World, folder: Path) -> list[str]:
    """Reflectances by wavelength."""
    values = "400:0.3, 500:0.4, 600:0.6, 700:0.5"
    wall, grey = (
        bsdf("diffuse", value("spectrum", "reflectance", what)) for what in (values, 0.35)
    )
    return [old(room(w, both(wall))), old(block(w, grey))]


@stranger(version="0.5.0", lamp=old_lamp)
def old_colours(w: World, folder: Path) -> list[str]:
    """Colours of screens, and in hexadecimal."""
    wall = '<bsdf type="diffuse"><srgb name="reflectance" value="#c8b4a0"/></bsdf>'
    grey = '<bsdf type="diffuse"><srgb name="reflectance" value="0.5, 0.6, 0.7"/></bsdf>'
    red = '<bsdf type="diffuse"><rgb name="reflectance" value="#ff8800"/></bsdf>'
    return [old(room(w, both(wall))), old(block(w, grey)), ball(w, (3, 2.2, 0.4), 0.4, red)]


@stranger(version="0.6.0")
def old_names(w: World, folder: Path) -> list[str]:
    """Definitions before their use, referred to by name; reconstruction filters of 0.6."""
    lens = film("hdrfilm", whole("width", 64), whole("height", 48), node("rfilter", "gaussian"))
    eye = old(w.aim((0.3, 0.3, 1.5), (3, 2, 1)))
    metal = bsdf("roughconductor", number("alpha", 0.3), string("material", "Al"))
    return [
        bsdf("twosided", diffuse(0.6, 0.5, 0.4), id="wall-material"),
        metal.replace("<bsdf", '<bsdf id="Metal_01"', 1),
        sensor("perspective", eye, number("nearClip", 0.1), number("farClip", 1e4), lens),
        old(room(w, '<ref name="bsdf" id="wall-material"/>')),
        ball(w, (2.6, 1.9, 0.5), 0.4, ref("Metal_01")),
    ]


@stranger(version="2.0.0", lights=TWO)
def second(w: World, folder: Path) -> list[str]:
    """Mitsuba 2: underscores, an integrator and a film of its own."""
    lens = film("hdrfilm", string("pixel_format", "rgba"), yes("high_quality_edges"))
    return [
        node("integrator", "volpathmis", whole("max_depth", 16)),
        sensor("perspective", w.aim((0.3, 0.3, 1.5), (3, 2, 1)), number("fov", 70), lens),
        room(w),
        block(w, bsdf("plastic", rgb("diffuse_reflectance", "0.4 0.2 0.1"), yes("nonlinear"))),
    ]


@stranger(version="2.1.0")
def matrices(w: World, folder: Path) -> list[str]:
    """Placed by matrices of sixteen numbers, as exporters do."""
    rows = "2 0 0 2  0 1.5 0 1.5  0 0 1.25 1.25  0 0 0 1"
    lean = "0.3 -0.1 0 2.2 0.1 0.3 0 1.4 0 0 0.4 0.4 0 0 0 1"
    return [
        shape("cube", w.place(f'<matrix value="{rows}"/>'), both(), id="room"),
        shape("cube", w.place(f'<matrix value="{lean}"/>'), diffuse(0.3)),
    ]


@stranger(lights=TWO)
def parts(w: World, folder: Path) -> list[str]:
    """Walls in a file of their own, meshes in a folder, another name for a material."""
    name = ply(w, folder / "meshes" / "block.ply", *cuboid((1.8, 1.2, 0), (2.3, 1.8, 0.9)))
    (folder / "parts").mkdir(exist_ok=True)
    walls = bsdf("twosided", diffuse(0.6), id="grey") + room(w, ref("grey"))
    (folder / "parts" / "walls.xml").write_text(f'<scene version="3.0.0">{walls}</scene>')
    return [
        '<path value="meshes"/>',
        '<include filename="parts/walls.xml"/>',
        shape("ply", string("filename", name), ref("grey")),
    ]


@stranger()
def aliased(w: World, folder: Path) -> list[str]:
    """One material under two names."""
    return [
        bsdf("twosided", diffuse(0.4), id="grey") + '<alias id="grey" as="wall"/>',
        room(w, ref("wall")),
        block(w, ref("grey")),
    ]


@stranger(values={"tall": 0.9})
def parameters(w: World, folder: Path) -> list[str]:
    """Numbers with a default, and one without."""
    return [
        '<default name="albedo" value="0.6"/>',
        '<default name="spp" value="16"/>',
        node(
            "sensor", "perspective", node("sampler", "independent", whole("sample_count", "$spp"))
        ),
        room(w, both(bsdf("diffuse", rgb("reflectance", "$albedo")))),
        box(w, (1.8, 1.2, 0), (2.3, 1.8, 0.9), bsdf("diffuse", rgb("reflectance", "$tall"))),
    ]


@stranger()
def dotted(w: World, folder: Path) -> list[str]:
    """Names as Blender gives them."""
    return [
        bsdf("twosided", diffuse(0.5), id="Material.001"),
        box(w, (0, 0, 0), (4, 3, 2.5), ref("Material.001"), id="Cube.001"),
        block(w, ref("Material.001"), id="Cube.002"),
    ]


@stranger(lights=TWO)
def others_plugins(w: World, folder: Path) -> list[str]:
    """An integrator, a film, a filter and a sampler that this Mitsuba does not have."""
    lens = film("mfilm", whole("width", 32), node("rfilter", "sinc"))
    sampler = node("sampler", "sobol", whole("sample_count", 64))
    return [
        node("integrator", "bdpt", whole("max_depth", -1), yes("light_image")),
        sensor("perspective", w.aim((0.3, 0.3, 1.5), (3, 2, 1)), lens, sampler),
        room(w),
        block(w),
    ]
