"""How long a search may take: whatever begins something anew asks first whether it is over.

A search is stopped nowhere: its loops end early, with the best that they have.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class OutOfTimeError(Exception):
    """Raised by `in_time` where what was begun is of no use unless it ends."""


@contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """Let all that is begun in it end by then; by an earlier deadline too, if one holds."""
    end = math.inf if seconds is None else time.monotonic() + seconds
    before = _END.set(min(end, _END.get()))
    try:
        yield
    finally:
        _END.reset(before)


def left() -> float:
    """Seconds until then; infinite where there is no deadline."""
    return _END.get() - time.monotonic()


def is_over() -> bool:
    """Whether nothing more is to be begun.

    Examples
    --------
    >>> with within(0.0):
    ...     is_over()
    True
    >>> is_over()
    False
    """
    return left() <= 0


def in_time() -> None:
    """Raise OutOfTimeError where it is over."""
    if is_over():
        raise OutOfTimeError


_END: ContextVar[float] = ContextVar("end", default=math.inf)
