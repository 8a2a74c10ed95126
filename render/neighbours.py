"""What a picture's pixels share with their neighbours: surfaces, errors, the film's filter."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from render.picture import Picture

BEND = 0.2  # rad: the normals of neighbours on one smooth surface differ by less
SLANT = 0.1  # of their distance: how far off its tangent plane a neighbour may be
BOX = 1 / 12  # variance of a pixel's own square: what any film does at least
LAPLACIAN = np.array([[2, -1, 2], [-1, -4, -1], [2, -1, 2]]) / 3  # of the fitted quadratic
POOL = 5  # pixels squared over which standard errors are pooled


def smooth(
    x: NDArray, n: NDArray, there: NDArray[np.bool_], shape: NDArray | None = None
) -> NDArray[np.bool_]:
    """(h, w) bool: the pixels whose eight neighbours lie on one smooth surface with them.

    ``x``, ``n`` (h, w, 3) are positions and normals, ``there`` (h, w) where they count, and
    ``shape`` (h, w) a number of what is seen. What is beyond the picture's border is no neighbour.
    """
    kept = there.copy()
    height, width = there.shape
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            a = (_side(down, height), _side(right, width))
            b = (_side(-down, height), _side(-right, width))
            away = x[b] - x[a]
            with np.errstate(invalid="ignore"):
                bent = np.linalg.norm(n[b] - n[a], axis=2) >= BEND
                left = np.abs((away * n[a]).sum(axis=2)) > SLANT * np.linalg.norm(away, axis=2)
            other = ~there[b] | bent | left
            kept[a] &= ~(other if shape is None else other | (shape[b] != shape[a]))
    return kept


def at_centres(B: NDArray, used: NDArray[np.bool_], variance: float) -> NDArray[np.float64]:
    """(n, c) values at the used pixels' centres, from (h, w, c) averages about them.

    A filter of some variance, in pixels squared along each axis, adds half of that times the
    Laplacian, which is that of a quadratic fitted to 3 x 3 pixels. Without it, the bright spot
    beside a light is too dark, by more than the noise of a good picture.
    """
    around = np.pad(B, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    height, width = used.shape
    curvature = np.zeros_like(B)
    for down in range(3):
        for right in range(3):
            part = around[down : down + height, right : right + width]
            curvature += LAPLACIAN[down, right] * part
    found = curvature[used]
    return B[used] - variance / 2 * np.where(np.isfinite(found), found, 0)


def spread(sensor: Any) -> float:
    """The variance of the reconstruction filter of a sensor's film, pixels squared."""
    radius = sensor.film().rfilter().radius()
    x = np.linspace(-radius, radius, 257)
    weight = np.array(sensor.film().rfilter().eval(mi.Float(x)), float)
    return float((weight * x**2).sum() / weight.sum())


def _side(step: int, length: int) -> slice:
    """The rows that have a neighbour ``step`` rows on."""
    return slice(max(-step, 0), length - max(step, 0))


def pooled(picture: Picture, used: NDArray[np.bool_]) -> NDArray[np.float64] | None:
    """(n, c) root mean square of the standard errors around each used pixel; None where unknown.

    A pixel's own error is estimated from the samples that gave its value, and small where these
    happened to be small: a fit would trust such pixels most.
    """
    if picture.sigma is None:
        return None
    known = picture.known[..., None]
    square = np.where(known, picture.sigma, 0) ** 2
    around = (POOL, POOL, 1)
    total = uniform_filter(square, around, mode="constant")
    count = uniform_filter(known.astype(float), around, mode="constant")
    return np.sqrt(np.maximum(total[used], 0) / count[used])
