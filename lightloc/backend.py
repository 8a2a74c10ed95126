"""The one place that chooses the Dr.Jit backend and the LLVM library under it.

Dr.Jit aborts the whole process with libLLVM 15 and 16 and cannot start with 14, so
``DRJIT_LIBLLVM_PATH`` is pointed at the library of the wheel that we depend on *before*
drjit is first imported. A value that the user has set wins, for ``DRJIT_CACHE_DIR`` too, which is
pointed at a temporary folder where the home can't keep Dr.Jit's compiled kernels.
"""

from __future__ import annotations

import atexit
import importlib.metadata
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

OLDEST_LLVM = 17  # the first that selects fminimum / fmaximum on x86_64 (measured)
LLVM_WHEEL = "karellen-llvm-core"
KERNELS = 2**25  # bytes, of a few hundred kernels


def bundled_llvm() -> Path | None:
    """The libLLVM.so that came with our dependencies, or None where no wheel has it."""
    try:
        files = importlib.metadata.files(LLVM_WHEEL) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    for file in files:
        if file.name == "libLLVM.so":
            return Path(str(file.locate())).resolve()
    return None


def _point_to_llvm() -> None:
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    library = bundled_llvm()
    if library is not None:
        if "drjit" in sys.modules:
            raise ImportError(
                "import lightloc (or render) before drjit and mitsuba: "
                "the LLVM library must be chosen before drjit starts"
            )
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)


def _keep_kernels() -> None:
    """Let Dr.Jit keep its kernels for as long as this process lives, where no home takes them.

    Else it says so, in a line of its own for each process, or for each kernel where a disk is full.
    """
    home = os.environ.get("HOME")
    if "DRJIT_CACHE_DIR" in os.environ or (home and _has_room(Path(home, ".drjit"))):
        return
    with suppress(OSError):  # where nothing takes them, it shall say so
        folder = tempfile.mkdtemp(prefix="lightloc-")
        os.environ["DRJIT_CACHE_DIR"] = folder
        atexit.register(shutil.rmtree, folder, ignore_errors=True)


def _has_room(folder: Path) -> bool:
    while not folder.exists():
        folder = folder.parent
    return os.access(folder, os.W_OK) and shutil.disk_usage(folder).free > KERNELS


_point_to_llvm()
_keep_kernels()

import drjit as dr  # noqa: E402  (after the library is chosen)

CUDA, LLVM = dr.JitBackend.CUDA, dr.JitBackend.LLVM


def current() -> dr.JitBackend:
    """The backend that kernels run on: CUDA where ``LIGHTLOC_BACKEND=cuda``, else LLVM.

    Raises RuntimeError, in one sentence, where that backend cannot run.
    """
    wanted = os.environ.get("LIGHTLOC_BACKEND", "llvm")
    if wanted not in ("llvm", "cuda"):
        raise RuntimeError(f"LIGHTLOC_BACKEND is '{wanted}'; expected 'llvm' or 'cuda'")
    if wanted == "cuda":
        if not dr.has_backend(CUDA):
            raise RuntimeError("LIGHTLOC_BACKEND is 'cuda', but no CUDA device was found")
        return CUDA
    version = llvm_version()
    if version is None or version[0] < OLDEST_LLVM:
        found = "none was found" if version is None else f"found {version[0]}"
        raise RuntimeError(
            f"Dr.Jit needs libLLVM {OLDEST_LLVM} or newer, {found} "
            f"(DRJIT_LIBLLVM_PATH={os.environ.get('DRJIT_LIBLLVM_PATH', 'not set')})"
        )
    return LLVM


def llvm_version() -> tuple[int, ...] | None:
    """The version of the libLLVM that Dr.Jit uses; None where it finds none."""
    try:
        version = dr.detail.llvm_version()
    except (RuntimeError, AttributeError):
        return None
    return tuple(version) if version and version[0] > 0 else None


def types() -> Any:
    """The Dr.Jit module with the differentiable array types (Float, Array3f, ...).

    Within `doubles` its reals have 64 bits, at half the speed or less.
    """
    if current() == CUDA:
        import drjit.cuda.ad as module
    else:
        import drjit.llvm.ad as module
    return _of_64_bits(module) if _DOUBLE.get() else module


def reals(values: Any) -> Any:
    """An array of the reals that `types` has now."""
    kind = np.float64 if _DOUBLE.get() else np.float32
    return types().Float(np.ascontiguousarray(values, kind))


@contextmanager
def doubles(wanted: bool = True) -> Iterator[None]:
    """Let `types` have reals of 64 bits, for kernels whose rounding must not be seen."""
    before = _DOUBLE.set(wanted)
    try:
        yield
    finally:
        _DOUBLE.reset(before)


_DOUBLE: ContextVar[bool] = ContextVar("double", default=False)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS compute on the thread that calls it.

    A search multiplies many small matrices. Threads that are woken for each wait for cores that
    others hold: 48 products of 1024 x 44 took 0.03 s on an idle machine and 6.8 s beside two busy
    processes.
    """
    with _SEARCHES.turn:
        if not _SEARCHES.running:
            _SEARCHES.limit = _blas().limit(limits=1, user_api="blas")
        _SEARCHES.running += 1
    try:
        yield
    finally:
        with _SEARCHES.turn:
            _SEARCHES.running -= 1
            if not _SEARCHES.running:
                _SEARCHES.limit.restore_original_limits()


class _Searches:
    """How many threads search: the first limits BLAS, the last lets it go."""

    turn = threading.Lock()
    running = 0
    limit: Any = None


_SEARCHES = _Searches()


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


@cache
def _of_64_bits(module: Any) -> Any:
    names = {name: getattr(module, name) for name in ("UInt32", "Int32", "Bool", "PCG32")}
    return SimpleNamespace(Float=module.Float64, Array3f=module.Array3f64, **names)
