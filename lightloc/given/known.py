"""Light that is known: rendered by who knows its emitters, and subtracted with its error."""

from __future__ import annotations

import numpy as np

from lightloc.given.geometry import Geometry, OtherwiseLit
from lightloc.given.observations import Observations

ROUNDING = 1e-6
"""Error of the subtraction as a share of what is subtracted: that of two float32 renderings."""


def remove_known(
    observations: Observations, geometry: Geometry | None, *, samples: int = 256, seed: int = 0
) -> Observations:
    """Subtract the light of emitters that are known, such as lamps with a shape or a sky.

    Parameters
    ----------
    observations : Observations
        What is seen, under all light.
    geometry : Geometry or None
        The scene. Only an `OtherwiseLit` one has known light.
    samples : int
        Paths per observation, at least 2.
    seed : int
        Seed of the paths.

    Returns
    -------
    Observations
        What the other lights leave, with the error of what was rendered in ``sigma``; the same
        observations where there is no known light.

    Raises
    ------
    ValueError
        If the known light can't be rendered for these observations.

    Examples
    --------
    >>> from lightloc import Irradiance, Observations, remove_known
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], radiance=[3.0],
    ...                  material=Irradiance())
    >>> remove_known(q, None) is q  # nothing is known
    True
    """
    if not isinstance(geometry, OtherwiseLit):
        return observations
    B, error = geometry.known_light(observations, samples, seed)
    if not B.any():
        return observations
    left, sigma = observations.radiance - B, observations.sigma
    if sigma is not None:
        sigma = np.sqrt(sigma**2 + error**2 + (ROUNDING * B) ** 2)
    return observations.with_radiance(left, sigma)
