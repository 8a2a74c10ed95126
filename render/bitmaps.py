"""Pictures that a scene names, checked before Mitsuba reads them: a bad one would end the process."""

from __future__ import annotations

import struct
from pathlib import Path

BMP = struct.Struct("<2s12xIiiHH")  # BM, size of the header, width, height, planes, bits
BITS = (1, 8, 24, 32)  # a pixel


def check_bitmap(file: Path) -> None:
    """Refuse a BMP file whose header can't be true; of other formats Mitsuba itself says so.

    Raises ValueError naming the file.
    """
    if not file.is_file():
        return
    with open(file, "rb") as stream:
        head = stream.read(BMP.size)
    if not head.startswith(b"BM"):
        return
    if len(head) == BMP.size:
        _, _, width, height, _, bits = BMP.unpack(head)
        if bits in BITS and 0 < width * abs(height) * bits // 8 <= file.stat().st_size:
            return
    raise ValueError(f"bitmap {file}: the header of this BMP file is broken")
