"""A light meter's readings, as the radiance that a material would show."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lightloc.brdf.models import Lambert
from lightloc.reprs import short


@dataclass(frozen=True)
class Irradiance(Lambert):
    """Stands for a light meter at the surface: B(q) is then the irradiance, W m^-2.

    A white card of albedo 1 shows irradiance / pi, so a meter reads what a card of albedo pi
    would show: f = 1 in Eq. 2.

    Examples
    --------
    A light of intensity I straight above, at a distance d, brings I / d^2:

    >>> import numpy as np
    >>> from lightloc import Irradiance, Observations, PointLights, radiance
    >>> meter = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], radiance=[0.0],
    ...                      material=Irradiance())
    >>> E = radiance(meter, PointLights([[0, 0, 2]], [8.0]))
    >>> bool(np.isclose(E[0, 0], 2.0))
    True
    """

    albedo: Any = field(default=np.pi, init=False)

    __repr__ = short
