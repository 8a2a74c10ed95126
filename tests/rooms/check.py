"""Whether the rooms are what they should be: ``python -m rooms.check [FOLDER]``, one row per room.

In a FOLDER, a picture of each room is left: all direct light, and all light.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import lightloc
from rooms import NAMES
from rooms.loader import agreement, geometry, observations, room

LIT = 1e-4
"""Of the brightest: below it a pair counts as dark, and float32 is all that a ratio would tell."""


def distances(p: np.ndarray, triangles: np.ndarray) -> float:
    """From a point to the nearest of (f, 3, 3) triangles."""
    a, b, c = (triangles[:, i] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside, best = np.ones(len(a), bool), np.inf
    for start, end in ((a, b), (b, c), (c, a)):
        along, to = end - start, p - start
        t = np.clip((to * along).sum(1) / (along * along).sum(1), 0, 1)
        best = min(best, np.linalg.norm(to - t[:, None] * along, axis=1).min())
        inside &= (np.cross(along, to) * normal).sum(1) >= 0
    flat = np.abs(((p - a) * normal).sum(1))[inside]
    return float(min(best, flat.min(initial=np.inf)))


def check(name: str, folder: Path | None) -> str:
    """The row of one room."""
    vertices, faces, _, seen = room(name)
    L, I = seen["light_positions"], seen["light_intensities"]
    direct = seen["direct"].astype(float)
    formula, visible = agreement(seen, space := geometry(vertices, faces))
    faces_light = formula > LIT * formula.max()
    lit = faces_light & (direct > formula / 2)
    ratio = direct[lit] / formula[lit]
    wrong = (faces_light & (visible != lit)).mean()
    apart = np.linalg.norm(L[:, None] - L, axis=2)[~np.eye(len(L), dtype=bool)].min()
    clear = min(distances(p, vertices[faces].astype(float)) for p in L)
    bound = lightloc.cramer_rao(
        observations(seen, list(range(len(L)))), lightloc.PointLights(L, I), space
    )
    if folder is not None:
        picture(seen, folder / f"{name}.png")
    low, middle, high = np.percentile(ratio, [5, 50, 95])
    return (
        f"{name:8} {len(faces):7} {len(L)} {len(direct):5}  "
        f"{middle:.6f} ({low:.6f} to {high:.6f})  "
        f"{100 * wrong:.3f} %  clear {clear:.2f} apart {apart:.2f}  "
        f"lit {np.round(lit.mean(axis=0), 2).tolist()}  "
        f"bound {np.linalg.norm(bound.position, axis=1).max():.1e}  "
        f"indirect {1 - direct.sum() / seen['total'].sum(dtype=float):.2f}"
    )


def picture(seen, path: Path) -> None:
    """Direct light above, all light below."""
    from matplotlib import pyplot

    rows = [seen[key].sum(axis=1, dtype=float) for key in ("direct", "total")]
    image = np.concatenate([row.reshape(-1, int(seen["width"])) for row in rows])
    bright = np.quantile(image, 0.98)  # what is as bright as this is white
    pyplot.imsave(path, np.clip(image / bright, 0, 1) ** (1 / 2.2), cmap="gray", vmin=0, vmax=1)


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    print("room, triangles, lights, pixels, direct / Eq. 1 (5 to 95 %), other side of an edge, ...")
    for each in NAMES:
        print(check(each, where), flush=True)
