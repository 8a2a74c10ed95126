"""Run one case: load, observe, localize, judge.

It leaves result.json, observations.npz, room.npz, fields.npz, view.npz and view.exr in a folder,
and printed.txt where a solver in a process of its own printed anything.
"""

from __future__ import annotations

import contextlib
import resource
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import render
from lightloc import Localization, Observations, PointLights, Reason
from render import Room
from validation import records
from validation.jobs import made, write_json
from validation.judge import RADIUS, Comparison, compare, judge_sphere
from validation.records import (
    SCHEMA,
    ClosedForm,
    FoundLight,
    Lights,
    Limits,
    Made,
    Rerender,
    Result,
    Said,
    Search,
    Step,
    TrueLight,
)
from validation.suite.cases import Case
from validation.suite.pictures import save_fields, save_room, save_view
from validation.suite.solve import answer, assumed, measured, observe

RERENDER_SPP = 256  # its noise is known and counted
OTHER_SEED = 7919
ROUNDING = 1e-5  # of the mean radiance: the error of an exact B, for z-scores of a re-render


def run_case(case: Case, folder: Path, command: str) -> dict[str, Any]:
    """Run one case and leave its files in ``folder``; returns the content of result.json."""
    forget_peak()
    clock = _Clock()
    values: dict[str, Any] = dict(case.parameters)
    room = render.load(case.scene_file, find=case.find, unit=case.unit, **values)
    if case.lights:
        table = np.array(case.lights)
        room = render.relight(room, PointLights(table[:, :3], table[:, 3:], room.unit))
    clock.lap("load")
    seen = observe(case, room, case.seed)
    seen.save(folder / "observations.npz")
    clock.lap("observe")
    told, believed = assumed(case, seen, room)
    clock.lap("assume")
    given = answer(case, told, believed, (folder / "printed.txt").write_bytes)
    found = given.found
    clock.lap("localize", given.seconds)
    comparison = compare(found.lights, room.lights, room.diagonal)
    again = rerender(case, room, seen, found.lights)
    why = [given.why] if given.why else shortfalls(case, comparison, found)
    metrics, more = measured(case, found, room, seen)
    why += more
    sphere = None
    if case.closed_form:
        sphere, more = judge_sphere(seen, room.lights, room.geometry, case.seed)
        why += more
    clock.lap("judge")
    save_room(folder / "room.npz", room, seen, found)
    save_fields(folder / "fields.npz", room, seen, found)
    save_view(folder, room, found.lights, case.transport, case.seed)
    clock.lap("pictures")
    result = Result(
        **case.model_dump(
            include={
                *("name", "scene", "claim", "brdf", "transport", "noise", "gated"),
                *(
                    "points",
                    "spp",
                    "rendered",
                    "seed",
                    "parameters",
                    "method",
                    "options",
                    "assumed",
                ),
            }
        ),
        alpha=case.alpha,
        outcome=("failed" if why else "passed") if case.gated else "shown",
        why=why,
        limits=Limits(
            position_percent=case.position_percent,
            intensity_percent=case.intensity_percent,
            radius_percent=100 * RADIUS,
        ),
        diagonal=room.diagonal,
        unit=room.unit,
        power=room.lights.power,
        lights=Lights(true=true_lights(room.lights), found=found_lights(found)),
        comparison=compared(comparison),
        rerender=again,
        metrics=dict(metrics),
        closed_form=ClosedForm(**sphere) if sphere else None,
        search=searched(found),
        seconds=clock.laps(),
        peak_mb=peak_mb(),
        command=command,
        made=Made(**made()),
    )
    content = {"schema": SCHEMA, **result.model_dump(mode="json")}
    write_json(folder / "result.json", content)
    return content


