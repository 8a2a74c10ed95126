"""What the commands share: options, outputs checked before any work, errors said."""

from __future__ import annotations

import json
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from validation.jobs import finite, is_output, is_stream

if TYPE_CHECKING:
    from lightloc import Observations, PointLights

Said = TypeVar("Said", "Observations", "PointLights")

SET = Annotated[
    list[str], typer.Option("--set", help="A value for a scene parameter, as alpha=0.2.")
]

FIND = Annotated[
    list[str],
    typer.Option(
        help="Id of a point light that is to be found, the others being known light; all of them "
        "where it is not given."
    ),
]

JSON = Annotated[bool, typer.Option("--json", help="Print what came out as JSON.")]

QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]

UNIT = Annotated[str | None, typer.Option(help="The unit of length, as cm, where no file says it.")]

SEED = Annotated[int, typer.Option(min=0, help="Random seed: the same seed, the same output.")]


def parameters(settings: list[str]) -> dict[str, str]:
    """Scene parameters from ``NAME=VALUE`` settings.

    Examples
    --------
    >>> parameters(["alpha=0.2"])
    {'alpha': '0.2'}
    """
    for setting in settings:
        if not all(setting.partition("=")):
            raise ValueError(f"--set {setting}: expected NAME=VALUE, as alpha=0.2")
    return dict(setting.split("=", 1) for setting in settings)


def in_the_unit(said: Said, unit: str | None, file: str | Path) -> Said:
    """What was read from a file, in the unit that ``--unit`` says where the file says none."""
    from lightloc import units

    if unit is None or said.unit == unit:
        return said
    if said.unit != units.UNKNOWN:
        raise ValueError(f"--unit {unit}: {file} says that its lengths are in {said.unit}")
    return replace(said, unit=unit)


def writable(*paths: Path | None) -> None:
    """Refuse an output that can't be written before any work is done."""
    for path in paths:
        if path is None:
            continue
        if path.is_dir():
            raise ValueError(f"{path}: is a folder; expected a file to write")
        if is_stream(path):
            good = os.access(path, os.W_OK) or is_output(path)
        else:
            good = _may_appear(Path(os.path.realpath(path)))
        if not good:
            raise ValueError(f"{path}: can't be written there")


def _may_appear(path: Path) -> bool:
    """Whether a file may be written or replaced, with folders above it that are not there yet."""
    if path.exists() and not os.access(path, os.W_OK):
        return False
    parent = path.parent
    while not parent.exists():
        parent = parent.parent
    return parent.is_dir() and os.access(parent, os.W_OK)


def say(what: object, *outputs: Path | None) -> None:
    """Print, but not into an output that is the standard output."""
    mixed = any(output and is_output(output) for output in outputs)
    print(what, file=sys.stderr if mixed else sys.stdout)


def tell(text: object, values: object, as_json: bool, quiet: bool, *outputs: Path | None) -> None:
    """Say what came out: as text, as JSON of plain values, or not at all."""
    if not quiet:
        say(json.dumps(finite(values), indent=1, ensure_ascii=False) if as_json else text, *outputs)


LONGEST = 80  # letters of a word that typer repeats


def sentence(error: Exception) -> str | None:
    """What to say of an error on one line; None of one that is no user's doing."""
    if hasattr(error, "format_message"):  # typer's, of an option or a command
        text = re.sub(rf"(\S{{{LONGEST}}})\S+", r"\1...", error.format_message())
    elif isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    elif isinstance(error, (ValueError, RuntimeError, OSError, ImportError, MemoryError)):
        text = str(error)
    else:
        return None
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))
