"""The one place that imports Mitsuba and sets its variant, to match lightloc's backend."""

from __future__ import annotations

import mitsuba as mi

import lightloc.backend as backend  # first: it chooses the LLVM library

VARIANTS = {backend.LLVM: "llvm_ad_rgb", backend.CUDA: "cuda_ad_rgb"}


def use_mitsuba() -> None:
    """Set the variant, unless it is set already. Raises RuntimeError where it can't run."""
    wanted = VARIANTS[backend.current()]
    if mi.variant() != wanted:
        mi.set_variant(wanted)
        mi.set_log_level(mi.LogLevel.Error)
