"""The numbers of a material: checked once, counted in channels, gathered inside kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lightloc.backend import reals, types
from lightloc.checks import array, numbers


class Parameters:
    """Checks and channel count for materials whose fields are numeric parameters."""

    def _check(self, name: str, least: float, most: float | None = None) -> None:
        label = f"{type(self).__name__}.{name}"
        value = numbers(label, getattr(self, name))
        if value.ndim == 0:
            value = value[None, None]
        elif value.shape == (3,):
            value = value[None, :]  # one RGB triple
        elif value.ndim == 1:
            value = value[:, None]  # one per point
        if value.size == 0:
            raise ValueError(f"{label} is empty; expected a scalar or one value per point")
        value = array(label, value, (None, None), least=least, most=most)
        if value.shape[1] not in (1, 3):
            raise ValueError(f"{label} has {value.shape[1]} channels; expected 1 or 3")
        object.__setattr__(self, name, value)

    def parameters(self) -> dict[str, NDArray[np.float64]]:
        """Return the parameters that are set, by name.

        Returns
        -------
        dict of str to array
            Each parameter as a (1 or n, 1 or 3) array.

        Examples
        --------
        >>> from lightloc import Conductor
        >>> {name: value.tolist() for name, value in Conductor(alpha=0.5).parameters().items()}
        {'alpha': [[0.5]], 'specular': [[1.0]]}
        """
        return {
            field.name: value
            for field in fields(self)  # type: ignore[arg-type]
            if isinstance(value := getattr(self, field.name), np.ndarray)
        }

    @property
    def channels(self) -> int:
        """The number of channels: 3 where a parameter has 3, else 1."""
        return max(value.shape[1] for value in self.parameters().values())

    def check_length(self, n: int) -> None:
        """Check that the parameters fit n observations.

        Parameters
        ----------
        n : int
            Number of observations.

        Raises
        ------
        ValueError
            If a parameter has neither 1 row nor n.

        Examples
        --------
        >>> from lightloc import Lambert
        >>> Lambert(albedo=[0.5, 0.6]).check_length(3)
        Traceback (most recent call last):
            ...
        ValueError: Lambert.albedo has 2 rows; expected 1 or 3
        """
        for name, value in self.parameters().items():
            if len(value) not in (1, n):
                raise ValueError(
                    f"{type(self).__name__}.{name} has {len(value)} rows; expected 1 or {n}"
                )


def bind_parameter(value: NDArray[np.floating]) -> Callable[[Any], Any]:
    """A parameter (1 or n, 1 or 3) as a function of the observation's index in a kernel."""
    f = types()
    kind = f.Float if value.shape[1] == 1 else f.Array3f
    columns = kind(*(reals(column) for column in value.T))
    dr.make_opaque(columns)  # a changed value must not compile a new kernel
    if len(value) == 1:
        return lambda i: columns
    return lambda i: (
        dr.gather(kind, columns, i)
        if kind is f.Float
        else kind(*(dr.gather(f.Float, column, i) for column in columns))
    )


def channels_last(value: Any, n: int) -> NDArray[np.float64]:
    """A kernel's Float or Array3f as a NumPy array (n, 1) or (n, 3)."""
    result = np.atleast_2d(np.array(value, dtype=np.float64))
    return np.ascontiguousarray(np.broadcast_to(result, (len(result), n)).T)
