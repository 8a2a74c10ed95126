"""What a light brings to an observation: S (Eq. 2), B (Eq. 4) and visibility.

For other rooms, in pipeline order:

- `Surfels`: observations as Dr.Jit arrays.
- `surfels`: moves observations there.
- `columns`: an (n, 3) array as an Array3f.
- `pick`: rows of an Array3f.
- `unoccluded`: S without V, inside a kernel.
- `visible`: V(x, p), inside a kernel.
- `shading`: S(q, p) of Eq. 2 for all pairs.
- `shaded`: the same in the kernel's own precision and order.
- `shading_gradient`: S and its gradient in p.
- `slopes`: S without V and its gradient, in the kernel's own precision.
- `shadows`: V for all pairs, hard or soft.
- `check_gradient`: how far the gradient is from central differences.
- `radiance`: B = sum I S of Eq. 4.
- `reflected_ambient`: what the ambient term of section 6.3 looks like.
- `cosine_direction`: a cosine-distributed direction about a normal.
"""

from lightloc.optics.ambient import reflected_ambient
from lightloc.optics.directions import cosine_direction
from lightloc.optics.kernel import Surfels, columns, pick, surfels, unoccluded, visible
from lightloc.optics.transport import (
    check_gradient,
    radiance,
    shaded,
    shading,
    shading_gradient,
    shadows,
    slopes,
)

__all__ = [
    "Surfels",
    "surfels",
    "columns",
    "pick",
    "unoccluded",
    "visible",
    "shading",
    "shaded",
    "shading_gradient",
    "slopes",
    "shadows",
    "check_gradient",
    "radiance",
    "reflected_ambient",
    "cosine_direction",
]
