"""What changed between two runs of the same cases: first what got worse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.stats import norm

from validation.diff.lights import moved
from validation.records import Result

ALPHA = 1e-3
"""Probability that anything is named, by lights or by times, where nothing changed."""

FEW = 5
"""Cases, from which on the spread of their times tells what chance does."""

SPREAD, OTHER = 0.1, 0.3
"""Of a time, at least: how much two runs of the same work differ, and two of other data, which
take other work."""

JITTER = 0.1
"""Seconds by which a run differs from the next beside that, however short it is."""

DRAWN = ("scene", "seed", "noise", "points", "spp", "transport", "parameters")
"""What data are drawn by: with others an answer may be surer or less so by chance."""

BAD = ("failed", "crashed")


class Kind(Enum):
    """What sort of change it is, the ones that matter most first; the value is a heading."""

    FAILS = "Fail now"
    WORSE = "Worse"
    SLOWER = "Slower"
    ANSWER = "Another answer"
    HOLDS = "Hold now"
    BETTER = "Better"
    FASTER = "Faster"
    GONE = "Only in the first run"
    NEW = "Only in the second run"

    @property
    def is_bad(self) -> bool:
        """Whether something got worse. A time is told and decides nothing: machines are busy."""
        return self in (Kind.FAILS, Kind.WORSE, Kind.GONE)


@dataclass(frozen=True)
class Change:
    """A change of one case.

    Parameters
    ----------
    case
        Its name.
    kind
        What sort of change.
    said
        What changed, as a user reads it.
    p
        The probability of as much by chance, in all the run; None of what no chance changes.
    """

    case: str
    kind: Kind
    said: str
    p: float | None = None


@dataclass(frozen=True)
class Changes:
    """All that changed.

    Parameters
    ----------
    changes
        What, in the order of `Kind`.
    cases
        How many cases both runs have.
    """

    changes: tuple[Change, ...]
    cases: int

    @property
    def bad(self) -> int:
        """How many of them are for the worse."""
        return sum(one.kind.is_bad for one in self.changes)

    def of(self, kind: Kind) -> list[Change]:
        """Those of one kind."""
        return [one for one in self.changes if one.kind is kind]


def changes(before: Sequence[Result], after: Sequence[Result]) -> Changes:
    """What changed between two runs, by the names of their cases.

    An outcome and a number of lights are compared as they are, a reason too where both runs had the
    same data, and else whether the answer explains them. Values are by their
    standard errors, times by their jitter and the spread of all cases' times, once all of them
    together are slower or faster by a common factor: each test is charged for all cases
    (Bonferroni).
    """
    old, new = ({one.name: one for one in run} for run in (before, after))
    both = [name for name in old if name in new]
    found = [Change(name, Kind.GONE, "it is not in the second run") for name in old.keys() - new]
    found += [Change(name, Kind.NEW, "it is not in the first run") for name in new.keys() - old]
    for name in both:
        found += outcome(old[name], new[name])
    found += lights({name: (old[name], new[name]) for name in both})
    found += times({name: (old[name], new[name]) for name in both})
    order = list(Kind)
    found.sort(key=lambda one: (order.index(one.kind), one.case))
    return Changes(tuple(found), len(both))


def outcome(old: Result, new: Result) -> list[Change]:
    """Whether a case fails or holds now, or has another answer."""
    if (old.outcome in BAD) != (new.outcome in BAD):
        if new.outcome in BAD:
            return [Change(new.name, Kind.FAILS, " ".join(new.why) or new.outcome)]
        return [Change(new.name, Kind.HOLDS, f"before: {' '.join(old.why) or old.outcome}")]
    if old.comparison is None or new.comparison is None:
        return []
    counts = old.comparison.count_found, new.comparison.count_found
    if counts[0] != counts[1]:
        right = new.comparison.count_true
        said = f"{counts[0]} lights, now {counts[1]} of {right}"
        nearer = abs(counts[1] - right) < abs(counts[0] - right)
        return [Change(new.name, Kind.BETTER if nearer else Kind.WORSE, said)]
    missed = len(old.comparison.missed), len(new.comparison.missed)
    if missed[0] != missed[1]:
        kind = Kind.WORSE if missed[1] > missed[0] else Kind.BETTER
        return [
            Change(new.name, kind, f"{missed[0]} true lights without a found one, now {missed[1]}")
        ]
    reasons = [one.search.reason if one.search else "" for one in (old, new)]
    said = f"{reasons[0]}, now {reasons[1]}"
    if new.is_unexplained and not old.is_unexplained:
        return [Change(new.name, Kind.WORSE, said)]
    if reasons[0] != reasons[1] and saw_the_same(old, new):
        return [Change(new.name, Kind.ANSWER, said)]
    return []


def saw_the_same(old: Result, new: Result) -> bool:
    """Whether both were given the same data."""
    return all(getattr(old, one) == getattr(new, one) for one in DRAWN)


def lights(both: Mapping[str, tuple[Result, Result]]) -> list[Change]:
    """Lights that moved by more than their errors allow."""
    blind = [
        change
        for name, (old, new) in both.items()
        if not (states_errors(old) and states_errors(new))
        for change in by_limit(name, old, new)
    ]
    judged = {
        name: far
        for name, (old, new) in both.items()
        if old.lights and new.lights and old.comparison and new.comparison
        for far in [moved(old, new)]
        if far
    }
    every = sum(far.values for far in judged.values())
    return blind + [
        Change(
            name,
            Kind.BETTER if far.nearer else Kind.WORSE,
            f"the {far.what} of light {far.light} changed by {far.z:.3g} standard errors and is "
            f"{'nearer to' if far.nearer else 'farther from'} the truth",
            far.p(every),
        )
        for name, far in judged.items()
        if far.p(every) < ALPHA / 2
    ]


def states_errors(result: Result) -> bool:
    """Whether an answer says how well it knows any of its positions."""
    found = result.lights.found if result.lights else []
    return any(error is not None for light in found for error in light.position_error)


def by_limit(name: str, old: Result, new: Result) -> list[Change]:
    """Positions that changed by more than the limit, where no error says what chance does."""
    worst = [one.comparison.worst_position_percent for one in (old, new) if one.comparison]
    limit = new.limits.position_percent if new.limits else None
    if len(worst) < 2 or limit is None or worst[0] is None or worst[1] is None:
        return []
    if abs(worst[1] - worst[0]) <= limit:
        return []
    said = (
        f"the worst position was off by {worst[0]:.3g} % of the diagonal, now by {worst[1]:.3g} %, "
        f"with a limit of {limit:g} %; no error is stated"
    )
    return [Change(name, Kind.WORSE if worst[1] > worst[0] else Kind.BETTER, said)]


def times(both: Mapping[str, tuple[Result, Result]]) -> list[Change]:
    """Searches that became slower or faster than all of them together did."""
    took = {
        name: (a, b)
        for name, (old, new) in both.items()
        for a, b in [(old.seconds.get("localize"), new.seconds.get("localize"))]
        if a and b
    }
    if len(took) < FEW:
        return []
    seconds = np.array(list(took.values()))
    ratios = np.log(seconds[:, 1] / seconds[:, 0])
    common = float(np.median(ratios))
    spread = np.array([SPREAD if saw_the_same(*both[name]) else OTHER for name in took])
    z = (ratios - common) / np.hypot(spread, JITTER * np.hypot(*(1 / seconds.T)))
    z /= max(1.0, 1.4826 * float(np.median(np.abs(z))))
    result = []
    for (name, (a, b)), far in zip(took.items(), z, strict=True):
        p = float(min(1.0, 2 * norm.sf(abs(far)) * len(took)))
        if p < ALPHA / 2:
            kind = Kind.SLOWER if far > 0 else Kind.FASTER
            others = f"; all cases together: x {np.exp(common):.2f}"
            result.append(Change(name, kind, f"{a:.2f} s, now {b:.2f} s{others}", p))
    return result
