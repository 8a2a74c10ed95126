"""What a caller asks of `localize`: checked, before any work is done."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import units
from lightloc.checks import array
from lightloc.given import (
    Geometry,
    Limits,
    Observations,
    Options,
    PointLights,
    limits_of,
)
from lightloc.interreflection import GATHERED, Indirect
from lightloc.paper import Paper, Surface

METHODS: dict[str, type[Options] | type[Paper]] = {"search": Options, "paper": Paper}


def held(fixed: ArrayLike, start: PointLights | None, o: Options | Paper) -> NDArray[np.float64]:
    """The (k, 3) places of lights that are known."""
    places = array("fixed", fixed, (None, 3))
    if not len(places):
        raise ValueError("fixed has no positions; expected at least one")
    if start is not None:
        raise ValueError("start and fixed are given; expected one of them")
    if isinstance(o, Options) and o.free:
        raise ValueError(f"fixed and free={o.free} are given; expected one of them")
    return places


def begun(start: PointLights, q: Observations, o: Options) -> PointLights:
    """The lights to begin with; ValueError where the observations can't be theirs."""
    if not isinstance(start, PointLights):
        raise ValueError(f"start is a {type(start).__name__}; expected PointLights")
    if len(start) > o.most_lights:
        raise ValueError(f"start has {len(start)} lights; most_lights is {o.most_lights}")
    if start.channels != q.channels:
        raise ValueError(f"start has {start.channels} channels, the observations have {q.channels}")
    if units.is_other(start.unit, q.unit):
        raise ValueError(f"start is in {start.unit}, the observations are in {q.unit}")
    return replace(start, intensities=np.nan_to_num(start.intensities))  # unseen: as if dark


def settings(
    method: str,
    options: Options | Paper | None,
    surface: Surface | None,
    indirect: Indirect | int | str | None,
) -> Options | Paper:
    """The method's options; raises ValueError where something belongs to the other method."""
    if method not in METHODS:
        raise ValueError(f"method is '{method}'; expected 'search' or 'paper'")
    o = options or METHODS[method]()
    if not isinstance(o, METHODS[method]):
        raise ValueError(f"method '{method}' takes {METHODS[method].__name__} as its options")
    if isinstance(indirect, str) and indirect != GATHERED:
        raise ValueError(
            f"indirect is {indirect!r}; expected a number of paths, a function or 'gathered'"
        )
    if isinstance(o, Paper) and indirect not in (None, GATHERED):
        raise ValueError("method 'paper' renders no interreflected light; leave out indirect")
    if isinstance(o, Options) and surface is not None:
        raise ValueError("method 'search' takes no surface")
    return o


def are_given(observations: Observations, geometry: Geometry | None) -> None:
    """Raise ValueError where what is given is no observations, or no geometry."""
    if not isinstance(observations, Observations):
        raise ValueError(f"observations are a {type(observations).__name__}; not Observations")
    if geometry is not None and not isinstance(geometry, Geometry):
        raise ValueError(
            f"geometry is a {type(geometry).__name__}; expected one with the functions visible and "
            "intersect, such as render.load(...).geometry"
        )


def looked_at(
    observations: Observations, o: Options | Paper, gathers: bool
) -> tuple[Observations, Limits]:
    """The observations that the sensor could tell, and which it could not.

    Where nobody knows the noise, their values are asked too; but not where footnote 1 gathers from
    all of them.
    """
    unknown = observations.sigma is None or observations.relative_sigma
    look = isinstance(o, Options) and (unknown or o.noise != "given")
    limits = limits_of(observations, look and not (observations.interreflected and gathers))
    used = ~limits.left_out
    if not used.any():
        raise ValueError(
            "all observations are saturated or at the sensor's floor; expected at least one that "
            "is not"
        )
    if limits.step != observations.step:
        observations = replace(observations, step=limits.step)
    return observations if used.all() else observations.at(used), limits
