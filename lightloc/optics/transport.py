"""The shading function S(q, p) of Eq. 2, its gradient in p, and Eq. 4 that sums it up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import units
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
    """Shading function S(q, p) of Eq. 2, for every observation and every position.

    Parameters
    ----------
    q : Observations
        The n observations; or the same as Dr.Jit arrays (`lightloc.optics.Surfels`).
    positions : (k, 3) array_like
        Positions p of a light, in the unit of length.
    geometry : Geometry, optional
        What occludes; nothing does where None.

    Returns
    -------
    (n, k, c) array
        S in m^-2 sr^-1: the radiance that a light of 1 W/sr at p leaves. c is the number of
        channels of the material.

    Raises
    ------
    ValueError
        If the positions have another shape, or are not finite.

    Examples
    --------
    A diffuse surface with a light 2 m above it, S = albedo / (pi d^2):

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, shading
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=1.0))
    >>> S = shading(q, [[0, 0, 2]])
    >>> bool(np.isclose(S[0, 0, 0], 1 / np.pi / 2**2, rtol=1e-6))
    True
    """
    s = q if isinstance(q, Surfels) else surfels(q, geometry)
    points = array("positions", positions, (None, 3))
    return shaded(s, points, geometry).transpose(2, 1, 0).astype(float)


def shaded(
    s: Surfels, positions: NDArray[np.float64], geometry: Geometry | None
) -> NDArray[np.floating]:
    """S in m^-2 sr^-1 at (k, 3) positions as (c, k, n), in the kernel's own precision."""
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
    """Shading function S(q, p) of Eq. 2 and its gradient dS/dp.

    V is held constant, as it is everywhere but on a shadow's edge, and the gradient is 0 where S
    is.

    Parameters
    ----------
    q : Observations
        The n observations; or the same as Dr.Jit arrays (`lightloc.optics.Surfels`).
    positions : (k, 3) array_like
        Positions p of a light, in the unit of length.
    geometry : Geometry, optional
        What occludes; nothing does where None.
    blur : float
        Where above 0, V is a mean over positions this far about p, in the unit of length, and its
        slope has its part in the gradient; shadows have hard edges where 0.
    axes : (d,) sequence of int
        Coordinates of p to differentiate by: 0, 1, 2 for x, y, z.

    Returns
    -------
    S : (n, k, c) array
        As `shading`, m^-2 sr^-1.
    gradient : (n, k, c, d) array
        Derivatives of S along the axes, m^-3 sr^-1.

    Raises
    ------
    ValueError
        If the positions have another shape, or are not finite.

    Notes
    -----
    Derivatives are in closed form where the BRDF has one, else by automatic differentiation. With
    ``blur``, the slope of V follows from Stein's identity.

    Examples
    --------
    Straight above a surface S falls off as 1 / d^2, so that dS/dz = -2 S / d:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, shading_gradient
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=1.0))
    >>> S, gradient = shading_gradient(q, [[0, 0, 2]])
    >>> bool(np.allclose(gradient[0, 0, 0], [0, 0, -2 * S[0, 0, 0] / 2]))
    True
    """
    s = q if isinstance(q, Surfels) else surfels(q, geometry)
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

    Returns (c, k, n) in m^-2 sr^-1 and (c, d, k, n) in m^-3 sr^-1, where d is the number of axes.
    """
    values, gradients = [], []
    with doubles(s.double):
        for i, p, k in _pairs(s.n, positions):
            value, gradient = unoccluded_slope(s, i, p)
            along = [gradient[int(axis)] for axis in axes]
            dr.eval(value, along)
            values.append(_numpy(value, k, s.n))
            turned = [_numpy(a, k, s.n)[:, None] for a in along]
            none = np.zeros_like(values[-1][:, None][:, :0])
            gradients.append(np.concatenate([none, *turned], axis=1))
    return _joined(values, 1), _joined(gradients, 2)


def shadows(
    s: Surfels,
    positions: NDArray[np.float64],
    geometry: Geometry | None,
    blur: float = 0.0,
    axes: Sequence[int] | NDArray[np.intp] = (0, 1, 2),
) -> tuple[NDArray[np.floating], NDArray[np.floating] | None]:
    """V between every observation and (k, 3) positions: (k, n), and its slope (d, k, n) in m^-1.

    0 or 1 and no slope without ``blur`` in metres; else as `visible_about` says.
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
    """Direct radiance of lights at the observations, B = sum I S of Eq. 4.

    Parameters
    ----------
    q : Observations
        The n observations, whose own radiance is not looked at; or the same as Dr.Jit arrays
        (`lightloc.optics.Surfels`).
    lights : PointLights
        The lights.
    geometry : Geometry, optional
        What occludes; nothing does where None.

    Returns
    -------
    (n, c) array
        B in W sr^-1 m^-2. c is 3 where the lights or the material have three channels; without any
        light it is the lights'. NaN where an intensity that is unknown would be seen.

    Raises
    ------
    ValueError
        If the lights say another unit of length than the observations.

    Examples
    --------
    Two lights of 1 W/sr, 1 m and 2 m above a diffuse surface: albedo / pi (1 + 1/4).

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, PointLights, radiance
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.0], material=Lambert(albedo=0.8))
    >>> B = radiance(q, PointLights([[0, 0, 1], [0, 0, 2]], [1.0, 1.0]))
    >>> (np.pi * B).round(6).tolist()
    [[1.0]]
    """
    if isinstance(q, Observations) and units.is_other(lights.unit, q.unit):
        raise ValueError(
            f"the lights are in {lights.unit} and the observations in {q.unit}; expected one unit "
            "of length (PointLights.in_unit converts)"
        )
    if not len(lights):
        n = q.n if isinstance(q, Surfels) else len(q)
        return np.zeros((n, lights.channels))
    S = shading(q, lights.positions, geometry)
    S = np.broadcast_to(S, (*S.shape[:2], max(S.shape[2], lights.channels)))
    if np.isnan(lights.intensities).any():
        return np.where(S == 0, 0.0, S * lights.intensities).sum(axis=1)
    return np.einsum("nkc,kc->nc", S, lights.intensities)


def check_gradient(
    q: Observations, position: ArrayLike, geometry: Geometry | None = None, step: float = 1e-3
) -> float:
    """Compare `shading_gradient` with central differences at one position.

    Parameters
    ----------
    q : Observations
        The observations.
    position : (3,) array_like
        Position p of a light, in the unit of length.
    geometry : Geometry, optional
        What occludes; nothing does where None.
    step : float
        Half the distance over which differences are taken, in the unit of length.

    Returns
    -------
    float
        The worst disagreement, max abs(gradient - difference) / max abs(difference), over the
        observations that see p and all six shifted positions. The differences are of float32
        values: expect about 1e-7 / step + step^2.

    Raises
    ------
    ValueError
        If the position is not three finite numbers, or no observation sees it and all of the
        shifted positions.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, check_gradient
    >>> floor = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
    >>> up = np.tile([0, 0, 1], (100, 1))
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(100),
    ...                  material=Lambert(albedo=0.5))
    >>> check_gradient(q, [0.2, 0.1, 1.0]) < 1e-3
    True
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
    return float(
        error.max(initial=0.0) / max(np.abs(slope[smooth]).max(initial=0.0), np.finfo(float).tiny)
    )


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
