"""Good parts of scenes, and the files that they name."""

from __future__ import annotations

from xml.etree import ElementTree

from fuzz import corpus
from fuzz.inputs import Input

ROOM = """<rectangle id="floor"/><emitter type="point" id="lamp">
<point name="position" value="0.2 0.1 0.8"/><rgb name="intensity" value="2"/></emitter>"""
PLACE = """<transform name="to_world"><scale value="0.2"/><rotate x="1" angle="30"/>
<translate x="0.3" z="0.4"/></transform>"""
TEXTURE = '<texture type="{}" name="reflectance">{}</texture>'
NAME = '<string name="name" value="vertex_c"/>'
FILE = '<string name="filename" value="{}"/>'
BSDFS = (
    '<diffuse><rgb name="reflectance" value="0.2 0.4 0.6"/></diffuse>',
    '<roughplastic><float name="alpha" value="0.2"/><float name="int_ior" value="1.5"/>'
    '<spectrum name="diffuse_reflectance" value="0.4"/></roughplastic>',
    '<roughconductor><string name="material" value="Al"/><float name="alpha" value="0.3"/>'
    '<string name="distribution" value="ggx"/></roughconductor>',
    "<twosided><diffuse/><conductor/></twosided>",
    "<twosided><diffuse/></twosided>",
    '<mask><float name="opacity" value="1"/><diffuse/></mask>',
    '<blendbsdf><float name="weight" value="0.4"/><diffuse/><plastic/></blendbsdf>',
    '<bumpmap><texture type="bitmap" name="x"><boolean name="raw" value="true"/>'
    '<string name="filename" value="picture.exr"/></texture><diffuse/></bumpmap>',
    '<normalmap><texture type="bitmap" name="normalmap"><boolean name="raw" value="true"/>'
    '<string name="filename" value="picture.png"/></texture><diffuse/></normalmap>',
    '<principled><rgb name="base_color" value="0.2 0.3 0.4"/><float name="metallic" value="0.3"/>'
    '<float name="roughness" value="0.4"/></principled>',
    '<measured><string name="filename" value="m.bsdf"/></measured>',
    "<dielectric/>",
    '<hair><float name="longitudinal_roughness" value="0.3"/></hair>',
    f"<diffuse>{TEXTURE.format('checkerboard', '')}</diffuse>",
    f"<diffuse>{TEXTURE.format('mesh_attribute', NAME)}</diffuse>",
    "<diffuse>"
    + TEXTURE.format(
        "volume", f'<volume type="gridvolume" name="volume">{FILE.format("grid.vol")}</volume>'
    )
    + "</diffuse>",
    '<diffuse><spectrum name="reflectance" filename="grey.spd"/></diffuse>',
    '<diffuse><spectrum name="reflectance" value="400:0.1, 500:0.2, 700:0.3"/></diffuse>',
    *(
        f"<diffuse>{TEXTURE.format('bitmap', FILE.format(f'picture.{kind}'))}</diffuse>"
        for kind in ("png", "jpg", "exr", "hdr", "pfm", "ppm", "bmp")
    ),
)
MESHES = ("ascii.ply", "little.ply", "big.ply", "mesh.obj", "mesh.serialized")
SHAPES = """
rectangle cube sphere cylinder disk instance shapegroup merge bsplinecurve linearcurve sdfgrid
ellipsoids ellipsoidsmesh ply obj serialized blender
"""
OTHERS = """
aov area batch bitmap blackbody blendbsdf bumpmap checkerboard conductor constant constvolume d65
dielectric diffuse direct directional distant envmap gridvolume hair hdrfilm heterogeneous
homogeneous independent irradiancemeter irregular mask measured mesh_attribute normalmap null
orthographic path perspective plastic point principled projector ptracer radiancemeter regular
roughconductor roughdielectric roughplastic scene specfilm spot srgb sunsky thindielectric thinlens
twosided uniform volpath volume rawconstant pplastic polarizer retarder circular hg isotropic box
gaussian
"""
NAMES = """
scene shape bsdf emitter sensor film sampler integrator texture spectrum volume medium phase rfilter
boolean integer float string point vector rgb transform translate rotate scale lookat matrix ref
default alias include path object
"""
PLUGINS, TAGS = (SHAPES + OTHERS).split(), NAMES.split()
ALONE = (
    '<sensor type="perspective"><float name="fov" value="60"/><transform name="to_world">'
    '<lookat origin="0 0 3" target="0 0 0" up="0 1 0"/></transform><film type="hdrfilm">'
    '<integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>',
    '<integrator type="path"><integer name="max_depth" value="4"/></integrator>',
    '<default name="x" value="0.3"/><sphere><float name="radius" value="$x"/></sphere>',
    '<include filename="part.xml"/>',
    '<path value="."/>',
    '<diffuse id="paint"/><alias id="paint" as="colour"/><cube><ref id="colour"/></cube>',
    f'<shape type="shapegroup" id="g"><cube>{PLACE}</cube></shape>'
    '<shape type="instance"><ref id="g"/></shape>',
    f'<shape type="bsplinecurve">{FILE.format("hair.txt")}</shape>',
    f'<shape type="linearcurve">{FILE.format("hair.txt")}</shape>',
    f'<shape type="sdfgrid">{FILE.format("grid.vol")}{PLACE}</shape>',
    "<null/>",
)
PART = b"""<scene version="3.0.0"><shape type="cube" id="inside"><bsdf type="diffuse"/></shape>
</scene>"""


def named() -> dict[str, bytes]:
    """All files that the parts above name."""
    found = {**corpus.meshes(), **corpus.texts(), **corpus.pictures()}
    return found | {"grid.vol": corpus.grid(), "part.xml": PART, "m.bsdf": b"tensor_file\0\1\0"}


def spelled(tree: ElementTree.Element) -> None:
    """Tags that are plugins, as above, in Mitsuba's own way."""
    for node in tree.iter():
        if node.tag not in TAGS:
            plugin = node.tag
            node.tag = "shape" if plugin in SHAPES.split() else "bsdf"
            node.set("type", plugin)


def of(text: bytes, instead: dict[str, bytes]) -> Input:
    """A scene with those of its files that its text names, some of them others."""
    files = {name: content for name, content in {**named(), **instead}.items()}
    return Input(
        "scene", {"room.xml": text, **{n: c for n, c in files.items() if n.encode() in text}}
    )


def around(part: str) -> bytes:
    """A room with that in it."""
    tree = ElementTree.fromstring(f'<scene version="3.0.0">{ROOM}{part}</scene>')
    spelled(tree)
    return ElementTree.tostring(tree)
