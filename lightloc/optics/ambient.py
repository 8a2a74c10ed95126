"""The constant ambient term (section 6.3): what dim light from everywhere looks like."""

from __future__ import annotations

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.brdf import channels_last
from lightloc.optics.directions import cosine_direction
from lightloc.optics.kernel import Surfels, pick

STRATA = 32
"""Directions a point are STRATA^2, one in the middle of each cell of the unit square."""

LANES = 1 << 21


def reflected_ambient(s: Surfels, channels: int) -> NDArray[np.float64]:
    """Radiance of every observation under light of radiance 1 from everywhere: (n, channels).

    The integral of f(x, l, w) (n . l) over the hemisphere; the albedo of a diffuse surface.

    Examples
    --------
    >>> from lightloc import Lambert, Observations
    >>> from lightloc.optics.kernel import surfels
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=0.3))
    >>> reflected_ambient(surfels(q), 1).round(6).tolist()
    [[0.3]]
    """
    f = types()
    rays = STRATA * STRATA
    rows = max(1, LANES // rays)
    parts = []
    for first in range(0, s.n, rows):
        count = min(rows, s.n - first)
        lane = dr.arange(f.UInt32, count * rays)
        i, cell = lane // rays + first, lane % rays
        u = (f.Float(cell % STRATA) + 0.5) / STRATA
        v = (f.Float(cell // STRATA) + 0.5) / STRATA
        normal = pick(s.normal, i)
        d = cosine_direction(normal, u, v)
        cosine = dr.dot(normal, d)
        value = s.scatter(i, normal, d, pick(s.w, i)) * dr.select(cosine > 0, dr.pi / cosine, 0)
        each = [value] if dr.depth_v(value) == 1 else list(value)
        mean = [dr.block_sum(a, rays) / rays for a in each]
        dr.eval(mean)
        parts.append(np.stack([channels_last(m, count)[:, 0] for m in mean], axis=1))
    return np.broadcast_to(np.concatenate(parts), (s.n, channels)).copy()