def shortfalls(case: Case, comparison: Comparison, found: Localization | None = None) -> list[str]:
    """Why the comparison falls short of the row, a sentence each; empty where it holds.

    Right lights with an answer that does not believe them fall short too, where light is direct:
    there the model is the renderer's own.
    """
    why = []
    if not comparison.count_right:
        why.append(
            f"{comparison.count_found} lights were found where there are {comparison.count_true}."
        )
    why += [f"True light {i + 1} was missed." for i in comparison.missed]
    why += [f"Found light {j + 1} is no true light." for j in comparison.ghosts]
    for what, worst, limit in (
        ("position", comparison.worst_position_percent, case.position_percent),
        ("intensity", comparison.worst_intensity_percent, case.intensity_percent),
    ):
        if worst is not None and not worst <= limit:
            why.append(f"The worst {what} is off by {worst:.3g} %; the row allows {limit:g} %.")
    if found and case.transport == "direct" and found.reason is Reason.NO_GAIN:
        why.append(f"The answer says: {found.reason.value}")
    return why


def rerender(case: Case, room: Room, seen: Observations, lights: PointLights) -> Rerender | None:
    """Mitsuba's B from the found lights at the same points against B, as z-scores.

    Both carry noise of their own (another seed for the second), and both count in z. Without
    any noise, z is in units of `ROUNDING` of the mean.
    """
    if not len(lights):
        return None
    again = render.remeasure(
        render.relight(room, lights),
        seen,
        spp=min(case.spp, RERENDER_SPP),
        seed=case.seed + OTHER_SEED,
    )
    mean = seen.radiance.mean()
    sigma = np.sqrt(seen.known_sigma**2 + again.known_sigma**2 + (ROUNDING * mean) ** 2)
    difference = again.radiance - seen.radiance
    z = difference / sigma
    return Rerender(
        z_mean=float(z.mean()),
        z_std=float(z.std()),
        relative_rms=float(np.sqrt(np.square(difference).mean()) / mean),
    )


def forget_peak() -> None:
    """Let the peak of this process's memory begin anew, where Linux can do that."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def peak_mb() -> int:
    """The peak since then; of the process's whole life elsewhere."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) // 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024


class _Clock:
    def __init__(self) -> None:
        self.start = self.last = time.perf_counter()
        self.parts: dict[str, float] = {}

    def lap(self, name: str, seconds: float | None = None) -> None:
        """End a part, which took so long where it says so itself."""
        now = time.perf_counter()
        self.parts[name] = round(now - self.last if seconds is None else seconds, 3)
        self.last = now

    def laps(self) -> dict[str, float | None]:
        return {**self.parts, "total": round(time.perf_counter() - self.start, 3)}


def true_lights(lights: PointLights) -> list[TrueLight]:
    """The scene's lights, as a record holds them."""
    return [
        TrueLight(position=p.tolist(), intensity=I.tolist())
        for p, I in zip(lights.positions, lights.intensities, strict=True)
    ]


def found_lights(found: Localization) -> list[FoundLight]:
    """The found lights with their errors."""
    return [
        FoundLight(
            position=light.position,
            intensity=light.intensity,
            position_error=found.position_error[i].tolist(),
            intensity_error=found.intensity_error[i].tolist(),
            bound=found.bound[i].tolist(),
            resolution=float(found.resolution[i]),
            width=float(found.width[i]),
        )
        for i, light in enumerate(true_lights(found.lights))
    ]


def compared(comparison: Comparison) -> records.Comparison:
    """The judge's comparison."""
    return records.Comparison(
        count_true=comparison.count_true,
        count_found=comparison.count_found,
        count_right=comparison.count_right,
        precision=comparison.precision,
        recall=comparison.recall,
        pairs=[records.Pair(**asdict(pair)) for pair in comparison.pairs],
        missed=list(comparison.missed),
        ghosts=list(comparison.ghosts),
        worst_position_percent=comparison.worst_position_percent,
        worst_intensity_percent=comparison.worst_intensity_percent,
    )


def searched(found: Localization) -> Search:
    """How the search went."""
    return Search(
        reason=found.reason.name.lower(),
        message=found.reason.value,
        chi2_per_dof=found.chi2,
        certificate=float(found.certificate),
        verdicts=[
            Said(kind=v.kind.name.lower(), lights=list(v.lights), sentence=v.sentence)
            for v in found.verdicts
        ],
        remarks=list(found.remarks),
        history=[Step(step=s.action, lights=s.lights, chi2=s.chi2) for s in found.history],
    )
