"""A BRDF as a function over NumPy arrays: slower, and no kernel has to be written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.brdf.protocol import Scatter

Evaluate = Callable[
    [NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], ArrayLike
]
"""From indices (m,), normals, l and w, each (m, 3), to f: (m,) or (m, c)."""

ROWS = 1 << 18
"""Most pairs of points and directions that the function is given at once."""

TURN = 1e-5
"""Half the angle over which a derivative's difference is taken: its relative error is 1e-10 for
smooth f, by the curvature and by the rounding of float64 alike."""


@dataclass(frozen=True)
class FromNumPy:
    """A BRDF that is a function over NumPy arrays.

    It is a material as any other, alone or within a `Mixed` or a `Sum`. A search takes about
    ten times as long: kernels stop to call the function, and derivatives are differences of its
    values.

    Parameters
    ----------
    function : callable
        ``function(i, normals, l, w)`` returns the BRDF f in sr^-1, without the cosine, as an (m,)
        or (m, c) array. ``i`` (m,) are the indices of the observations, by which parameters can
        differ from point to point; ``normals``, ``l`` to the light and ``w`` to the viewer are
        (m, 3) arrays of unit vectors, l and w above the surface. Elsewhere f is 0.
    channels : int
        Number of channels of what it returns: 1, or 3 for linear RGB.

    Raises
    ------
    ValueError
        If the function can't be called, or there are neither 1 nor 3 channels; and from whatever
        evaluates it, if what it returns has another shape, is negative or not finite.

    Examples
    --------
    The moon's dust reflects by the law of Lommel and Seeliger:

    >>> import numpy as np
    >>> from lightloc import FromNumPy, Observations, shading
    >>> def dust(i, normals, l, w):
    ...     cos_l, cos_w = (normals * l).sum(axis=1), (normals * w).sum(axis=1)
    ...     return 0.2 / (4 * np.pi * (cos_l + cos_w))
    >>> up = [[0, 0, 1]]
    >>> q = Observations(positions=[[0, 0, 0]], normals=up, directions=up, radiance=[0],
    ...                  material=FromNumPy(dust))
    >>> bool(np.isclose(shading(q, [[0, 0, 2]])[0, 0, 0], 0.2 / (8 * np.pi) / 2**2))
    True
    """

    function: Evaluate
    channels: int = 1

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ValueError(
                f"FromNumPy.function is {self.function!r}; expected a function(i, normals, l, w)"
            )
        if self.channels not in (1, 3):
            raise ValueError(f"FromNumPy.channels is {self.channels!r}; expected 1 or 3")

    def bind(self, n: int) -> Scatter:
        """As of `BRDF`: f (n . l)_+, 0 where light or viewer is below the surface."""

        def scatter(i: Any, normal: Any, l: Any, w: Any) -> Any:
            try:
                return dr.custom(_Call, self, i, normal, l, w)
            except RuntimeError as error:  # Dr.Jit's, around what the function raised
                raise error.__cause__ or error from None

        return scatter


class _Call(dr.CustomOp):  # type: ignore[misc]
    """Leaves a kernel to call the function, and differentiates it in the direction to the light."""

    def eval(self, material: FromNumPy, i: Any, normal: Any, l: Any, w: Any) -> Any:
        self.material, self.kind = material, type(l)
        m = max(dr.width(v) for v in (i, normal, l, w))
        dr.eval(i, normal, l, w)
        self.i = np.broadcast_to(i.numpy(), m).astype(np.intp)
        self.normal, self.l, self.w = (_unit(v, m) for v in (normal, l, w))
        return self.given(values(material, self.i, self.normal, self.l, self.w))

    def given(self, rows: NDArray[np.float64]) -> Any:
        """(1 or 3, m) as the kernel's own arrays."""
        real = dr.value_t(self.kind)
        wide = np.float64 if dr.itemsize_v(real) == 8 else np.float32
        columns = [real(np.ascontiguousarray(row, wide)) for row in rows]
        return columns[0] if len(columns) == 1 else self.kind(*columns)

    def slopes(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Two directions across l, (m, 3), and the derivative (c, m) along each."""
        least = np.eye(3)[np.abs(self.l).argmin(axis=1)]
        one = np.cross(self.l, least)
        one /= np.linalg.norm(one, axis=1, keepdims=True)
        for across in (one, np.cross(self.l, one)):
            ends = [
                values(self.material, self.i, self.normal, _normalized(self.l + h * across), self.w)
                for h in (TURN, -TURN)
            ]
            yield across, (ends[0] - ends[1]) / (2 * TURN)

    def backward(self) -> None:
        out = self.grad_out()
        out = np.atleast_2d(out.numpy()).astype(float)
        total = np.zeros((3, len(self.i)))
        for across, slope in self.slopes():
            total += across.T * (slope * out).sum(axis=0)
        self.set_grad_in("l", self.given(total))

    def name(self) -> str:
        return "FromNumPy"


def values(
    material: FromNumPy,
    i: NDArray[np.intp],
    normals: NDArray[np.float64],
    l: NDArray[np.float64],
    w: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(c, m) f (n . l)_+ in sr^-1."""
    cosine = (normals * l).sum(axis=1)
    lit = np.flatnonzero((cosine > 0) & ((normals * w).sum(axis=1) > 0))
    result = np.zeros((material.channels, len(i)))
    for first in range(0, len(lit), ROWS):
        some = lit[first : first + ROWS]
        f = np.asarray(material.function(i[some], normals[some], l[some], w[some]), float)
        f = f[:, None] if f.ndim == 1 else f
        if f.shape != (len(some), material.channels):
            raise ValueError(
                f"FromNumPy.function gave an array of shape {f.shape}; expected "
                f"({len(some)},) or ({len(some)}, {material.channels})"
            )
        if not (np.isfinite(f) & (f >= 0)).all():
            raise ValueError("FromNumPy.function gave a value that is negative or not finite")
        result[:, some] = (f * cosine[some, None]).T
    return result


def _columns(v: Any) -> NDArray[np.float64]:
    """An Array3f as (m, 3)."""
    return v.numpy().T.astype(float)


def _unit(v: Any, m: int) -> NDArray[np.float64]:
    """The same, each repeated where there is one for all m, and of length 1 in float64."""
    return _normalized(np.broadcast_to(_columns(v), (m, 3)))


def _normalized(v: NDArray[np.float64]) -> NDArray[np.float64]:
    return v / np.linalg.norm(v, axis=1, keepdims=True)
