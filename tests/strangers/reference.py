"""B of a whole file by Mitsuba's own path integrator, with nothing of ours in between."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lightloc import Observations
from render.accepted import build
from render.scene_file import SceneFile

LANES = 1 << 20
PROBE_SHARE = 1e-3  # of the diagonal: where a ray starts, before the surface


def whole_file(path: Path, values: Mapping[str, Any]) -> tuple[Any, bool]:
    """The scene as Mitsuba loads it, and True; as we read it, where it refuses the file's words."""
    try:
        own = mi.load_file(str(path), **{name: str(value) for name, value in values.items()})
    except (RuntimeError, ValueError):
        return build(SceneFile.read(path, values)), False
    return own, True


def by_mitsuba(
    scene: Any, q: Observations, diagonal: float, spp: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) mean and standard error of all light along the rays of observations."""
    integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 8})
    sampler = mi.load_dict({"type": "independent"})
    start = q.positions + PROBE_SHARE * diagonal * q.directions
    rays = mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(-q.directions.T))
    mean, error = np.zeros((2, len(q), 3))
    rows = max(1, LANES // spp)
    for first in range(0, len(q), rows):
        count = min(rows, len(q) - first)
        sampler.seed(seed * 7919 + first, count * spp)
        lane = dr.arange(mi.UInt32, count * spp) // spp + first
        B = integrator.sample(scene, sampler, dr.gather(mi.Ray3f, rays, lane))[0]
        dr.eval(B)
        sums = [dr.block_sum(channel, spp) for channel in B]
        squares = [dr.block_sum(dr.square(channel), spp) for channel in B]
        m, m2 = np.array(sums, float).T / spp, np.array(squares, float).T / spp
        mean[first : first + count] = m
        error[first : first + count] = np.sqrt(np.maximum(m2 - m * m, 0) / (spp - 1))
    return mean, error
