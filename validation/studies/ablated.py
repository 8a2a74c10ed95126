"""The scenes of the ablation: a change of the search and a room of the hard set, both by name."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from validation.studies import hard
from validation.studies.hard_scenes import hard as judged
from validation.studies.scenes import numbered, parts
from validation.studies.trial import Trial

LONG = ("lights-17", "lights-20")  # rows that take half of the hard set's time


@dataclass(frozen=True)
class Change:
    """One part of the search switched off, or one of its constants set to another value.

    Parameters
    ----------
    label
        As a reader meets it.
    where
        Module of lightloc and name in it.
    value
        What stands there instead.
    """

    label: str
    where: tuple[str, str]
    value: Any


def off(ladder: Any) -> Any:
    """A climb that does nothing."""
    return ladder


def kept(ladder: Any, whole: Any) -> Any:
    """Exact data without exchanges."""
    return ladder, whole


def unchanged(problem: Any, fit: Any, criterion: Any) -> Any:
    """A polish that drops nothing."""
    return fit


def same(whole: Any, fit: Any, ladder: Any) -> Any:
    """A last word that adds nothing."""
    return fit


CHANGES = {
    "climb-off": Change("no climb", ("localize", "climbed"), off),
    "exchanges-off": Change("no exchanges in exact data", ("localize", "emptied"), kept),
    "pruning-off": Change("nothing is dropped or joined", ("search.settle", "pruned"), unchanged),
    "completing-off": Change(
        "nothing is added over all data", ("search.settle", "completed"), same
    ),
    "alone-off": Change("places not refined alone", ("search.births", "STEPS"), 0),
    "error-half": Change("the climb's errors halved", ("search.climb", "STAGE"), (0.01, 0.005)),
    "error-double": Change("the climb's errors doubled", ("search.climb", "STAGE"), (0.04, 0.005)),
    "blur-half": Change(
        "the climb's shadows half as soft", ("search.climb", "STAGE"), (0.02, 0.0025)
    ),
    "blur-double": Change(
        "the climb's shadows twice as soft", ("search.climb", "STAGE"), (0.02, 0.01)
    ),
    "narrowing-off": Change("errors not narrowed", ("search.climb", "NARROWED"), 1.0),
    "candidates-2": Change("candidates halved", ("search.climb", "CANDIDATES"), 2),
    "candidates-8": Change("candidates doubled", ("search.climb", "CANDIDATES"), 8),
    "front-1": Change("one hypothesis refined to its end", ("search.climb", "FRONT"), 1),
    "front-6": Change("hypotheses refined to their end doubled", ("search.climb", "FRONT"), 6),
    "patience-half": Change("lights added in vain halved", ("search.climb", "PATIENCE"), (1, 2)),
    "patience-double": Change("lights added in vain doubled", ("search.climb", "PATIENCE"), (4, 8)),
    "margin-ten": Change("margin to the walls ten times as wide", ("fit.batched", "MARGIN"), 1e-2),
    "margin-off": Change("no margin to the walls", ("fit.batched", "MARGIN"), 1e-6),
    "damping-low": Change("damping begins low", ("search.climb", "FIRST_DAMPING"), 1e-2),
    "reuse-off": Change("shadows never kept", ("fit.batched", "REUSED"), 0.0),
    "reuse-double": Change("shadows kept twice as far", ("fit.batched", "REUSED"), 1.0),
    "few-off": Change("no residual may lie anywhere", ("fit.criterion", "FEW"), 0.0),
}


@dataclass(frozen=True)
class Ablated:
    """A room, with the search as it is and with a change.

    Parameters
    ----------
    name
        The change's row and the room's number.
    solved, as_is
        Whether it is solved with the change, and without it.
    seconds, seconds_as_is
        Of the search.
    """

    name: str
    solved: bool
    as_is: bool
    seconds: float
    seconds_as_is: float


def rooms() -> list[str]:
    """The hard set without its longest rows, so that a few of them are of every row."""
    some = [name for name in hard.names(hard.STUDY.per_row) if not name.startswith(LONG)]
    return sorted(some, key=lambda name: (name[-3:], name))


def names(per_row: int) -> list[str]:
    """Scenes: a change, and the number of a room.

    Examples
    --------
    >>> names(2)[:2]
    ['climb-off-000', 'climb-off-001']
    """
    return numbered(list(CHANGES), min(per_row, len(rooms())))


@contextmanager
def made(change: Change) -> Iterator[None]:
    """The search with a change in it."""
    module = importlib.import_module(f"lightloc.{change.where[0]}")
    before = getattr(module, change.where[1])
    setattr(module, change.where[1], change.value)
    try:
        yield
    finally:
        setattr(module, change.where[1], before)


def ablated(name: str) -> Ablated:
    """One room with the search as it is, then with a change, in one process."""
    words, number = parts(name)
    room = rooms()[number]
    as_is: Trial = judged(room)
    with made(CHANGES["-".join(words)]):
        changed: Trial = judged(room)
    return Ablated(name, changed.solved, as_is.solved, changed.seconds, as_is.seconds)
