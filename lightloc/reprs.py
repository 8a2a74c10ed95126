"""What values show of themselves in a console: numbers where they are few, else shapes."""

from __future__ import annotations

from dataclasses import fields
from enum import Enum
from typing import Any

import numpy as np

FEW = 12
"""Numbers of an array, at most, that are shown."""


def short(value: Any) -> str:
    """A dataclass with its large arrays as their shapes; it stands in for ``__repr__``.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(eq=False)
    ... class Two:
    ...     a: np.ndarray
    ...     b: np.ndarray
    ...     __repr__ = short
    >>> Two(np.eye(2) / 3, np.zeros((500, 3)))
    Two(a=[[0.333333, 0], [0, 0.333333]], b=<500 x 3>)
    """
    parts = [f"{f.name}={_shown(getattr(value, f.name))}" for f in fields(value) if f.repr]
    return f"{type(value).__name__}({', '.join(parts)})"


def _shown(value: Any) -> str:
    if isinstance(value, Enum):
        return value.name
    if not isinstance(value, np.ndarray):
        return repr(value)
    if value.size > FEW:
        return f"<{' x '.join(map(str, value.shape))}>"
    return _listed(value)


def _listed(value: Any) -> str:
    if np.ndim(value):
        return f"[{', '.join(map(_listed, value))}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
