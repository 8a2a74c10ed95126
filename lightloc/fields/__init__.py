"""Intensity distance fields: I (Eq. 3), D (Eq. 6) and L (Eq. 7), exactly.

For other rooms, in pipeline order:

- `Grid`: a regular grid of possible light positions.
- `intensity`: I(q, p) = B(q) / S(q, p), Eq. 3.
- `intensity_distance`: D(p) and its limiting observation L(p), Eq. 6 and 7.
- `Field`: the same for one radiance after another.
- `NO_LIMITER`: L(p) where no observation limits.
"""

from lightloc.fields.field import Field, intensity, intensity_distance
from lightloc.fields.grid import Grid
from lightloc.fields.ranking import NO_LIMITER

__all__ = [
    "Grid",
    "intensity",
    "intensity_distance",
    "Field",
    "NO_LIMITER",
]
