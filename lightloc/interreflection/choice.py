"""Footnote 1 or rendering: whether the observations tell what lights them by way of surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import numpy as np

from lightloc.answer import Way
from lightloc.backend import types
from lightloc.given import Geometry, Interreflecting, Observations
from lightloc.interreflection.footnote_1 import ENDED, RadianceCache, is_told
from lightloc.interreflection.gloss import glossiness, hemisphere
from lightloc.interreflection.rendered import Indirect
from lightloc.optics import surfels

COVERED = 0.9
"""Of what surfaces shine on the observations: more than this is near one, where they are spread
over a room (0.97 and more, measured), and far less in the view of one camera (0.3)."""

GLOSSY = 0.1
"""Of the light reflected, by direction: plastic has 0.2 and metal more, and footnote 1 then errs by
more than it can tell (measured)."""

SAMPLE, RAYS = 256, 64
"""Observations that are asked what shines on them, and rays from each."""


GATHERED = "gathered"
"""Asks for footnote 1."""

NOT_GATHERED = (
    "footnote 1 would gather from points that are saturated; give indirect, to render "
    "interreflected light"
)
"""Why that can't be done."""


@dataclass(frozen=True)
class Choice:
    """How interreflected light is treated, and why.

    Parameters
    ----------
    way
        Gathered or rendered.
    why
        A sentence.
    doubtful
        Whether footnote 1 does not apply, and there is nothing else.
    """

    way: Way
    why: str
    doubtful: bool = False


def may_gather(geometry: Geometry | None, indirect: Indirect | int | str | None) -> bool:
    """Whether footnote 1 takes its radiance from the observations, all of which it then needs."""
    return indirect == GATHERED or not (indirect or isinstance(geometry, Interreflecting))


def treatment(
    q: Observations,
    geometry: Geometry | None,
    saturated: bool,
    indirect: Indirect | int | str | None,
    seed: int,
    choose: bool = True,
) -> Choice:
    """How interreflected light is to be treated: as asked, or else as the observations allow.

    ``saturated`` is whether observations were left out; unless one may ``choose``, it is gathered.
    """
    if callable(indirect) or (indirect is not None and indirect != GATHERED):
        return Choice(Way.RENDERED, "")
    if geometry is None:
        raise ValueError("interreflected light can't be removed without the geometry")
    if indirect is None and choose:
        return chosen(q, geometry, saturated, seed)
    if saturated:
        raise ValueError(NOT_GATHERED)
    return Choice(Way.GATHERED, "")


def chosen(q: Observations, geometry: Geometry, saturated: bool, seed: int = 0) -> Choice:
    """Footnote 1 where it applies, rendering where it does not and the geometry can render.

    ``saturated`` is whether observations were left out. Raises ValueError where neither is
    possible.
    """
    can = isinstance(geometry, Interreflecting)
    if q.quantity == "irradiance":
        if not can:
            raise ValueError(
                "interreflected irradiance can't be gathered from other readings; give indirect, "
                "to render it"
            )
        return Choice(Way.RENDERED, "Readings of irradiance do not tell what surfaces send.")
    if saturated:
        if not can:
            raise ValueError(NOT_GATHERED)
        return Choice(Way.RENDERED, "Some of the observations are saturated.")
    if q.max_depth is not None:
        if not can:
            raise ValueError(ENDED)
        return Choice(Way.RENDERED, f"The observations hold no paths longer than {q.max_depth}.")
    glossy, share = glossiness(q, seed), coverage(q, geometry, seed)
    said = f"The observations cover {100 * share:.0f} % of what surfaces shine on them"
    if glossy > GLOSSY:
        said = f"Of the light that surfaces reflect, {100 * glossy:.0f} % depends on direction"
    elif share >= COVERED:
        return Choice(Way.GATHERED, f"{said}, and the surfaces are largely diffuse.")
    return Choice(Way.RENDERED, f"{said}.") if can else Choice(Way.GATHERED, f"{said}.", True)


def coverage(q: Observations, geometry: Geometry, seed: int = 0) -> float:
    """The share of what surfaces shine on the observations that comes from near other ones, 0 to 1.

    It is that of cosine-distributed rays, of those that meet a surface: a point on it is told by
    an observation on the same side of the same surface, nearby.

    Examples
    --------
    Points on a floor, under a ceiling of which nothing is seen:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations
    >>> class Ceiling:
    ...     def visible(self, x, p, active=True):
    ...         return active
    ...     def intersect(self, x, d, active=True):
    ...         t = (2 - x[2]) / d[2]
    ...         return (t > 0) & active, x + t * d
    >>> x = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
    >>> q = Observations(positions=x, normals=[[0, 0, 1]] * 100, directions=[[0, 0, 1]] * 100,
    ...                  radiance=np.ones(100), material=Lambert(albedo=0.5))
    >>> coverage(q, Ceiling())
    0.0
    """
    rng = np.random.default_rng(seed)
    rows = np.repeat(np.sort(rng.permutation(len(q))[:SAMPLE]), RAYS)
    d = hemisphere(q.normals[rows], rng)
    f, origin = types(), surfels(q, geometry).origin
    start = [f.Float(np.array(axis)[rows]) for axis in origin]
    hit, y = geometry.intersect(f.Array3f(*start), f.Array3f(d.T), f.Bool(True))
    dr.eval(hit, y)
    met = np.broadcast_to(np.array(hit), len(rows))
    if not met.any():
        return 1.0
    places = np.stack([np.broadcast_to(np.array(axis), len(rows)) for axis in y], axis=1)
    return float(is_told(q, RadianceCache.of(q), places[met].astype(float), d[met]).mean())
