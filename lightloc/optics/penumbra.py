"""Visibility with soft edges, so that a search can follow the edge of a shadow."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import types
from lightloc.given import Geometry
from lightloc.optics.kernel import Surfels, visible


def visible_about(
    s: Surfels, i: Any, p: Any, geometry: Geometry, blur: float, flat: bool
) -> tuple[Any, Any]:
    """V as a mean over a cloud about p of standard deviation ``blur``, and its gradient.

    Over directions u of mean 0 and covariance 1, the gradient of E V(x, p + blur u) in p is
    E V u / blur where u is Gaussian (Stein's identity), and nearly so for any round cloud. In a
    ``flat`` scene the cloud lies in the plane. V itself is 0 or 1, and no ray says how it changes.
    """
    f = types()
    cloud = IN_THE_PLANE if flat else IN_SPACE
    mean, slope = f.Float(0), f.Array3f(0)
    for u in cloud:
        there = p + f.Array3f(*(blur * u).tolist())
        seen = dr.select(visible(s, i, there, geometry), f.Float(1), 0)
        mean += seen
        slope += seen * f.Array3f(*u.tolist())
    return mean / len(cloud), slope / (len(cloud) * blur)


def _round(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points with mean 0 and unit variance along each axis that they span."""
    points = points - points.mean(axis=0)
    spread = np.sqrt(np.square(points).mean(axis=0))
    return points / np.where(spread > 0, spread, 1)


def _disc(n: int) -> NDArray[np.float64]:
    """A sunflower of n points in the plane z = 0."""
    k = np.arange(n)
    angle, radius = k * np.pi * (3 - np.sqrt(5)), np.sqrt((k + 0.5) / n)
    return _round(np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1))


def _ball(n: int) -> NDArray[np.float64]:
    """n points on a spiral over the sphere, each at a distance of its own from the centre."""
    k = np.arange(n)
    angle, z = k * np.pi * (3 - np.sqrt(5)), 1 - (2 * k + 1) / n
    radius = ((7 * k % n + 0.5) / n) ** (1 / 3)  # 7 steps: neighbours lie in far shells
    ring = np.sqrt(1 - z * z)
    points = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    return _round(points * radius[:, None])


IN_THE_PLANE, IN_SPACE = _disc(13), _ball(8)
"""Enough that V takes a dozen values in a penumbra; each point costs a ray test."""
