"""Input is checked once, where it enters; every complaint is one plain sentence."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral, Real

import numpy as np
from numpy.typing import ArrayLike, NDArray


def numbers(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """A float64 copy of ``value``; raises ValueError naming the field where it has none."""
    try:
        if np.iscomplexobj(value):
            raise TypeError  # NumPy would leave out the imaginary part
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is not an array of numbers") from None


def array(
    name: str,
    value: ArrayLike,
    shape: Sequence[int | None],
    least: float | None = None,
    most: float | None = None,
) -> NDArray[np.float64]:
    """Return ``value`` as a read-only float64 array of ``shape`` (None: any length).

    Raises
    ------
    ValueError
        Naming the field, the first offending row and what was expected.

    Examples
    --------
    >>> array("albedo", [0.5, 0.6], (2,)).tolist()
    [0.5, 0.6]
    >>> array("albedo", [0.5, float("nan")], (2,))
    Traceback (most recent call last):
        ...
    ValueError: albedo[1] is nan; expected a finite number
    """
    result = numbers(name, value)
    fits = result.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(result.shape, shape, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("any" if s is None else str(s) for s in shape) + ")"
        raise ValueError(f"{name} has shape {result.shape}; expected {wanted}")
    _refuse(name, result, ~np.isfinite(result), "a finite number")
    if least is not None:
        _refuse(name, result, result < least, f"at least {least:g}")
    if most is not None:
        _refuse(name, result, result > most, f"at most {most:g}")
    result.setflags(write=False)
    return result


def number(
    name: str, value: object, least: float = 0.0, *, above: bool = False, whole: bool = False
) -> None:
    """Refuse a value that is not one number, at least ``least``; infinity is a number.

    Parameters
    ----------
    name
        Of the field, for the sentence.
    value
        To be looked at.
    least
        The least that is taken.
    above
        Whether it must be above that.
    whole
        Whether it must be an integer.

    Raises
    ------
    ValueError
        Names the field and what was expected.

    Examples
    --------
    >>> number("most_lights", 3, 1, whole=True)
    >>> number("most_lights", 0, 1, whole=True)
    Traceback (most recent call last):
        ...
    ValueError: most_lights is 0; expected a whole number of at least 1
    """
    kind = Integral if whole else Real
    fits = isinstance(value, kind) and not isinstance(value, bool)
    if not (fits and (value > least if above else value >= least)):  # type: ignore[operator]
        said = "whole number" if whole else "number"
        bound = f"above {least:g}" if above else f"of at least {least:g}"
        raise ValueError(f"{name} is {value!r}; expected a {said} {bound}")


def unit_vectors(name: str, value: ArrayLike, n: int) -> NDArray[np.float64]:
    """Return (n, 3) ``value`` normalized; raises ValueError where a vector has length zero."""
    vectors = array(name, value, (n, 3))
    most = np.abs(vectors).max(axis=1, initial=1.0)
    if most.max(initial=1.0) > LONG_VECTOR:
        vectors = vectors / most[:, None]
    lengths = np.linalg.norm(vectors, axis=1)
    if (lengths < TINY_VECTOR).any():
        row = int(np.argmax(lengths < TINY_VECTOR))
        raise ValueError(f"{name}[{row}] has length zero; expected a unit vector")
    result = vectors / lengths[:, None]
    result.setflags(write=False)
    return result


def unit_word(name: str, value: object) -> str:
    """The name of a unit of length; raises ValueError naming the field where it is no word."""
    if not isinstance(value, str) or not value.isprintable() or not value.strip():
        raise ValueError(f"{name} is no word; expected the unit of length, as 'm'")
    return value


def check_radiance(name: str, radiance: NDArray[np.floating], error: NDArray[np.floating]) -> None:
    """Refuse a radiance below zero that is said to be exact (error 0), both of one shape.

    Noise, and light that was subtracted, leave radiances below zero: with an error they are data,
    however far below, and cutting them off at zero would bias what is fitted to them. One without
    an error contradicts itself.

    Raises
    ------
    ValueError
        Naming the first such value.

    Examples
    --------
    >>> check_radiance("B", np.array([-0.1, 0.2]), np.array([0.3, 0.0]))
    >>> check_radiance("B", np.array([-0.1, 0.2]), np.array([0.0, 0.0]))
    Traceback (most recent call last):
        ...
    ValueError: B[0] is -0.1; expected at least 0 where it is exact (its error is 0)
    """
    exact = (radiance < 0) & (error == 0)
    _refuse(name, radiance, exact, "at least 0 where it is exact (its error is 0)")


def printable(text: str) -> str:
    """What a file says, as part of a sentence: one line, odd characters as Python writes them.

    Examples
    --------
    >>> print(printable("albedo\\n\\x01"))
    albedo\\n\\x01
    """
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


LONG_VECTOR = 1e150  # above this a direction's square is infinite
TINY_VECTOR = 1e-12  # below this a direction is lost in rounding


def _refuse(name: str, value: NDArray[np.floating], bad: NDArray[np.bool_], expected: str) -> None:
    if bad.any():
        where = np.unravel_index(int(np.argmax(bad)), bad.shape)
        at = "".join(f"[{i}]" for i in where)
        raise ValueError(f"{name}{at} is {value[where]:g}; expected {expected}")
