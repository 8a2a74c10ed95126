"""lightloc doctor: what is installed, which LLVM, and a tiny render in a child process."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys

PACKAGES = ("lightloc", "mitsuba", "drjit", "numpy", "scipy", "OpenImageIO")
TINY = """
import render
room = render.load("box_one")
q = render.observe(room, points=16, spp=4, seed=0)
print(f"{q.radiance.mean():.4f}")
"""
CHILD_SECONDS = 120


def versions() -> list[tuple[str, str]]:
    """What is installed, a row each."""
    rows = [("python", platform.python_version()), ("machine", platform.machine())]
    for name in PACKAGES:
        try:
            rows.append((name, importlib.metadata.version(name)))
        except importlib.metadata.PackageNotFoundError:
            rows.append((name, "not installed"))
    return rows


def backend_rows() -> list[tuple[str, str]]:
    """The Dr.Jit backend and the LLVM in use; raises RuntimeError where there is none."""
    from lightloc import backend

    chosen = backend.current()
    version = ".".join(str(part) for part in backend.llvm_version() or ()) or "none"
    return [
        ("Dr.Jit backend", chosen.name),
        ("LLVM", version),
        ("LLVM library", os.environ.get("DRJIT_LIBLLVM_PATH", "the system's")),
    ]


def tiny_render() -> tuple[bool, str]:
    """Whether a real render of 16 probes succeeds in a child process, and what it said."""
    try:
        child = subprocess.run(
            [sys.executable, "-P", "-c", TINY],
            capture_output=True,
            text=True,
            timeout=CHILD_SECONDS,
            check=False,
            cwd="/",  # where no file is called as a standard scene is
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {CHILD_SECONDS} s"
    if child.returncode == 0:
        return True, f"mean radiance {child.stdout.strip()} W/(sr m^2)"
    last = child.stderr.strip().splitlines()[-1:] or ["no message"]
    return False, f"the process ended with {child.returncode}: {last[0]}"
