"""What of a scene is built: parts that nothing here uses are left out, unknown ones refused."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from render import rough_diffuse
from render.bitmaps import check_bitmap
from render.built import SIGNED, bsdf_fault, number_fault, picture_fault, shape_fault
from render.instances import expand
from render.meshes import FORMATS, check_mesh
from render.scene_file import SceneFile, one_line, references
from render.volumes import check_volume

SIZE = ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y")
NOT_IN_RGB = ("blackbody", "regular", "irregular")  # spectra that Mitsuba evaluates by wavelength
GRIDS = ("gridvolume", "sdfgrid")
PICTURES = ("bitmap", "gridvolume")
DEEPEST = 8  # BSDFs within each other
UNRENDERED = {  # emitters that Mitsuba's paths do not serve
    "directionalarea": "sends light in one direction only, which no path finds",
    "timed_sunsky": "moves with time, and Mitsuba 3.9 can't trace paths to it",
}
FREE = ("Film", "Sampler", "ReconstructionFilter")  # they may have properties that nobody knows
DEFINED = ("BSDF", "Texture", "Volume", "Medium", "PhaseFunction")  # to be referred to

INVERSE = 1e-2  # how far a matrix times its inverse may be from 1


def build(file: SceneFile) -> Any:
    """The scene of a file as a Mitsuba scene, without what is not used.

    Integrators, and films, samplers and sensors that this Mitsuba does not have, are left out, as
    are definitions that nothing refers to. A ``null`` surface that bounds no medium is none, and
    instances are copies of what they repeat, as far as that can be; see `expand`.

    Raises
    ------
    ValueError
        In one sentence with the file and the line, for a mesh that is broken, a plugin or property
        that this Mitsuba does not have, and what is not modelled: media, surfaces that are
        see-through, spectra that RGB has no colours for, and emitters that no path finds.
    """
    if file.root.type != mi.ObjectType.Scene:
        raise file.refused(file.root, f"holds a {_kind(file.root)}; expected a scene")
    for node in file.nodes():
        _check_transforms(file, node)
    expand(file)
    _leave_out(file)
    nodes = file.nodes()
    for node in nodes:
        _check(file, node)
    _check_files(file, nodes)
    shapes = [
        (node, key, part)
        for node in nodes
        for key, part in file.parts(node)
        if part.type.name == "Shape" and part.props.plugin_name() != "shapegroup"
    ]
    pictures = [
        (node, key, part) for node in nodes for key, part in file.parts(node) if _is_picture(part)
    ]
    scene = file.build()
    for node in nodes:
        _unknown_property(file, node)
    for node, key, part in shapes:
        _see_through(file, part, node.props[key])
        _check_shape(file, part, node.props[key])
    for node, key, part in pictures:
        _check_picture(file, part, node.props[key])
    return scene


def _leave_out(file: SceneFile) -> None:
    """Drop the parts that the scene is observed without."""
    for node in file.nodes():
        for key, part in file.parts(node):
            kind = part.type.name
            if kind == "Integrator" or (kind in (*FREE, "Sensor") and not _is_known(part)):
                if kind == "Film":
                    part.props = _plain_film(part.props)
                else:
                    del node.props[key]
            elif kind == "Shape" and _is_nothing(file, part):
                del node.props[key]
            elif kind == "BSDF" and _opacity(part) == 1:
                inside = next((k for k, p in file.parts(part) if p.type.name == "BSDF"), None)
                if inside is not None:
                    node.props[key] = part.props[inside]
    inner = [node for node in file.nodes() if node.type != mi.ObjectType.Scene]
    named = {number for node in inner for _, number in references(node)}
    for key, number in references(file.root):
        if file.state.nodes[number].type.name in DEFINED and number not in named:
            del file.root.props[key]


def _is_known(node: Any) -> bool:
    name = node.props.plugin_name()
    if name == rough_diffuse.NAME:  # Mitsuba tells of its own plugins alone
        return bool(node.type == mi.ObjectType.BSDF)
    return bool(mi.PluginManager.instance().plugin_type(name) != mi.ObjectType.Unknown)


def _plain_film(props: Any) -> Any:
    """A film that Mitsuba has, of the same size."""
    film = mi.Properties("hdrfilm")
    for key in SIZE:
        if key in props:
            film[key] = props[key]
    return film


def _is_nothing(file: SceneFile, shape: Any) -> bool:
    """Whether a shape changes no light: it is ``null`` all over, and bounds or bears nothing."""
    parts = [part for _, part in file.parts(shape)]
    if len(parts) != 1 or parts[0].type.name != "BSDF":
        return False
    return bool(parts[0].props.plugin_name() == "null" or _opacity(parts[0]) == 0)


def _opacity(bsdf: Any) -> float | None:
    """The opacity of a mask that is the same everywhere; None of anything else."""
    props = bsdf.props
    if props.plugin_name() != "mask" or "opacity" not in props:
        return None
    kind, value = props.type("opacity"), props["opacity"]
    if kind == mi.Properties.Type.Spectrum and value.is_uniform():
        value = value.values
    elif kind not in (mi.Properties.Type.Float, mi.Properties.Type.Color):
        return None
    values = np.unique(np.array(value, float))
    return float(values[0]) if len(values) == 1 else None


def _check(file: SceneFile, node: Any) -> None:
    """Refuse a node that Mitsuba does not have, that would end the process, or is not modelled."""
    kind, plugin = node.type.name, node.props.plugin_name()
    parts = [part for _, part in file.parts(node)]
    why, _ = None, node.props.id()  # UnicodeDecodeError, rather than where it is used
    if not _is_known(node):
        near = _nearest(node)
        why = f"this Mitsuba has no {_kind(node)} '{plugin}'"
        why += f"; did you mean '{near}'?" if near else ""
    elif kind == "Shape" and any(part.props.plugin_name() == "point" for part in parts):
        why = f"{_name(node)} has a point emitter; expected one that is no shape's"
    elif kind != "Scene" and any(part.type.name == "Medium" for part in parts):
        why = f"{_name(node)} has a participating medium; media are not modelled"
    elif kind == "Texture" and plugin in NOT_IN_RGB:
        why = f"a spectrum of type '{plugin}' has no colour in RGB; expected <rgb> or its values"
    elif plugin in UNRENDERED:
        why = f"the emitter '{plugin}' {UNRENDERED[plugin]}; expected another"
    elif plugin == "bitmap" and not {"filename", "bitmap"} & set(node.props.keys()):
        why = "a bitmap has no filename"
    elif plugin == "blendbsdf" and sum(part.type.name == "BSDF" for part in parts) != 2:
        why = "a blendbsdf has other than two BSDFs"
    elif kind == "BSDF" and _is_deep(file, node, DEEPEST):
        why = f"BSDFs are nested more than {DEEPEST} deep"
    elif plugin == rough_diffuse.NAME:
        why = rough_diffuse.fault(node.props)
    elif plugin == "shapegroup" and not any(part.type.name == "Shape" for part in parts):
        why = f"{_name(node)} is a shape group without a surface"
    elif (kind == "BSDF" and plugin not in SIGNED) or plugin == "uniform":
        why = number_fault(node.props)
    if why:
        raise file.refused(node, why)


def _nearest(node: Any) -> str | None:
    """The plugin of the same kind whose name is nearest to one that there is not, if any is."""
    manager = mi.PluginManager.instance()
    names = [path.stem for path in (Path(mi.__file__).parent / "plugins").iterdir()]
    near = get_close_matches(node.props.plugin_name(), sorted({*names, rough_diffuse.NAME}), n=5)
    kinds = {rough_diffuse.NAME: mi.ObjectType.BSDF}  # Mitsuba tells of its own plugins alone
    same = (name for name in near if kinds.get(name, manager.plugin_type(name)) == node.type)
    return next(same, None)


def _is_deep(file: SceneFile, node: Any, left: int) -> bool:
    """Whether BSDFs are nested deeper; each that is two-sided doubles what is within."""
    inside = [part for _, part in file.parts(node) if part.type.name == "BSDF"]
    return left < 1 or any(_is_deep(file, part, left - 1) for part in inside)


def _check_transforms(file: SceneFile, node: Any) -> None:
    """Refuse a transform that Mitsuba takes, and then renders as no surface can be.

    It does not shorten an axis of rotation to length 1, so that its inverse is of something else.
    """
    props = mi.Properties(node.props)  # what is read of the node itself counts as known
    kept = [key for key in props.keys() if props.type(key) == mi.Properties.Type.Transform]  # noqa: SIM118
    for key in kept:
        matrix, back = (
            np.array(m, float) for m in (props[key].matrix, props[key].inverse_transpose)
        )
        if not np.isfinite(matrix).all():
            continue  # said of the shape that it makes
        with np.errstate(all="ignore"):
            there = matrix @ back.T
        if not (np.isfinite(there).all() and np.abs(there - np.eye(len(there))).max() < INVERSE):
            raise file.refused(
                node,
                f"{_name(node)} has a {key} without an inverse; expected no scale of 0, and "
                "rotations about axes of length 1",
            )
        sizes = np.linalg.norm(matrix[:3, :3], axis=0)
        if props.plugin_name() == "sphere" and np.ptp(sizes) > INVERSE * sizes.max():
            raise file.refused(
                node, f"{_name(node)} is a sphere that is stretched; expected one scale, or a mesh"
            )


def _check_files(file: SceneFile, nodes: list[Any]) -> None:
    """Refuse files that Mitsuba could not be asked to build a scene on, each read once."""
    checked = set()
    for node in nodes:
        kind, props = node.props.plugin_name(), node.props
        if kind not in (*FORMATS, *GRIDS, "bitmap") or "filename" not in props:
            continue
        named = file.find(str(props["filename"]))
        whole = "shape_index" in props and props.type("shape_index") == mi.Properties.Type.Integer
        index = props["shape_index"] if kind == "serialized" and whole else 0
        if (kind, named, index) in checked:
            continue
        try:
            if kind in FORMATS:
                check_mesh(kind, named, index)
            elif kind in GRIDS:
                check_volume(named)
            else:
                check_bitmap(named)
        except ValueError as error:
            raise file.refused(node, str(error)) from None
        checked.add((kind, named, index))


def _unknown_property(file: SceneFile, node: Any) -> None:
    """Refuse a property that its plugin never asked for: something else would be rendered."""
    unknown = node.props.unqueried()
    if unknown and node.type.name not in FREE:
        nameless = unknown[0].startswith("_arg_")
        what = "place for an object in it" if nameless else f"property '{unknown[0]}'"
        plugin = node.props.plugin_name()
        raise file.refused(node, f"the {_kind(node)} '{plugin}' has no {what} in this Mitsuba")


def _see_through(file: SceneFile, node: Any, shape: Any) -> None:
    bsdf = shape.bsdf()
    if bsdf is not None and mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null):
        raise file.refused(
            node,
            f"{_name(node)} is partly see-through; the light that goes straight through it is "
            "not modelled",
        )


def _check_shape(file: SceneFile, node: Any, shape: Any) -> None:
    if why := shape_fault(shape):
        raise file.refused(node, f"{_name(node)} {why}")
    if shape.bsdf() is not None and (why := bsdf_fault(shape)):
        raise file.refused(node, f"the BSDF of {_name(node)} can't be evaluated: {one_line(why)}")


def _is_picture(node: Any) -> bool:
    return node.type.name in ("Texture", "Volume") and node.props.plugin_name() in PICTURES


def _check_picture(file: SceneFile, node: Any, picture: Any) -> None:
    props = node.props
    raw = "raw" in props and props.type("raw") == mi.Properties.Type.Bool and bool(props["raw"])
    if why := picture_fault(picture, raw):
        named = props["filename"] if "filename" in props else f"the {_kind(node)}"
        raise file.refused(node, f"{named} {why}")


def _kind(node: Any) -> str:
    """As a tag of the file has it."""
    return str(node.type.name).lower()


def _name(node: Any) -> str:
    own = node.props.id()
    return f"{_kind(node)} '{own}'" if own else f"the {_kind(node)}"
