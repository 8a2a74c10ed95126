"""Pictures, checked before Mitsuba reads them: some damaged ones would end the process."""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path

import OpenImageIO as oiio

BMP = struct.Struct("<2s12xIiiHH")  # BM, size of the header, width, height, planes, bits
BITS = (1, 8, 24, 32)  # a pixel
PNM = re.compile(rb"P[56Ff]\s")
SIZES = re.compile(rb"P([56Ff])\s+(?:#.*\n)*(\d+)\s+(\d+)\s+(-?[\d.]+(?:[eE][-+]?\d+)?)\s")
EXR = b"\x76\x2f\x31\x01"  # the first bytes
OTHER = 0x1A00  # bits of an EXR version: tiles, deep data, many parts
LINES = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256)  # in a block, by the number of the compression


def check_bitmap(file: Path) -> None:
    """Refuse an EXR file with a damaged pixel; BMP, PPM and PFM files shorter than they say.

    Of other formats Mitsuba itself says so. Raises ValueError naming the file.
    """
    if not os.path.isfile(file):
        return
    with open(file, "rb") as stream:
        head = stream.read(BMP.size)
    if head.startswith(EXR) and not (_blocks_in_place(file.read_bytes()) and _all_pixels(file)):
        raise ValueError(f"bitmap {file}: a damaged EXR file")
    if PNM.match(head) and not _pnm(file.read_bytes()):
        raise ValueError(f"bitmap {file}: a damaged PPM or PFM file")
    if head.startswith(b"BM") and not _bmp(head, file.stat().st_size):
        raise ValueError(f"bitmap {file}: a damaged BMP file")


def _blocks_in_place(content: bytes) -> bool:
    """Whether each block of lines lies where the table of an EXR file says, and begins as it says.

    Mitsuba's reader ends the process where two of its threads find one that doesn't.
    """
    try:
        header, at = {}, 8
        while content[at]:
            name, kind = content.index(b"\0", at), content.index(b"\0", at) + 1
            size = content.index(b"\0", kind) + 1
            (length,) = struct.unpack_from("<I", content, size)
            header[content[at:name]] = content[size + 4 : size + 4 + length]
            at = size + 4 + length
        if struct.unpack_from("<I", content, 4)[0] & OTHER:
            return True
        _, top, _, bottom = struct.unpack("<4i", header[b"dataWindow"])
        lines = LINES[header[b"compression"][0]]
        for i, y in enumerate(range(top, bottom + 1, lines)):
            (offset,) = struct.unpack_from("<Q", content, at + 1 + 8 * i)
            found, length = struct.unpack_from("<iI", content, offset)
            if found != y or offset + 8 + length > len(content):
                return False
    except (struct.error, ValueError, KeyError, IndexError, OverflowError):
        return False
    return True


def _all_pixels(file: Path) -> bool:
    """Whether OpenImageIO can read them."""
    try:
        picture = oiio.ImageInput.open(str(file))
        pixels = picture.read_image() if picture else None
        oiio.geterror()  # or it is printed at the end
    except UnicodeDecodeError:  # a complaint that is not text
        return False
    if picture:
        picture.close()
    return pixels is not None


def _pnm(content: bytes) -> bool:
    sizes = SIZES.match(content)
    if not sizes:
        return False
    kind, width, height = sizes[1], int(sizes[2][:9]), int(sizes[3][:9])
    value = 4 if kind in b"Ff" else 1 if float(sizes[4]) < 256 else 2
    size = width * height * value * (3 if kind in b"6F" else 1)
    return 0 < size <= len(content) - sizes.end()


def _bmp(head: bytes, size: int) -> bool:
    if len(head) < BMP.size:
        return False
    _, _, width, height, _, bits = BMP.unpack(head)
    return bits in BITS and 0 < width * abs(height) * bits // 8 <= size
