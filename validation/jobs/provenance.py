"""When, where and with what a result was made."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

PACKAGES = ("lightloc", "mitsuba", "drjit", "numpy", "scipy")


def made() -> dict[str, Any]:
    """The date, the commit where there is one, the versions, and how many CPUs there are.

    Examples
    --------
    >>> sorted(made())
    ['commit', 'cpus', 'date', 'machine', 'versions']
    """
    versions = {name: importlib.metadata.version(name) for name in PACKAGES}
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "versions": {**versions, "python": platform.python_version()},
        "machine": platform.machine(),
        "cpus": os.cpu_count(),
    }


def commit() -> str | None:
    """The commit of this very file, with ``-dirty`` where files differ from it; else None.

    An installed copy may lie inside somebody else's repository, whose commit says nothing of it.
    """
    here = Path(__file__).resolve()
    tracked = _git(here.parent, "ls-files", "--error-unmatch", "__init__.py")
    return _git(here.parent, "describe", "--always", "--dirty") if tracked else None


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return done.stdout.strip() or None if done.returncode == 0 else None
