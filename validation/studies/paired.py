"""Two runs of the same scenes, paired: what either solves alone, and their seconds."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.jobs import FILE, Ended, every, row_of
from validation.studies.measures import NOTHING, Fields
from validation.studies.study import EVERY

if TYPE_CHECKING:
    from rich.table import Table

LEVEL = 0.05  # p below which as many lost rooms do not come by chance
TITLES = ("rooms", "old", "new", "only old", "only new", "p", "medians", "median ratio")


@dataclass(frozen=True)
class Pair:
    """One room in both runs. A scene that crashed is not solved, and its seconds are None."""

    name: str
    row: str
    old: bool
    new: bool
    old_seconds: float | None
    new_seconds: float | None
    said: str  # of the new run: why it stopped, with how many lights


@dataclass(frozen=True)
class Counts:
    """A row: so many rooms, solved by either run and by one of them alone, and ratios new to old.

    ``p`` is the chance of a split of the discordant pairs at least as uneven as this one; ``ratio``
    is of the median seconds, ``each`` the median of every room's own ratio.
    """

    rooms: int
    old: int
    new: int
    lost: int
    won: int
    p: float
    ratio: float | None
    each: float | None

    @property
    def significantly_lost(self) -> bool:
        return self.lost > self.won and self.p < LEVEL


def sign_test(lost: int, won: int) -> float:
    """The exact two-sided p of McNemar's test: of all discordant pairs, half go either way.

    Examples
    --------
    >>> sign_test(6, 0), sign_test(3, 3), sign_test(0, 0)
    (0.03125, 1.0, 1.0)
    """
    pairs = lost + won
    tail = sum(math.comb(pairs, k) for k in range(min(lost, won) + 1))
    return min(1.0, 2 * tail / 2**pairs)


def count(pairs: Sequence[Pair]) -> Counts:
    """The figures of a row of pairs."""
    lost = sum(pair.old and not pair.new for pair in pairs)
    won = sum(pair.new and not pair.old for pair in pairs)
    timed = [
        (pair.old_seconds, pair.new_seconds)
        for pair in pairs
        if pair.old_seconds and pair.new_seconds is not None
    ]
    ratio = each = None
    if timed:
        old, new = map(statistics.median, zip(*timed, strict=True))
        ratio, each = new / old, statistics.median(b / a for a, b in timed)
    return Counts(
        rooms=len(pairs),
        old=sum(pair.old for pair in pairs),
        new=sum(pair.new for pair in pairs),
        lost=lost,
        won=won,
        p=sign_test(lost, won),
        ratio=ratio,
        each=each,
    )


def paired(old: Path, new: Path) -> tuple[list[Pair], int]:
    """The rooms that ended in both folders, and how many ended in one of them only.

    They are matched by the study's folder and by the room's name.

    Raises ValueError where a folder holds no scenes, or both have none in common.
    """
    before, after = _scenes(old), _scenes(new)
    both = [name for name in before if name in after]
    if not both:
        raise ValueError(f"{new}: has no scene in common with {old}")
    pairs = [_pair("/".join(filter(None, name)), before[name], after[name]) for name in both]
    return pairs, len(before.keys() ^ after.keys())


def _scenes(root: Path) -> dict[tuple[str, str], Ended]:
    """Of every study below a folder, the scenes that say whether they were solved."""
    if not root.is_dir():
        raise ValueError(f"{root}: no such folder")
    found = {}
    for file in sorted(root.rglob(FILE)):
        study = file.parent.relative_to(root)
        for ended in every(file.parent):
            if ended.record is None or "solved" in ended.record:
                found[study.as_posix() if study.name else "", ended.name] = ended
    if not found:
        raise ValueError(f"{root}: holds no {FILE} with scenes that are solved or not")
    return found


def _pair(name: str, old: Ended, new: Ended) -> Pair:
    return Pair(
        name=name,
        row=row_of(name),
        old=_solved(old),
        new=_solved(new),
        old_seconds=_of_search(old.record, "seconds"),
        new_seconds=_of_search(new.record, "seconds"),
        said=_said(new),
    )


def _of_search(record: Fields | None, field: str) -> Any:
    """A field of the search's own: Table 1 keeps it beside that of the paper's algorithm."""
    return record.get(f"ours_{field}", record.get(field)) if record else None


def _solved(ended: Ended) -> bool:
    return bool(_of_search(ended.record, "solved"))


def _said(ended: Ended) -> str:
    if ended.record is None:
        return f"crashed: {ended.error}"
    reason, found = (_of_search(ended.record, field) for field in ("reason", "found"))
    lights = f"{found} of {ended.record.get('lights')} lights"
    return f"{reason}, {lights}" if reason else lights


def show(pairs: Sequence[Pair]) -> Table:
    """The figures by row, and of all rooms."""
    from rich.table import Table

    rows: dict[str, list[Pair]] = {}
    for pair in pairs:
        rows.setdefault(pair.row, []).append(pair)
    drawn = Table()
    drawn.add_column("", no_wrap=True)
    for title in TITLES:
        drawn.add_column(title, justify="right")
    for row, some in [*rows.items(), (EVERY, pairs)]:
        drawn.add_row(row, *_cells(count(some)))
    return drawn


def _cells(row: Counts) -> list[str]:
    whole = (row.rooms, row.old, row.new, row.lost, row.won)
    ratios = (NOTHING if ratio is None else f"{ratio:.2f}" for ratio in (row.ratio, row.each))
    return [*map(str, whole), f"{row.p:.2g}", *ratios]
