"""Volume grids, checked before Mitsuba reads them: a wrong size would never end."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np

HEADER = struct.Struct("<3sB5i6f")  # VOL, version 3, type 1 (float32), size, channels, box
TYPE = (b"VOL", 3, 1)


def check_volume(file: Path) -> None:
    """Refuse a ``.vol`` file whose header is not Mitsuba's, or promises other than what follows.

    Raises
    ------
    ValueError
        Naming the file.
    """
    if not os.path.isfile(file):
        raise ValueError(f"volume {file}: no such file")
    with open(file, "rb") as stream:
        head = stream.read(HEADER.size)
    if len(head) < HEADER.size or HEADER.unpack(head)[:3] != TYPE:
        raise ValueError(f"volume {file}: is no grid of float32 values (.vol, version 3)")
    *_, x, y, z, channels = HEADER.unpack(head)[:7]
    held = (file.stat().st_size - HEADER.size) // 4
    if min(x, y, z, channels) < 1 or x * y * z * channels != held:
        raise ValueError(
            f"volume {file}: its header says {x} x {y} x {z} x {channels} values, it holds {held}"
        )
    values = np.memmap(file, "<f4", "r", HEADER.size)
    if not (np.isfinite(HEADER.unpack(head)[7:]).all() and np.isfinite(values).all()):
        raise ValueError(f"volume {file}: holds values that are not finite")
