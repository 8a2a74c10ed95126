"""What lights bring by way of the room's surfaces, rendered: the shading function beyond Eq. 2."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import Observations
from lightloc.checks import number
from render.room import Room

Columns = tuple[NDArray[np.float64], NDArray[np.float64]]


def interreflected(
    room: Room, q: Observations, *, spp: int = 256, seed: int = 0
) -> Callable[[ArrayLike], Columns]:
    """Make a function of positions that renders what lights there bring by way of the surfaces.

    Handed to `lightloc.localize` as ``indirect``, it stands for the whole room: its surfaces and
    BRDFs, never its lights.

    Parameters
    ----------
    room : Room
        The room; its own lights are not used.
    q : Observations
        The n observations: what is seen, and from where.
    spp : int
        Path samples per point and light, at least 2.
    seed : int
        Seed of the paths. Each light has the same ones in every call, wherever it is, so that the
        result moves with the light and not with chance.

    Returns
    -------
    callable
        From (k, 3) positions, in the unit of length, to H and its standard error, each an (n, k, c)
        array, as of `lightloc.Interreflecting.interreflection`.

    Raises
    ------
    ValueError
        If ``spp`` is below 2.

    Examples
    --------
    >>> from render import interreflected, load, observe
    >>> room = load("box_one")
    >>> q = observe(room, points=64, seed=0, transport="direct")
    >>> H, error = interreflected(room, q, spp=16)(room.lights.positions)
    >>> H.shape, bool((error > 0).all())
    ((64, 1, 1), True)
    """
    number("interreflected: spp", spp, 2, whole=True)
    return lambda positions: room.geometry.interreflection(positions, q, spp, seed)
