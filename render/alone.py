"""One thread at a time: Mitsuba's scenes and the classes of them that Dr.Jit lists are shared."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

_TURN = threading.RLock()


def _forked() -> None:
    """The thread that had its turn is not in the child, which would wait for it for ever."""
    global _TURN
    _TURN = threading.RLock()


os.register_at_fork(after_in_child=_forked)


def alone(function: Callable[P, T]) -> Callable[P, T]:
    """The function, which waits while another thread is in one of these.

    Whatever looks at a scene goes through every surface and BSDF there is, also those of a scene
    that another thread is only building; and the folder that Mitsuba reads from is one for all.
    """

    @wraps(function)
    def turn(*args: P.args, **kwargs: P.kwargs) -> T:
        with _TURN:
            return function(*args, **kwargs)

    return turn
