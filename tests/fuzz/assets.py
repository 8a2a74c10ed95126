"""Good scenes in which a mesh, a picture, a spectrum or a volume is a bad one."""

from __future__ import annotations

import random
import struct
import zlib

from hypothesis import strategies as st

from fuzz import corpus, odd
from fuzz.inputs import Input
from fuzz.parts import BSDFS, FILE, MESHES, PLACE, around, named, of

KINDS = "png jpg exr hdr pfm ppm bmp"
BITMAPS = tuple(f"picture.{kind}" for kind in KINDS.split())


def with_file(names: tuple[str, ...], text: bool = False) -> st.SearchStrategy[Input]:
    """A good scene in which one of the files that it names is changed."""

    def one(name: str, content: bytes) -> Input:
        plugin = name.rpartition(".")[2]
        if name in MESHES:
            part = f'<shape type="{plugin}">{FILE.format(name)}</shape>'
        elif plugin == "txt":
            part = f'<shape type="bsplinecurve">{FILE.format(name)}</shape>'
        elif plugin == "vol" and len(content) % 2:
            part = f'<shape type="sdfgrid">{FILE.format(name)}</shape>'
        else:
            bsdf = next(b for b in BSDFS if name in b and "normalmap" not in b)
            part = f'<shape type="cube">{PLACE}{bsdf}</shape>'
        return of(around(part), {name: content})

    def of_name(name: str) -> st.SearchStrategy[Input]:
        good = named()[name]
        return odd.changed(good, text=text).map(lambda content: one(name, content))

    return st.sampled_from(names).flatmap(of_name)


@st.composite
def packed(draw: st.DrawFn) -> Input:
    """A serialized mesh that is changed before it is compressed, so that it unpacks."""
    huge = st.sampled_from((0, 1, 3, 4, 5, 2**16, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1))
    count, faces = draw(huge), draw(huge)
    flags = draw(st.sampled_from((0x1000, 0x2000, 0x1001, 0x1002, 0x1008, 0x3FFF, 0)))
    body = corpus.plain(count, faces, flags) if draw(st.booleans()) else corpus.plain()
    body = odd.flipped(body, random.Random(draw(st.integers(0, 2**32))))
    version = draw(st.sampled_from((4, 4, 4, 3, 5, 0)))
    offset = draw(st.sampled_from((0, 0, 0, 1, 4, 2**32, 2**63)))
    whole = corpus.serialized(
        zlib.compress(body), version, offset, draw(st.sampled_from((1, 1, 2, 0, 2**31)))
    )
    index = draw(st.sampled_from(("0", "0", "0", "1", "-1", "2147483647")))
    part = FILE.format("mesh.serialized") + f'<integer name="shape_index" value="{index}"/>'
    return of(around(f'<shape type="serialized">{part}</shape>'), {"mesh.serialized": whole})


@st.composite
def volumes(draw: st.DrawFn) -> Input:
    """A volume grid that claims another size than it has."""
    size = st.sampled_from((0, 1, 2, -1, 3, 1 << 15, 2**31 - 1, -(2**31)))
    head = b"VOL" + bytes([draw(st.sampled_from((3, 3, 3, 0, 255)))])
    head += struct.pack("<5i", draw(st.sampled_from((1, 1, 3, 0))), *(draw(size) for _ in range(4)))
    head += struct.pack("<6f", *(draw(st.floats(width=32)) for _ in range(6)))
    body = draw(st.binary(max_size=64)) + corpus.grid()[48:]
    kind = draw(st.booleans())
    bsdf = next(b for b in BSDFS if "grid.vol" in b)
    part = (
        f"<cube>{bsdf}</cube>"
        if kind
        else f'<shape type="sdfgrid">{FILE.format("grid.vol")}</shape>'
    )
    return of(around(part), {"grid.vol": head + body})
