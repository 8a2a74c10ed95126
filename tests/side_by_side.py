"""Whether two checkouts give the same answers, to the last bit: the guard of a restructuring.

    python tests/side_by_side.py BEFORE AFTER --rooms 12

Each checkout searches the same rooms in a process of its own, in turn, on this machine. What is
compared is whatever a user sees of an answer: lights, errors, covariance, verdicts, and the steps
of the search with their counts and chi-square. Only public names are used, so that one script
serves commits whose files lie elsewhere.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

Found = Callable[[], Any]  # runs a search and returns its `Localization`


def square(lights: int, number: int, noise: float, discs: int, **how: Any) -> Found:
    """A square 2D room of side 1 with discs in it, 400 observations by Eq. 4."""

    def found() -> Any:
        import lightloc

        rng = np.random.default_rng([lights, number, discs])
        room = lightloc.Outline.polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
        centres = [(0.3, 0.55), (0.68, 0.35), (0.5, 0.8), (0.25, 0.2)][:discs]
        room = room.with_occluders(*(lightloc.Outline.disc(c, 0.07) for c in centres))
        places = np.zeros((0, 3))
        while len(places) < lights:
            p = np.append(rng.uniform(0.06, 0.94, 2), 0.0)
            if room.clearance(p[None])[0] > 0.05 and room.inside(p[None])[0]:
                places = np.concatenate([places, p[None]])
        truth = lightloc.PointLights(places, rng.uniform(1, 5, lights))
        x, normals = room.sample(400)
        q = lightloc.Observations(
            positions=x,
            normals=normals,
            directions=normals,
            radiance=np.zeros(400),
            material=lightloc.Lambert(albedo=np.pi),
        )
        geometry = room if room.occludes else None
        B = lightloc.radiance(q, truth, geometry)
        sigma = noise * np.sqrt(np.maximum(B, 0.01 * B.mean()))
        B = np.maximum(B + sigma * rng.normal(size=B.shape), 0)
        return lightloc.localize(q.with_radiance(B, sigma), geometry, **how)

    return found


def room(
    scene: str,
    number: int,
    noise: float = 0.0,
    transport: str = "direct",
    wrong: bool = False,
    rendered: int = 0,
    points: int = 2000,
    **how: Any,
) -> Found:
    """A scene of ours, observed by Mitsuba.

    With ``wrong``, gloss is taken for Lambert's law; ``rendered`` samples per light render the
    indirect light of what is found.
    """

    def found() -> Any:
        import lightloc
        import render

        here = render.load(scene)
        q = render.observe(
            here, points=points, spp=64, seed=number, transport=transport, noise=noise
        )
        if wrong:
            q = lightloc.Observations(
                positions=q.positions,
                normals=q.normals,
                directions=q.directions,
                radiance=q.radiance,
                sigma=q.sigma,
                material=lightloc.Lambert(albedo=0.5),
            )
        indirect = render.interreflected(here, q, spp=rendered, seed=number) if rendered else None
        return lightloc.localize(q, here.geometry, indirect=indirect, **how)

    return found


def rooms() -> list[tuple[str, Found]]:
    """Sixty rooms; any first dozen of them has some of each kind."""
    twelve = range(12)
    kinds: list[list[tuple[str, Found]]] = [
        [(f"2D exact {i}", square(2 + i % 4, i, 0.0, 0)) for i in twelve],
        [(f"2D noisy {i}", square(2 + i % 4, i, 0.05, 0)) for i in range(9)],
        [(f"2D discs {i}", square(2 + i % 3, i, 0.01, 1 + i % 4)) for i in range(8)],
        [(f"2D paper {i}", square(2 + i % 3, i, 0.0, 0, method="paper")) for i in range(6)],
        [
            (f"{scene} exact", room(scene, i))
            for i, scene in enumerate(("box_occluder", "alcove", "furnished", "box_five"))
        ],
        [
            (f"{scene} noisy", room(scene, i, 0.01))
            for i, scene in enumerate(("box_three", "sphere", "furnished"))
        ],
        [(f"box_conductor {i}", room("box_conductor", i, 0.01 * i)) for i in range(3)],
        [(f"box_plastic {i}", room("box_plastic", i, 0.01 * i)) for i in range(2)],
        [(f"box_mixed {i}", room("box_mixed", i, 0.01 * i)) for i in range(2)],
        [(f"box_colored {i}", room("box_colored", i, 0.01 * i)) for i in range(3)],
        [
            (f"{scene} wrong", room(scene, i, 0.01, wrong=True, points=800))
            for i, scene in enumerate(("box_conductor", "box_plastic", "box_mixed"))
        ],
        [
            (f"{scene} footnote 1", room(scene, i, transport="full"))
            for i, scene in enumerate(("box_two", "box_occluder"))
        ],
        [
            (f"{scene} rounds", room(scene, i, transport="full", rendered=64))
            for i, scene in enumerate(("box_two", "box_plastic"))
        ],
        [("box_one paper", room("box_one", 0, method="paper", points=1000))],
    ]
    return [one for one in chain(*zip_longest(*kinds)) if one is not None]


def seen(found: Any) -> dict[str, Any]:
    """What a user sees of an answer, with numbers as they are stored."""
    arrays = {
        "positions": found.lights.positions,
        "intensities": found.lights.intensities,
        **{
            name: getattr(found, name)
            for name in ("position_error", "intensity_error", "covariance", "bound", "residual")
        },
        **{name: getattr(found, name) for name in ("resolution", "width", "ambient", "sigma")},
    }
    return {
        **{name: np.asarray(a, np.float64).tobytes().hex() for name, a in arrays.items()},
        "certificate": float(found.certificate).hex(),
        "chi2": float(found.chi2).hex(),
        "outliers": found.outliers,
        "reason": found.reason.name,
        "verdicts": [(v.kind.name, v.lights, v.sentence) for v in found.verdicts],
        "steps": [(step.action, step.lights, float(step.chi2).hex()) for step in found.history],
    }


def answers(count: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """The answers to the first rooms, in the checkout that this process imports."""
    for name, search in rooms()[:count]:
        yield name, seen(search())


def searched(checkout: Path, count: int) -> dict[str, Any]:
    """The same, in a checkout of its own process."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "answers.json"
        subprocess.run(
            [sys.executable, __file__, "--write", str(out), "--rooms", str(count)],
            env={**os.environ, "PYTHONPATH": str(checkout.resolve())},
            check=True,
        )
        answers = json.loads(out.read_text())
    if not Path(answers["from"]).is_relative_to(checkout.resolve()):
        raise SystemExit(f"{checkout} was not imported, but {answers['from']}")
    return dict(answers["rooms"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("checkouts", nargs="*", type=Path, metavar="CHECKOUT")
    parser.add_argument("--rooms", type=int, default=12)
    parser.add_argument("--write", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.write:
        import lightloc

        kept = {"from": lightloc.__file__, "rooms": dict(answers(given.rooms))}
        given.write.write_text(json.dumps(kept))
        return
    if len(given.checkouts) != 2:
        parser.error("two checkouts are compared: before and after")
    before, after = (searched(one, given.rooms) for one in given.checkouts)
    differ = 0
    for name, one in before.items():
        other = after[name]
        wrong = [key for key in one if one[key] != other.get(key)]
        differ += bool(wrong)
        print(f"{name:24s}", "differs in " + ", ".join(wrong) if wrong else "same", flush=True)
    print(f"{len(before) - differ} of {len(before)} rooms the same")
    sys.exit(differ > 0)


if __name__ == "__main__":
    main()
