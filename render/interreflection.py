"""What lights bring by way of the room's surfaces, rendered: the shading function beyond Eq. 2."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import Observations
from render.room import Room

Columns = tuple[NDArray[np.float64], NDArray[np.float64]]


def interreflected(
    room: Room, q: Observations, *, spp: int = 256, seed: int = 0
) -> Callable[[ArrayLike], Columns]:
    """How much light arrives at ``q`` by way of the room's surfaces: a function of positions.

    Handed to `lightloc.localize` as ``indirect``, it stands for the whole room: its surfaces and
    BRDFs, never its lights.

    Parameters
    ----------
    room : Room
        Its own lights are not used.
    q : Observations
        Where to look at it from, and at what.
    spp : int
        Path samples per point and light.
    seed : int
        Of the paths. Each light has the same ones in every call, wherever it is, so that the
        result moves with the light and not with chance.

    Returns
    -------
    function
        From (k, 3) positions to H and its standard error, each (n, k, c), in m^-2 sr^-1 per W/sr:
        ``H @ intensities`` is the interreflected radiance of lights there. The errors of different
        lights are independent of each other and of those of ``q``.

    Raises
    ------
    ValueError
        spp is below 2, or ``q`` are irradiance.

    Examples
    --------
    >>> import lightloc, render
    >>> room = render.load("box_one")
    >>> q = render.observe(room, points=64, seed=0, transport="direct")
    >>> H, error = interreflected(room, q, spp=16)(room.lights.positions)
    >>> H.shape, bool((error > 0).all())
    ((64, 1, 1), True)
    """
    if spp < 2:
        raise ValueError(f"interreflected expects spp >= 2; got {spp}")
    return lambda positions: room.geometry.interreflection(positions, q, spp, seed)
