"""Give thousands of odd inputs to all that reads input; count what comes out.

``python tests/fuzz/run.py --inputs 5000 --seed 0``; exit code 1 where there is a fault. Faulty
inputs are kept, each with the command that repeats it.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # as a script it has its own alone

from fuzz.inputs import Input
from fuzz.kinds import KINDS, shares, some
from fuzz.watch import Child, Outcome

PARSER = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
PARSER.add_argument("--inputs", type=int, default=5000, help="how many in all")
PARSER.add_argument("--seed", type=int, default=0, help="the same seed, the same inputs")
PARSER.add_argument("--kind", action="append", help=f"only this one: {', '.join(KINDS)}")
PARSER.add_argument("--keep", type=Path, default=Path("report/fuzz"), help="for faulty inputs")
PARSER.add_argument("--again", type=Path, metavar="FOLDER", help="repeat one that was kept")


def judged(inputs: list[Input], child: Child, keep: Path | None = None) -> Iterator[Outcome]:
    """What becomes of each; the faulty ones stay in ``keep``, by their number."""
    for number, one in enumerate(inputs):
        with tempfile.TemporaryDirectory() as folder:
            here = one.write(Path(folder) / "input")
            outcome = child.ask(here)
        if outcome.is_fault and keep is not None:
            there = keep / f"{number:05d}"
            shutil.rmtree(there, ignore_errors=True)
            one.write(there)
            command = f"python tests/fuzz/run.py --again {there}"
            (there / "fault.txt").write_text(f"{outcome.what}\n{command}\n\n{outcome.said}\n")
        yield outcome


def main() -> int:
    """Print a table; 1 where there is a fault."""
    asked = PARSER.parse_args()
    child = Child()
    if asked.again:
        outcome = next(judged([Input.read(asked.again)], child))
        child.end()
        print(outcome.what, outcome.said, sep="\n")
        return int(outcome.is_fault)
    started, faults, total = time.perf_counter(), Counter(), Counter()
    print(f"{'':24}{'inputs':>8}{'loaded':>8}{'refused':>8}{'faults':>8}{'slowest':>9}")
    for kind, count in shares(asked.inputs).items():
        if asked.kind and kind not in asked.kind:
            continue
        inputs = some(kind, count, asked.seed)
        keep = asked.keep / kind.replace(" ", "-")
        outcomes = list(judged(inputs, child, keep))
        what = Counter("fault" if one.is_fault else one.what for one in outcomes)
        slowest = max((one.seconds for one in outcomes), default=0)
        counts = "".join(f"{what[name]:8}" for name in ("loaded", "refused", "fault"))
        print(f"{kind:24}{len(outcomes):8}{counts}{slowest:7.1f} s", flush=True)
        faults.update(f"{kind}: {one.what}" for one in outcomes if one.is_fault)
        total.update(inputs=len(outcomes), **what)
    child.end()
    counts = "".join(f"{total[name]:8}" for name in ("inputs", "loaded", "refused", "fault"))
    print(f"{'all':24}{counts}   in {time.perf_counter() - started:.0f} s")
    for said, count in faults.most_common():
        print(f"{count:6}  {said}")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
