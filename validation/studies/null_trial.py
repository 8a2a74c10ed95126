"""Full searches of data that are fully explained: does one claim a light too many?"""

from __future__ import annotations

import time

import numpy as np

from lightloc import localize
from validation.studies.explained_rooms import empty, explained, options
from validation.studies.scenes import parts
from validation.studies.trial import Trial, judged

SEED = 83_009
LIGHTS = (1, 2, 3)
ROWS = ("2d-stated", "2d-unknown", "3d-stated", "3d-unknown")


def null(name: str) -> Trial:
    """One room: ``3d-unknown-017``, whose data do not state their standard errors."""
    (dimensions, told), number = parts(name)
    d = int(dimensions[0])
    rng = np.random.default_rng([SEED, ROWS.index(f"{dimensions}-{told}"), number])
    room = explained(empty(d, LIGHTS[number % len(LIGHTS)], rng), d, rng)
    q = room.told(told == "stated")
    clock = time.perf_counter()
    answer = localize(q, room.geometry, options=options())
    return judged(
        name,
        answer,
        q,
        room.lights,
        room.geometry,
        seconds=time.perf_counter() - clock,
        diagonal=room.size if d == 3 else None,
    )
