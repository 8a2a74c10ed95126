"""2D rooms: closed curves in the plane z = 0 as walls and occluders.

For other rooms, in pipeline order:

- `Loop`: a closed curve of straight edges and circular arcs.
- `Outline`: a room's walls and occluders, as a surface and as a geometry.
- `follow`: which wall scattered points lie on, and where along it.
- `is_in_plane`: whether points lie in the plane z = 0.
"""

from lightloc.plane.loop import Loop
from lightloc.plane.outline import Outline
from lightloc.plane.vectors import is_in_plane
from lightloc.plane.walls import follow

__all__ = [
    "Loop",
    "Outline",
    "follow",
    "is_in_plane",
]
