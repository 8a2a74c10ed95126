"""What lights bring by way of the room's surfaces, rendered: the shading function beyond Eq. 2."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import Observations, PointLights
from lightloc.checks import array
from render.observe import indirect, probe
from render.room import Room, relight

Columns = tuple[NDArray[np.float64], NDArray[np.float64]]

STREAM = 0x1D17EC7
"""Goes into every seed: the same paths as in `observe` would carry its errors, and hide them."""


def interreflected(
    room: Room, q: Observations, *, spp: int = 256, seed: int = 0
) -> Callable[[ArrayLike], Columns]:
    """How much light arrives at ``q`` by way of the room's surfaces: a function of positions.

    Handed to `lightloc.localize` as ``indirect``, it stands for the whole room: its surfaces and
    BRDFs, never its lights.

    Args:
        room: its own lights are not used.
        q: where to look at it from, and at what.
        spp: path samples per point and light.
        seed: of the paths. Each light has the same ones in every call, wherever it is, so that
            the result moves with the light and not with chance.

    Returns:
        A function from (k, 3) positions in metres to H and its standard error, each (n, k, c), in
        m^-2 sr^-1: ``H @ intensities`` is the interreflected radiance of lights there. The errors
        of different lights are independent of each other and of those of ``q``.

    Raises:
        ValueError: spp is below 2.

    >>> import lightloc, render
    >>> room = render.load("box_one")
    >>> q = render.observe(room, points=64, seed=0, transport="direct")
    >>> H, error = interreflected(room, q, spp=16)(room.lights.positions)
    >>> H.shape, bool((error > 0).all())
    ((64, 1, 1), True)
    """
    if spp < 2:
        raise ValueError(f"interreflected expects spp >= 2; got {spp}")
    si = probe(room, q.positions, q.directions)
    n, c = len(q), q.channels

    def shade(positions: ArrayLike) -> Columns:
        places = array("positions", positions, (None, 3))
        H, error = np.zeros((n, len(places), c)), np.zeros((n, len(places), c))
        for i, p in enumerate(places):
            alone = relight(room, PointLights(p[None], [1.0]))
            own = int(np.random.SeedSequence([STREAM, seed, i]).generate_state(1)[0])
            mean, spread = indirect(alone, si, spp, own)
            H[:, i], error[:, i] = mean[:, :c], spread[:, :c]
        return H, error

    return shade
