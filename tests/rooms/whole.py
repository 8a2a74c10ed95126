"""Write these rooms whole, triangles and all that was seen: what `validation.studies.cycles` reads.

From the folder above this one:

    python -m rooms.whole FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from rooms import NAMES
from rooms.loader import room

KEYS = ("positions", "normals", "directions", "albedo", "direct", "total")
TRUTH = ("light_positions", "light_intensities")


def write(name: str, folder: Path) -> Path:
    """One room as FOLDER/NAME.npz."""
    vertices, faces, albedo, seen = room(name)
    arrays = {key: seen[key] for key in (*KEYS, *TRUTH)}
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{name}.npz"
    np.savez(file, vertices=vertices, faces=faces, face_albedo=albedo, **arrays)
    return file


if __name__ == "__main__":
    for name in NAMES:
        print(write(name, Path(sys.argv[1])))
