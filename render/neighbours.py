"""What a picture's pixels share with their neighbours: surfaces, errors, the film's filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

BEND = 0.2  # rad: the normals of neighbours on one smooth surface differ by less
SLANT = 0.1  # of their distance: how far off its tangent plane a neighbour may be
LAPLACIAN = np.array([[2, -1, 2], [-1, -4, -1], [2, -1, 2]]) / 3  # of the fitted quadratic
WAVES = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]]) / 6  # of no quadratic, only of noise
POOL = 9  # pixels squared over which squared errors are averaged
FLOOR = 1e-4  # error of the file's numbers, which may be half floats, as a share of B and its mean
ALIKE = 0.05  # correlation of noise that counts as none: errors are too small by a tenth at most
RADII = 257  # points over a filter's radius


@dataclass(frozen=True)
class Filter:
    """How a film averages the samples about each pixel's centre, along either axis.

    Parameters
    ----------
    variance
        Of its weights, pixels squared.
    alike
        (3,) correlation of the noise of pixels that are 0, 1 and 2 apart.
    stride
        How far apart pixels are whose noise is not alike, in rows and in columns.
    """

    variance: float
    alike: tuple[float, float, float]
    stride: int = 1

    @staticmethod
    def of(sensor: Any) -> Filter:
        """That of a sensor's film."""
        film = sensor.film().rfilter()
        x = np.linspace(-1, 1, 2 * RADII + 1) * film.radius()
        weight = np.array(film.eval(mi.Float(x)), float)
        reach = max(3, int(np.ceil(2 * film.radius())) + 1)
        apart = [np.interp(x + k, x, weight, left=0, right=0) @ weight for k in range(reach)]
        alike = [float(one / apart[0]) for one in apart]
        return Filter(
            float(weight @ x**2 / weight.sum()),
            (1.0, alike[1], alike[2]),
            next(k for k in range(1, reach) if abs(alike[k]) < ALIKE),
        )

    def kept(self, kernel: NDArray) -> float:
        """The share of a pixel's variance that a sum over 3 x 3 pixels has."""
        alike = np.array([[self.alike[abs(i - j)] for j in range(3)] for i in range(3)])
        return float((kernel * (alike @ kernel @ alike)).sum())


BOX = Filter(1 / 12, (1.0, 0.0, 0.0))
"""A pixel's own square: what any film averages over at least."""


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


def at_centres(B: NDArray, used: NDArray[np.bool_], film: Filter) -> NDArray[np.float64]:
    """(n, c) values at the used pixels' centres, from (h, w, c) averages about them.

    A filter adds half its variance times the Laplacian, which is that of a quadratic fitted to 3 x
    3 pixels. Without this, the bright spot beside a light is too dark, by more than the noise of a
    good picture.
    """
    curvature = _summed(B, LAPLACIAN)[used]
    return B[used] - film.variance / 2 * np.where(np.isfinite(curvature), curvature, 0)


def noise_of(
    B: NDArray, used: NDArray[np.bool_], film: Filter, sigma: NDArray | None
) -> NDArray[np.float64]:
    """(n, c) standard errors at the used pixels' centres, right but for a factor.

    Each is the root mean square over the used pixels around, of ``sigma`` (h, w, c) where that is
    known and else of what no quadratic explains: what ``WAVES`` leave. A pixel's own value has no
    part in that, where others are known: noise of a renderer is skewed, so that errors are large
    where values are, and a fit would trust most those that happen to be low.
    """
    square = (_summed(B, WAVES) ** 2 / film.kept(WAVES)) if sigma is None else sigma**2
    centre = np.zeros((3, 3))
    centre[1, 1] = 1
    share = film.kept(centre - film.variance / 2 * LAPLACIAN)
    value = np.abs(B[used])
    floor = FLOOR * (value + value.mean())
    added = np.full(B.shape, np.nan)  # as large as the orders that it leaves out
    added[used] = at_centres(B, used, film) - B[used]
    return np.sqrt(_pooled(square, used) * share + floor**2 + _pooled(added**2, used))


TINY = 1e-9  # less than one pixel's share of those around


def _pooled(square: NDArray, used: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(n, c) means of squares over the used pixels around, or a pixel's own where there are none.

    Where that is not known either, it is the mean of all.
    """
    known = used & np.isfinite(square).all(axis=2)
    total = _around(np.where(known[..., None], square, 0))[used]
    count = _around(known[..., None].astype(float))[used]
    mean = square[known].mean(axis=0) if known.any() else np.zeros(square.shape[2])
    alone = np.where(known[..., None], square, mean)[used]
    return np.maximum(np.where(count > TINY, total / np.maximum(count, TINY), alone), 0)


def _around(values: NDArray) -> NDArray[np.float64]:
    """(h, w, c) sums over `POOL` pixels squared, without those that a pixel's own value is in."""
    whole, own = (
        side**2 * uniform_filter(values, (side, side, 1), mode="constant") for side in (POOL, 3)
    )
    return np.asarray(whole - own)


def _summed(B: NDArray, kernel: NDArray) -> NDArray[np.float64]:
    """(h, w, c) sums over 3 x 3 pixels with a symmetric kernel; NaN where one is missing."""
    around = np.pad(B.astype(float), ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    height, width = B.shape[:2]
    total = np.zeros(B.shape)
    for down in range(3):
        for right in range(3):
            total += kernel[down, right] * around[down : down + height, right : right + width]
    return total


def _side(step: int, length: int) -> slice:
    """The rows that have a neighbour ``step`` rows on."""
    return slice(max(-step, 0), length - max(step, 0))
