"""Try every stranger's scene in every variant, print a row each, and count what was promised.

Exit code 0: all promises are kept; 1: one is not.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # where `strangers` is a package

import numpy as np
from joblib import Parallel, delayed

from strangers import SCENES
from strangers.trial import FULL, QUICK, Effort, Row, tried
from strangers.world import VARIANTS

MEAN, DEVIATION = 0.1, (0.9, 1.1)  # of z over all points of a scene
FEW = 500  # points with noise: below it, a scene has none to speak of
HEAD = f"{'scene':22} {'variant':10} {'z':>12}  {'reason':10} {'count':>5} {'position':>9} {'I':>9}"


def of_scene(name: str, variants: list[str], effort: Effort) -> list[Row]:
    from render.variant import use_mitsuba

    use_mitsuba()
    return [tried(SCENES[name], variant, VARIANTS[variant], effort) for variant in variants]


def in_percent(value: float | None) -> str:
    return f"{'-':>9}" if value is None else f"{value:7.1e} %"


def line(row: Row) -> str:
    start = f"{row.scene:22} {row.variant:10} "
    end = f"  {row.seconds:4.0f} s  {', '.join(row.broken).upper()}"
    if not row.reason:
        return f"{start}{row.sentence}{end}"
    z = f"{row.z.mean():5.2f} ± {row.z.std():4.2f}" if len(row.z) else "-"
    errors = f"{in_percent(row.position)} {in_percent(row.intensity)}"
    return f"{start}{z:>12}  {row.reason:10} {row.count:>5} {errors}{end}"


def is_standard(z: np.ndarray) -> bool:
    return bool(abs(z.mean()) <= MEAN and DEVIATION[0] <= z.std() <= DEVIATION[1])


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="scenes or kinds")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    parser.add_argument("--quick", action="store_true", help="a quarter of the points and paths")
    chosen = parser.parse_args()
    only = chosen.only or list(SCENES)
    names = [name for name, one in SCENES.items() if name in only or one.kind in only]
    if not names:
        parser.error(f"no such scene; expected of: {', '.join(SCENES)}")
    start = time.perf_counter()
    print(HEAD)
    effort = QUICK if chosen.quick else FULL
    results = Parallel(n_jobs=chosen.jobs, return_as="generator")(
        delayed(of_scene)(name, chosen.variants, effort) for name in names
    )
    rows: list[Row] = []
    for some in results:
        print("\n".join(map(line, some)), flush=True)
        rows += some
    broken = [f"{row.scene} ({row.variant}): {', '.join(row.broken)}" for row in rows if row.broken]
    z = defaultdict(list)
    for row in rows:
        z[row.scene] += [row.z]
    noisy = {name: np.concatenate(all_z) for name, all_z in z.items()}
    noisy = {name: all_z for name, all_z in noisy.items() if len(all_z) >= FEW}
    for name, all_z in noisy.items():
        if not is_standard(all_z):
            broken.append(f"{name}: z is {all_z.mean():.3f} ± {all_z.std():.3f}")
    loaded = [row for row in rows if row.reason]
    print(f"\n{len(z)} scenes, {len(rows)} files, {time.perf_counter() - start:.0f} s")
    print(f"loaded {len(loaded)}, refused {len(rows) - len(loaded)}")
    others = sorted({row.scene for row in loaded if not row.as_read})
    if others:
        print(f"compared with the file as we read it, which Mitsuba refuses: {', '.join(others)}")
    if noisy:
        every = np.concatenate(list(noisy.values()))
        print(f"z over all {len(every)} points with noise: {every.mean():.3f} ± {every.std():.3f}")
    print("\n".join([f"NOT KEPT: {len(broken)}", *broken] if broken else ["all promises kept"]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
