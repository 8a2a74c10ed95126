"""What a shell may leave us: streams that are closed, lack letters or are cut off by `head`."""

from __future__ import annotations

import io
import logging
import os
import sys
from typing import TextIO

CUT_OFF = 141  # 128 + SIGPIPE, as shells say it


def prepare() -> TextIO:
    """Point a stream that is closed to nothing, and print letters that it lacks as escapes.

    Else the first files to be opened would take the closed one's number, and what libraries print
    would be written into them. Returns the standard output.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # the lowest free number is this one
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    sys.stdin = sys.stdin or os.fdopen(0)
    sys.stdout = sys.stdout or os.fdopen(1, "w")
    sys.stderr = sys.stderr or os.fdopen(2, "w")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a notebook's is none
            stream.reconfigure(errors="backslashreplace")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # a home without a cache is no news
    return sys.stdout


def cut_off() -> int:
    """Print nothing more, for nobody reads it; the exit code that says so."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    return CUT_OFF
