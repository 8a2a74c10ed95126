"""Round occluders in the plane, as much of a `Geometry` as fields ask for: what is visible."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lightloc.backend import dr, types  # drjit, once its LLVM library is chosen


class Discs:
    """Discs (m, 3), each x, y and radius; the segment from x to p must miss them all."""

    def __init__(self, discs: ArrayLike) -> None:
        f = types()
        rows = np.reshape(np.asarray(discs, np.float32), (-1, 3))
        self.discs = [[f.Float(v) for v in (x, y, r * r)] for x, y, r in rows]
        dr.make_opaque(self.discs)  # other discs are no reason to compile again

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        dx, dy = p.x - x.x, p.y - x.y
        shorter = 1 / (dx * dx + dy * dy)
        for cx, cy, r2 in self.discs:
            ex, ey = cx - x.x, cy - x.y
            t = dr.clip((ex * dx + ey * dy) * shorter, 0, 1)
            ex, ey = ex - t * dx, ey - t * dy
            active = active & (ex * ex + ey * ey > r2)
        return active
