"""Materials that reflect together."""

from __future__ import annotations

import functools
import operator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf.ceiling import Ceiling
from lightloc.brdf.parts import Parts
from lightloc.brdf.protocol import Bounded, Scatter, Slope, Sloped
from lightloc.reprs import short


@dataclass(frozen=True, eq=False)
class Sum(Parts):
    """A BRDF that is the sum of others, as a lobe over a diffuse base.

    Parameters
    ----------
    brdfs : sequence of BRDF
        What is summed up: materials of ours and of your own. Where one has three channels, one
        that has a single channel counts in each of them.

    Raises
    ------
    ValueError
        If there is no material or one of them is no BRDF.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Conductor, Lambert, Observations, Sum, shading
    >>> up = [[0, 0, 1]]
    >>> glossy = Sum([Lambert(albedo=0.3), Conductor(alpha=0.5, specular=0.1)])
    >>> q = Observations(positions=[[0, 0, 0]], normals=up, directions=up, radiance=[0],
    ...                  material=glossy)
    >>> bool(np.isclose(shading(q, [[0, 0, 1]])[0, 0, 0], (0.3 + 0.1 / (4 * 0.5**2)) / np.pi))
    True
    """

    __repr__ = short

    def __post_init__(self) -> None:
        self._check()
        if not self.brdfs:
            raise ValueError("Sum needs at least one BRDF")

    def bind(self, n: int) -> Scatter:
        """As of `BRDF`: the sum."""
        self.check_length(n)
        parts = [brdf.bind(n) for brdf in self.brdfs]
        return lambda i, normal, l, w: added(part(i, normal, l, w) for part in parts)

    def bind_slope(self, n: int) -> Slope | None:
        """As of `Sloped`: the sum; None where a part has no closed form."""
        self.check_length(n)
        parts = [brdf.bind_slope(n) for brdf in self.brdfs if isinstance(brdf, Sloped)]
        known = [part for part in parts if part is not None]
        if len(known) < len(self.brdfs):
            return None

        def slope(i: Any, normal: Any, v: Any, w: Any) -> tuple[Any, list[Any]]:
            values, gradients = zip(*(part(i, normal, v, w) for part in known), strict=True)
            return added(values), [added(along) for along in zip(*gradients, strict=True)]

        return slope

    def ceiling(self, cos_w: NDArray[np.float64]) -> Ceiling | None:
        """As of `Bounded`: the sum; None where a part has no bound."""
        parts = [brdf.ceiling(cos_w) for brdf in self.brdfs if isinstance(brdf, Bounded)]
        known = [part for part in parts if part is not None]
        if len(known) < len(self.brdfs):
            return None
        flat, cosine = np.broadcast_arrays(
            added(part.flat for part in known), added(part.cosine for part in known)
        )
        return Ceiling(flat, cosine, all(part.attained for part in known))


def added(values: Any) -> Any:
    """The sum; of Dr.Jit arrays, too, where one channel counts in each of three."""
    return functools.reduce(operator.add, values)
