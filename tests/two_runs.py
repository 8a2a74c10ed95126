"""Whether `lightloc diff` finds what was injected into a rendered run, and nothing else.

Runs of the quick suite, each with noise of its own and held against the one before: in the later a
light is moved, one that was off in the former no longer is, and one search takes ten times as
long. From the repository's folder: ``python tests/two_runs.py 50`` (ten minutes).
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from copy import deepcopy
from multiprocessing import get_context
from pathlib import Path

from validation.diff import Kind, changes
from validation.records import Result
from validation.suite import read_suite, run_case

NOISE = 0.01
PROCESSES = 2
WIDE = {"position_percent": 5.0, "intensity_percent": 50.0}  # limits that such noise keeps
FAR = 20.0  # of its standard errors, how far a light is moved
SLOWER = 10.0  # the time of one case differs by a third between runs of other data
INJECTED = [("five", Kind.WORSE), ("mixed", Kind.SLOWER), ("three", Kind.BETTER)]


def a_run(seed: int) -> list[Result]:
    """The quick suite, rendered and solved with that noise."""
    _, rows = read_suite("quick")
    results = []
    for row in rows:
        case = row.model_copy(update={"seed": seed, "noise": NOISE, **WIDE})
        with tempfile.TemporaryDirectory() as folder:
            results.append(Result.model_validate(run_case(case, Path(folder), "")))
    return results


def moved(run: Sequence[Result], name: str) -> None:
    """Put the first found light of a case off, by `FAR` of its errors along x."""
    light = next(one for one in run if one.name == name).lights.found[0]
    light.position[0] += FAR * light.position_error[0]


def named(before: Sequence[Result], after: Sequence[Result]) -> list[tuple[str, Kind]]:
    """What the diff of two such runs names, once something was injected into copies of them."""
    before, after = deepcopy(before), deepcopy(after)
    moved(after, "five")
    moved(before, "three")
    slow = next(one for one in after if one.name == "mixed")
    slow.seconds["localize"] *= SLOWER
    return [(one.case, one.kind) for one in changes(before, after).changes]


def main(repetitions: int) -> int:
    """Print each repetition that named anything else; how many did.

    Each run is held against the one before it, so that it is new noise in every repetition. Each
    process's first run is left out: it compiles kernels.
    """
    wrong = 0
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as pool:
        runs = pool.map(a_run, range(repetitions + 1 + PROCESSES))
        before = [next(runs) for _ in range(PROCESSES + 1)][-1]
        for i, after in enumerate(runs):
            found = named(before, after)
            if found != INJECTED:
                wrong += 1
                print(i, found, flush=True)
            before = after
    print(f"{repetitions - wrong} of {repetitions} named what was injected, and nothing else")
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)))
