"""Break our own code on purpose, one small mistake at a time: each must fail the test it names.

`mutants.toml` lists mistakes that people really make, each with the cheapest test that notices it.
They are made in temporary copies of the project; the checkout itself is only read.

Exit code 0: all were killed; 1: one survived; 2: the list is wrong, a test fails without a mutant,
or one could not run: what can't be imported, or never ends, proves nothing of a test.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "CONTRIBUTING.md", "docs")
COPIED = ("lightloc", "render", "validation", "scenes", "tests", "pyproject.toml", *PAGES)
LONGEST = 300  # seconds a test
PYTEST = ("-m", "pytest", "-x", "-q", "-p", "no:cacheprovider")
KILLED, SURVIVED, NEITHER = "killed", "SURVIVED", "could not run"
PARSER = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
PARSER.add_argument("names", nargs="*", metavar="NAME", help="mutants; all where none is named")
PARSER.add_argument("--jobs", type=int, default=1, help="so many at a time")
PARSER.add_argument("--list", action="store_true", help="print the mutants and stop")


class Mutant(NamedTuple):
    """A mistake: ``before``, which stands once in ``file``, replaced, and the test that fails."""

    name: str
    file: str
    before: str
    after: str
    test: str
    why: str

    def broken(self, copy: Path) -> tuple[Path, str, str]:
        """The file in a copy of the project, what it holds, and what it is to hold."""
        path = (copy / self.file).resolve()
        whole = path.read_text() if path.is_relative_to(copy) and path.is_file() else ""
        if whole.count(self.before) != 1 or self.before == self.after:
            PARSER.error(f"{self.name}: its snippet does not stand once in {self.file}, or stays")
        return path, whole, whole.replace(self.before, self.after)


def copied(to: Path) -> Path:
    """A copy of what tests need; nothing in it leads back to the checkout."""
    for part in (ROOT / name for name in COPIED):
        (shutil.copytree if part.is_dir() else shutil.copy)(part, to / part.name)
    return to.resolve()


def python(copy: Path, *arguments: str, limit: float = LONGEST) -> tuple[int, str]:
    """Exit code and output of a child that imports the copy; bytecode would outlive a mutant."""
    own = {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1"}
    how = {"cwd": copy, "env": os.environ | own, "capture_output": True, "text": True}
    try:
        done = subprocess.run([sys.executable, *arguments], timeout=limit, **how)
    except subprocess.TimeoutExpired:
        return -1, f"longer than {limit} s"
    return done.returncode, done.stdout + done.stderr


def check(copy: Path, mutants: list[Mutant]) -> None:
    """Refuse a list that does not hold, or whose tests do not all pass in the copy as it is."""
    tests = {mutant.test for mutant in mutants if mutant.broken(copy)}
    _, where = python(copy, "-c", "import lightloc; print(lightloc.__file__)")
    if not Path(where.strip()).resolve().is_relative_to(copy):
        PARSER.error(f"the copy was not imported, but {where}")
    code, said = python(copy, *PYTEST, *sorted(tests), limit=LONGEST * len(tests))
    if code:
        PARSER.error(f"without any mutant, not all tests pass:\n{said}")


def tried(mutant: Mutant, copies: SimpleQueue[Path]) -> str:
    """What becomes of a mutant in a copy, which is whole again afterwards."""
    copy, clock = copies.get(), time.perf_counter()
    path, whole, broken = mutant.broken(copy)
    path.write_text(broken)
    code, _ = python(copy, *PYTEST, mutant.test)
    path.write_text(whole)
    copies.put(copy)
    word = {0: SURVIVED, 1: KILLED}.get(code, NEITHER)  # else no test was found, or none ran
    took, tier = time.perf_counter() - clock, Path(mutant.test).parts[1]
    print(f"{word:13s} {took:5.1f} s  {tier:9s}  {mutant.name}", flush=True)
    return word


def main() -> int:
    given, text = PARSER.parse_args(), Path(__file__).with_name("mutants.toml").read_text()
    every = {row["name"]: Mutant(**row) for row in tomllib.loads(text)["mutant"]}
    if unknown := set(given.names) - set(every):
        PARSER.error(f"no such mutant: {', '.join(unknown)}")
    chosen = [every[name] for name in given.names or every]
    if given.list:
        print(*(f"{m.name}: {m.why}\n    {m.test}" for m in chosen), sep="\n")
        return 0
    copies: SimpleQueue[Path] = SimpleQueue()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(given.jobs) as pool:
        for i in range(given.jobs):
            copies.put(copy := copied(Path(folder) / str(i)))
        check(copy, chosen)
        words = Counter(pool.map(lambda mutant: tried(mutant, copies), chosen))
    print(", ".join(f"{words[word]} {word}" for word in (KILLED, SURVIVED, NEITHER)))
    return 2 if words[NEITHER] else int(words[SURVIVED] > 0)


if __name__ == "__main__":
    sys.exit(main())
