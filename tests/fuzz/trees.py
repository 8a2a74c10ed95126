"""Scenes of good parts, changed as trees."""

from __future__ import annotations

import random
from xml.etree import ElementTree

from hypothesis import strategies as st

from fuzz import odd
from fuzz.inputs import Input
from fuzz.parts import ALONE, BSDFS, FILE, MESHES, PLACE, PLUGINS, ROOM, TAGS, of, spelled


@st.composite
def shapes(draw: st.DrawFn) -> str:
    """A good shape under a good BSDF."""
    kind = draw(st.sampled_from(("rectangle", "cube", "sphere", "cylinder", "disk", *MESHES)))
    bsdf = draw(st.sampled_from(BSDFS))
    if kind in MESHES:
        plugin = kind.rpartition(".")[2]
        return f'<shape type="{plugin}">{FILE.format(kind)}{PLACE}{bsdf}</shape>'
    return f'<shape type="{kind}">{PLACE}{bsdf}</shape>'


def changed(tree: ElementTree.Element, rng: random.Random) -> None:
    """One change of a tree of elements."""
    nodes = list(tree.iter())
    parents = {child: node for node in nodes for child in node}
    node, other = rng.choice(nodes), rng.choice(nodes)
    how = rng.choice(CHANGES)
    if how == "value":
        with_value = [n for n in nodes if any(k not in ("type", "name", "id") for k in n.attrib)]
        node = rng.choice(with_value or nodes)
        key = rng.choice(list(node.attrib) or ["value"])
        few = odd.FILES if key == "filename" or node.tag == "string" else odd.NUMBERS
        node.set(key, rng.choice((*few, *odd.WORDS) if rng.random() < 0.3 else few))
    elif how == "plugin":
        with_type = [n for n in nodes if "type" in n.attrib]
        rng.choice(with_type or nodes).set("type", rng.choice(PLUGINS))
    elif how == "tag":
        node.tag = rng.choice(TAGS)
    elif how == "name":
        node.set("name", rng.choice((*odd.WORDS, "to_world", "reflectance", "filename", "faces")))
    elif how == "id":
        node.set("id", rng.choice((*odd.WORDS, "floor", "lamp", "g")))
    elif how == "out" and node in parents:
        parents[node].remove(node)
    elif how == "twice" and node in parents:
        parents[node].extend([node] * rng.choice((1, 1, 1, 50)))
    elif (
        how == "move" and node in parents and node not in other.iter() and other not in node.iter()
    ):
        parents[node].remove(node)
        other.append(node)
    elif how == "add":
        kind = rng.choice(("float", "integer", "string", "boolean", "rgb", "spectrum", "vector"))
        value = rng.choice(odd.NUMBERS + odd.WORDS)
        ElementTree.SubElement(node, kind, name=rng.choice(PROPERTIES), value=value)
    elif how == "ref":
        ElementTree.SubElement(node, "ref", id=rng.choice(("g", "floor", "paint", "inside", "x")))
    elif how == "deep":
        for _ in range(rng.choice((2, 20, 200))):
            node = ElementTree.SubElement(node, other.tag, other.attrib)


CHANGES = (
    *("value",) * 3,
    "plugin",
    "tag",
    "name",
    "out",
    "twice",
    "move",
    "add",
    "ref",
    "deep",
    "id",
)
NAMES = """
filename radius alpha eta k int_ior ext_ior reflectance width height shape_index max_depth
face_normals flip_normals distribution material weight opacity scale filter_type wrap_mode raw to_uv
to_world position intensity irradiance center p0 p1 grid data use_grid_bbox diffuse_reflectance
specular_reflectance nonlinear color0 color1 lambda_min fov near_clip far_clip temperature
wavelengths values extent control_points
"""
PROPERTIES = NAMES.split()


def valid(text: str) -> str:
    """What an XML file may hold."""
    return "".join(c for c in text if c in "\t\n" or c >= " ")


@st.composite
def scenes(draw: st.DrawFn) -> Input:
    """A scene of some good parts, changed zero to four times as a tree, and maybe as a text."""
    parts = draw(st.lists(shapes() | st.sampled_from(ALONE), min_size=1, max_size=3))
    tree = ElementTree.fromstring(f'<scene version="3.0.0">{ROOM}{"".join(parts)}</scene>')
    spelled(tree)
    rng = random.Random(draw(st.integers(0, 2**32)))
    for _ in range(draw(st.sampled_from((0, 1, 1, 1, 2, 4)))):
        changed(tree, rng)
    for node in tree.iter():
        node.attrib.update({k: valid(v) for k, v in node.attrib.items()})
    text = ElementTree.tostring(tree, encoding="unicode").encode("utf-8", "replace")
    if draw(st.integers(0, 4)) == 4:
        text = odd.garbled(text, rng)
    return of(text, {})
