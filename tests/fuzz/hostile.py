"""Scenes that no change of a good one leads to."""

from __future__ import annotations

from hypothesis import strategies as st

from fuzz.inputs import Input

FLOOR = '<shape type="rectangle" id="floor"/>'
LAMP = (
    '<emitter type="point"><point name="position" value="0.2 0.1 0.8"/>'
    '<rgb name="intensity" value="2"/></emitter>'
)


def scene(*parts: str) -> str:
    """A good room, and these parts after it."""
    return f'<scene version="3.0.0">{FLOOR}{LAMP}{"".join(parts)}</scene>'


def tag(element: str, kind: str, /, *inside: str, **own: str) -> str:
    given = "".join(f' {key}="{value}"' for key, value in own.items())
    return f'<{element} type="{kind}"{given}>{"".join(inside)}</{element}>'


def nested(name: str, kind: str, depth: int, inside: str = "") -> str:
    return f'<{name} type="{kind}">' * depth + inside + f"</{name}>" * depth


def file(name: str) -> str:
    return f'<string name="filename" value="{name}"/>'


def include(*names: str) -> str:
    return "".join(f'<include filename="{name}"/>' for name in names)


def only(*parts: str) -> bytes:
    """An included file."""
    return f'<scene version="3.0.0">{"".join(parts)}</scene>'.encode()


def moved(how: str) -> str:
    return tag("shape", "cube", f'<transform name="to_world">{how}</transform>')


DEVICES = ("/dev/zero", "/dev/urandom", "/dev", "pipe", "")
DIFFUSE = tag("bsdf", "diffuse")
SPECTRUM = '<spectrum name="reflectance" filename="{}"/>'
GOOD = scene()
LAUGHS = "".join(
    f'<!ENTITY l{i} "{"".join([f"&l{i - 1};"] * 10)}">' for i in range(1, 10)
)  # each ten times the one before
TEXTS = (
    *("", "<", "\0" * 1000, "<scene/>", '<scene version="3.0.0"/>', GOOD * 2),
    '<scene version="99999999999.0.0"/>',
    f'<!DOCTYPE s [<!ENTITY l0 "ha">{LAUGHS}]>' + GOOD.replace("floor", "&l9;"),
    '<!DOCTYPE s [<!ENTITY e SYSTEM "/etc/passwd">]>' + GOOD.replace("floor", "&e;"),
    *(
        f'<?xml version="1.0" encoding="{encoding}"?>{GOOD}'
        for encoding in ("utf-8", "utf-7", "ebcdic", "klingon")
    ),
    *(
        scene(nested(name, kind, depth))
        for depth in (10, 1000, 100_000)
        for name, kind in (("bsdf", "twosided"), ("shape", "cube"), ("texture", "bitmap"))
    ),
    *(
        scene(tag("shape", "cube", nested("bsdf", kind, depth, DIFFUSE)))
        for depth in (30, 300, 3000)
        for kind in ("mask", "bumpmap", "twosided", "normalmap")
    ),
    *(
        GOOD.replace("</scene>", ending)
        for ending in (
            *("<!--" + "-" * 10**6, "<" * 10**5, "<a " * 10**5, "<![CDATA[" * 10**5),
            *("<!" * 10**5, "&" * 10**6, "<?" * 10**5, '<a b="' * 10**5, "</a>" * 10**5),
        )
    ),
    GOOD.replace("floor", "f" * 10**7),
    GOOD.replace("0.8", "0." + "8" * 10**7),
    scene(*('<float name="x" value="1"/>',) * 100_000),
    scene(*(FLOOR.replace(' id="floor"', ""),) * 40),
    scene(
        '<default name="x" value="$y"/><default name="y" value="$x"/><string name="$x" value=""/>'
    ),
    scene('<default name="x" value="$x$x"/>', tag("shape", "cube", id="$x")),
    scene(
        tag("bsdf", "twosided", '<ref id="b"/>', id="a"),
        tag("bsdf", "twosided", '<ref id="a"/>', id="b"),
        tag("shape", "cube", '<ref id="a"/>'),
    ),
    scene(tag("bsdf", "twosided", '<ref id="a"/>', id="a"), tag("shape", "cube", '<ref id="a"/>')),
    scene(
        tag("shape", "shapegroup", tag("shape", "instance", '<ref id="g"/>'), id="g"),
        tag("shape", "instance", '<ref id="g"/>'),
    ),
    scene('<alias id="a" as="b"/><alias id="b" as="a"/>'),
    scene('<path value="/"/><path value="/dev"/>', tag("shape", "ply", file("zero"))),
    *(scene(include(name)) for name in (*DEVICES, ".", "/dev/stdin")),
    *(
        scene(tag("shape", "cube", tag("bsdf", "diffuse", SPECTRUM.format(name))))
        for name in DEVICES
    ),
    *(
        scene(tag("shape", kind, file(name)))
        for kind in ("ply", "obj", "serialized", "bsplinecurve", "sdfgrid", "ellipsoids")
        for name in DEVICES
    ),
    *(
        scene(tag("shape", "cube", tag("bsdf", "diffuse", texture)))
        for name in DEVICES
        for texture in (
            tag("texture", "bitmap", file(name), name="reflectance"),
            tag(
                *("texture", "volume", tag("volume", "gridvolume", file(name), name="volume")),
                name="reflectance",
            ),
        )
    ),
    *(scene(tag("bsdf", "measured", file(name), id="m")) for name in DEVICES),
    *(
        scene(tag("shape", "sphere", f'<float name="radius" value="{radius}"/>'))
        for radius in ("1e38", "1e30", "1e-38", "0", "-1", "nan")
    ),
    *(
        scene(moved(how))
        for how in (
            *('<scale value="0"/>', '<scale value="1e30"/>', '<scale value="1e-30"/>'),
            *('<translate x="nan"/>', '<translate x="1e38"/>', '<matrix value="1 2 3"/>'),
            '<lookat origin="0 0 0" target="0 0 0" up="0 0 0"/>',
            '<matrix value="nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/>',
            '<matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 0"/>',
        )
    ),
)
INCLUDED: tuple[dict[str, bytes], ...] = (
    {"room.xml": scene(include("room.xml")).encode()},
    {
        "room.xml": scene(include("b.xml", "b.xml")).encode(),
        "b.xml": only(include("c.xml", "c.xml")),
        "c.xml": only(include("b.xml", "b.xml")),
    },
    {
        "room.xml": scene(include("b0.xml")).encode(),
        **{f"b{i}.xml": only(include(*(f"b{i + 1}.xml",) * 8)) for i in range(12)},
        "b12.xml": only(),
    },
)
FLOR = scene().replace("floor", "fl\u00f6r")
ENCODED = (
    *(GOOD.encode("utf-16"), GOOD.encode("utf-32"), b"\xef\xbb\xbf" + GOOD.encode()),
    *(FLOR.encode("latin-1"), FLOR.encode("utf-16"), b"<?xml encoding='latin-1'?>" + FLOR.encode()),
)
FILES = (
    *({"room.xml": text.encode()} for text in TEXTS),
    *({"room.xml": content} for content in ENCODED),
    *INCLUDED,
)


def scenes() -> st.SearchStrategy[Input]:
    """One of them; ``pipe`` stands in some, which nobody writes to."""
    return st.sampled_from(FILES).map(_with_pipe)


def _with_pipe(files: dict[str, bytes]) -> Input:
    piped = b'"pipe"' in files["room.xml"]
    return Input("scene", {**files, "pipe": None} if piped else dict(files))
