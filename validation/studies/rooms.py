"""What there is to know of rooms in three dimensions whose indirect light is rendered."""

from __future__ import annotations

import render
from lightloc import Observations, Options
from lightloc.fit import Problem, working_sigma
from lightloc.interreflection import Indirect, Split, spread, straight
from validation.judge import Tolerance, within


def most(seen: Observations, room: render.Room, indirect: Indirect, off: Tolerance) -> float:
    """The probability of being solved for errors at the bound, with the rendering as it is.

    Both kinds of light tell, B has its error, and so has what is rendered at the true lights.
    """
    q = seen.with_radiance(seen.radiance, working_sigma(seen, Options()))
    problem = Problem.of(q, q.known_sigma, room.geometry, q.bounds)
    columns = indirect(room.lights.positions)
    split = Split(q, straight(problem, room.lights), *columns, Options().outlier)
    bound = spread(split, room.lights, problem)
    share = off.intensity / 100 * room.lights.intensities[:, 0]
    return within(bound.covariance, off.position * room.diagonal, share)
