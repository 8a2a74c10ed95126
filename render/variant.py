"""The one place that imports Mitsuba and sets its variant, to match lightloc's backend."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mitsuba as mi

import lightloc.backend as backend  # first: it chooses the LLVM library
from render import rough_diffuse

import drjit as dr  # isort: skip

_REGISTERED: set[str] = set()
"""Variants that know the BSDFs of ours."""

VARIANTS = {backend.LLVM: "llvm_ad_rgb", backend.CUDA: "cuda_ad_rgb"}


def use_mitsuba() -> None:
    """Set the variant, unless it is set already. Raises RuntimeError where it can't run."""
    wanted = VARIANTS[backend.current()]
    if mi.variant() != wanted:
        mi.set_variant(wanted)
        mi.set_log_level(mi.LogLevel.Error)
    if wanted not in _REGISTERED:
        rough_diffuse.register()
        _REGISTERED.add(wanted)


@contextmanager
def two_threads() -> Iterator[None]:
    """Within it, Mitsuba reads and writes EXR files; one thread waits there for ever (3.9.1)."""
    before = dr.thread_count()
    if before >= 2:
        yield
        return
    # sums that were recorded for one thread would be computed by two, each in memory of its own
    dr.eval()
    dr.sync_thread()  # a kernel that still runs must not lose its threads
    dr.set_thread_count(2)
    try:
        yield
    finally:
        dr.sync_thread()
        dr.set_thread_count(before)
