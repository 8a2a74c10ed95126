"""The shading function S(q, p) of Eq. 2, its gradient in p, and Eq. 4 that sums it up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import doubles, types
from lightloc.checks import array
from lightloc.given import Geometry, Observations, PointLights
from lightloc.optics.kernel import (
    Surfels,
    columns,
    pick,
    shade,
    surfels,
    unoccluded_slope,
    visible,
)
from lightloc.optics.penumbra import visible_about

LANES = 1 << 22
"""Most (q, p) pairs in one kernel launch: 4 Mi pairs keep temporaries under 200 MB."""


def shading(
    q: Observations | Surfels, positions: ArrayLike, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """S(q, p) of Eq. 2 for every observation and every one of (k, 3) positions, m^-2 sr^-1.

    Returns (n, k, c). The radiance of lights there is ``S @ intensities``.

    >>> import numpy as np
    >>> from lightloc import Lambert
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=1.0))
    >>> S = shading(q, [[0, 0, 2]])
    >>> bool(np.isclose(S[0, 0, 0], 1 / np.pi / 2**2, rtol=1e-6))
    True
    """
    s = q if isinstance(q, Surfels) else surfels(q)
    points = array("positions", positions, (None, 3))
    return shaded(s, points, geometry).transpose(2, 1, 0).astype(float)


def shaded(
    s: Surfels, positions: NDArray[np.float64], geometry: Geometry | None
) -> NDArray[np.floating]:
    """S at (k, 3) positions as (c, k, n), in the kernel's own precision."""
    blocks = []
    with doubles(s.double):
        for i, p, k in _pairs(s.n, positions):
            value = shade(s, i, p, geometry)
            dr.eval(value)
            blocks.append(_numpy(value, k, s.n))
    return _joined(blocks, 1)


def shading_gradient(
    q: Observations | Surfels,
    positions: ArrayLike,
    geometry: Geometry | None = None,
    blur: float = 0.0,
    axes: Sequence[int] | NDArray[np.intp] = (0, 1, 2),
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """S(q, p) and dS/dp at (k, 3) positions: (n, k, c) and (n, k, c, len(axes)).

    Derivatives in closed form where the BRDF has one, else by automatic differentiation. V is held
    constant, as it is everywhere but on a shadow's edge, and the gradient is 0 where S is. With
    ``blur``, in metres, V is a mean over positions that far about p (`visible_about`), and its
    slope, by Stein's identity, has its part in the gradient.
    """
    s = q if isinstance(q, Surfels) else surfels(q)
    points = array("positions", positions, (None, 3))
    S, gradient = slopes(s, points, axes)
    if geometry is not None or not s.flat:
        V, turn = shadows(s, points, geometry, blur, axes)
        gradient = gradient * V
        if turn is not None:
            gradient = gradient + S[:, None] * turn
        S = S * V
    return S.transpose(2, 1, 0).astype(float), gradient.transpose(3, 2, 0, 1).astype(float)


def slopes(
    s: Surfels, positions: NDArray[np.float64], axes: Sequence[int] | NDArray[np.intp] = (0, 1, 2)
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """S with V = 1 and dS/dp at (k, 3) positions, in the kernel's own precision.

    Returns (c, k, n) and (c, d, k, n), where d is the number of axes.
    """
    values, gradients = [], []
    with doubles(s.double):
        for i, p, k in _pairs(s.n, positions):
            value, gradient = unoccluded_slope(s, i, p)
            along = [gradient[int(axis)] for axis in axes]
            dr.eval(value, along)
            values.append(_numpy(value, k, s.n))
            gradients.append(np.stack([_numpy(a, k, s.n) for a in along], axis=1))
    return _joined(values, 1), _joined(gradients, 2)


def shadows(
    s: Surfels,
    positions: NDArray[np.float64],
    geometry: Geometry | None,
    blur: float = 0.0,
    axes: Sequence[int] | NDArray[np.intp] = (0, 1, 2),
) -> tuple[NDArray[np.floating], NDArray[np.floating] | None]:
    """V between every observation and (k, 3) positions: (k, n), and its slope (d, k, n).

    0 or 1 and no slope without ``blur``; else as `visible_about` says.
    """
    f, seen, slope = types(), [], []
    soft = bool(blur) and geometry is not None
    with doubles(s.double):
        for i, p, k in _pairs(s.n, positions):
            if soft:
                assert geometry is not None
                V, turn = visible_about(s, i, p, geometry, blur, len(axes) == 2)
                along = [turn[int(axis)] for axis in axes]
                dr.eval(V, along)
                slope.append(np.concatenate([_numpy(a, k, s.n) for a in along]))
            else:
                V = dr.select(visible(s, i, p, geometry), f.Float(1), 0)
            seen.append(np.broadcast_to(V.numpy(), k * s.n).reshape(k, s.n))
    return _joined(seen, 0), _joined(slope, 1) if soft else None


def _numpy(value: Any, k: int, n: int) -> NDArray[np.float64]:
    """A kernel's Float or Array3f over pairs as (c, k, n)."""
    if dr.depth_v(value) == 1:
        return np.broadcast_to(value.numpy(), k * n).reshape(1, k, n)
    return np.stack([np.broadcast_to(c.numpy(), k * n).reshape(k, n) for c in value])


def _joined(blocks: list[NDArray[np.float64]], axis: int) -> NDArray[np.float64]:
    return blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=axis)


def radiance(
    q: Observations | Surfels, lights: PointLights, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """Direct radiance of ``lights`` at the observations, Eq. 4: (n, c)."""
    if not len(lights):
        n = q.n if isinstance(q, Surfels) else len(q)
        return np.zeros((n, lights.channels))
    S = shading(q, lights.positions, geometry)
    return np.einsum(
        "nkc,kc->nc",
        np.broadcast_to(S, (*S.shape[:2], max(S.shape[2], lights.channels))),
        lights.intensities,
    )


def check_gradient(
    q: Observations, position: ArrayLike, geometry: Geometry | None = None, step: float = 1e-3
) -> float:
    """The worst disagreement of `shading_gradient` with central differences at one position.

    Returns ``max |AD - FD| / max |FD|`` over the observations that are visible at all six shifted
    positions. The differences are of float32 values: with ``step`` in metres, expect
    about 1e-7 / step + step^2.
    """
    p = array("position", position, (3,))
    moves = step * np.concatenate([np.eye(3), -np.eye(3)])
    S, gradient = shading_gradient(q, p[None], geometry)
    around = shading(q, p + moves, geometry)
    smooth = (around > 0).all(axis=(1, 2)) & (S[:, 0] > 0).all(axis=1)
    if not smooth.any():
        raise ValueError("check_gradient: no observation sees all of the shifted positions")
    slope = (around[:, :3] - around[:, 3:]) / (2 * step)
    error = np.abs(slope.transpose(0, 2, 1) - gradient[:, 0])[smooth]
    return float(error.max(initial=0.0) / max(np.abs(slope[smooth]).max(initial=0.0), 1e-30))


def _pairs(n: int, positions: ArrayLike) -> Iterator[tuple[Any, Any, int]]:
    """Blocks of all pairs of n observations and (k, 3) positions: index, position, count."""
    f = types()
    points = array("positions", positions, (None, 3))
    rows = max(1, LANES // n)
    for first in range(0, len(points), rows):
        block = points[first : first + rows]
        lane = dr.arange(f.UInt32, n * len(block))
        which = lane // n
        table = columns(block)
        yield lane - which * n, pick(table, which), len(block)
