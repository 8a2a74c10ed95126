"""Errors that cover other models, which explain as well and say something else of the lights."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lightloc.answer import Localization
from lightloc.diagnosis.departure import Array
from lightloc.diagnosis.lamps import Lamps
from lightloc.fit import Bound
from lightloc.given import PointLights


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another model that explains the observations.

    Parameters
    ----------
    lights : tuple of int
        The lights that it is about.
    name : str
        What they would be, as a user reads it.
    there
        The lights under it.
    spread : (m, m) array
        Their covariance under it, ordered as that of the answer.
    cost : float
        The robust chi-square that it leaves.
    lamps
        The lamps that they would be; None where it is about something else.
    """

    lights: tuple[int, ...]
    name: str
    there: PointLights
    spread: Array
    cost: float
    lamps: Lamps | None = None


def covering(
    covariance: Array, lights: PointLights, others: list[Alternative], axes: NDArray[np.intp]
) -> Array:
    """A covariance that is in no direction less than another model's, about the lights told."""
    here = vector(lights, axes)
    for one in others:
        off = vector(one.there, axes) - here
        covariance = joined(covariance, one.spread + np.outer(off, off))
    return covariance


def vector(lights: PointLights, axes: NDArray[np.intp]) -> Array:
    """Free coordinates, then intensities."""
    return np.concatenate([lights.positions[:, axes].ravel(), lights.intensities.ravel()])


def joined(a: Array, b: Array) -> Array:
    """A covariance that is in no direction less than either, and no larger than it must be.

    Where one of them is not finite, it is the first's.

    Examples
    --------
    >>> joined(np.diag([1.0, 4.0]), np.diag([9.0, 1.0])).round(6).tolist()
    [[9.0, 0.0], [0.0, 4.0]]
    """
    known = np.flatnonzero(np.isfinite(np.diag(a)) & np.isfinite(np.diag(b)))
    if len(known) < len(a):
        result = a.copy()
        some = np.ix_(known, known)
        result[some] = joined(a[some], b[some]) if len(known) else a[some]
        return result
    size = np.sqrt(np.maximum(np.diag(a), np.diag(b)))
    size[size == 0] = 1.0
    values, vectors = np.linalg.eigh(a / np.outer(size, size))
    root = np.sqrt(np.maximum(values, 1e-12 * max(values.max(initial=0), 1e-300)))
    back = vectors / root
    grown, turn = np.linalg.eigh(back.T @ (b / np.outer(size, size)) @ back)
    half = (vectors * root) @ turn * np.sqrt(np.maximum(grown, 1.0))
    return np.asarray(half @ half.T * np.outer(size, size))


def errors(
    covariance: Array, lights: PointLights, others: list[Alternative], axes: NDArray[np.intp]
) -> Bound:
    """Standard errors that cover the other models."""
    wide = covering(covariance, lights, others, axes)
    return Bound.of(wide, axes, *lights.intensities.shape)


def with_errors(found: Localization, bound: Bound) -> Localization:
    """The answer with other errors."""
    return replace(
        found,
        position_error=bound.position,
        intensity_error=bound.intensity,
        covariance=bound.covariance,
    )
