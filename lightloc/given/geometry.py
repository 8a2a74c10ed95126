"""What lightloc must know of a scene's geometry: two questions, answered inside kernels."""

from __future__ import annotations

from typing import Any, Protocol

RAY_OFFSET = 8.9e-5
"""A shadow ray starts this far off its surface, times 1 + max|x|: Mitsuba's ray epsilon."""


class Geometry(Protocol):
    """Geometry as a value with two functions over Dr.Jit arrays.

    `render` makes one of a Mitsuba scene; any object with these methods serves. Where
    ``geometry=None`` is accepted, nothing occludes.
    """

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """V(x, p): whether the segment between (Array3f) x and p is free (Bool)."""
        ...

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """The first surface point along the ray x + t d: (hit, y)."""
        ...
