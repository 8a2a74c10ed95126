"""One scene in one variant: is it refused truthfully, is B right, are the lights right."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import Localization, Observations, PointLights, Reason, localize
from strangers.reference import by_mitsuba, whole_file
from strangers.scene import Stranger
from strangers.world import World
from validation import compare

EXACT = 1e-4  # of B: what single precision leaves of light that has no noise
NEAR = 1e-4  # of the diagonal: what it leaves of a position, beside four standard errors
EQUAL = 0.99  # of exact values; the rest lies at shadows' edges, which single precision moves
ERRORS = 4.0


@dataclass(frozen=True)
class Effort:
    """How much is spent on one scene."""

    points: int = 1000
    spp: int = 256
    reference: int = 1024
    searched: int = 1500


FULL = Effort()
QUICK = Effort(points=300, spp=64, reference=256, searched=600)


@dataclass(frozen=True)
class Row:
    """What came out.

    ``z`` is of points whose B has noise; ``as_read`` is whether the reference is
    the file as Mitsuba itself reads it; ``broken`` are the promises that were not kept.
    """

    scene: str
    kind: str
    variant: str
    sentence: str = ""
    z: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    reason: str = ""
    count: str = ""
    position: float | None = None
    intensity: float | None = None
    as_read: bool = True
    seconds: float = 0.0
    broken: tuple[str, ...] = ()


def tried(one: Stranger, variant: str, world: World, effort: Effort = FULL) -> Row:
    """Write, load, observe and search one scene."""
    start = time.perf_counter()
    row = Row(one.name, one.kind, variant)
    with TemporaryDirectory() as folder:
        path = one.into(Path(folder), world)
        try:
            room = render.load(path, find=one.find, **one.values)
        except ValueError as error:
            row = _refused(row, one, path, str(error))
        else:
            row = _loaded(row, one, world, room, effort)
    return replace(row, seconds=time.perf_counter() - start)


def _refused(row: Row, one: Stranger, path: Path, sentence: str) -> Row:
    """A refusal is as promised: it names the file, the line and what is the matter."""
    place = rf"{re.escape(str(path))}: " + (r"line \d+: " if one.line else "")
    as_promised = one.refused and re.match(place, sentence) and "\n" not in sentence
    if not as_promised or not all(words in sentence for words in one.refused):
        row = replace(row, broken=("refused",))
    return replace(row, sentence=sentence.replace(f"{path}: ", ""))


def _loaded(row: Row, one: Stranger, world: World, room: render.Room, effort: Effort) -> Row:
    if one.refused:
        return replace(row, broken=("not refused",))
    broken = [] if same_lights(room.lights, one.truth(world)) else ["the truth"]
    whole, as_read = whole_file(room.path, one.values)
    try:
        z, exact = standing(room, whole, world.seed, effort)
    except ValueError as error:
        z, exact, sentence = np.zeros(0), True, str(error)
        if not one.no_paths or not all(words in sentence for words in one.no_paths):
            return replace(row, sentence=sentence, broken=(*broken, "raised"))
    else:
        broken += ["not refused"] if one.no_paths else []
    broken += [] if exact else ["exact B"]
    q = render.observe(
        room, points=effort.searched, spp=effort.spp, seed=world.seed, transport="direct"
    )
    found = localize(q, room.geometry, seed=world.seed)
    if not right(found, room.lights, room.diagonal):
        broken.append("CONVERGED and wrong" if found.reason is Reason.CONVERGED else "lights")
    match = compare(found.lights, room.lights, room.diagonal)
    return replace(
        row,
        z=z,
        reason=found.reason.name,
        count=f"{len(found.lights)}/{len(room.lights)}",
        position=match.worst_position_percent,
        intensity=match.worst_intensity_percent,
        as_read=as_read,
        broken=tuple(broken),
    )


def standing(
    room: render.Room, whole: object, seed: int, effort: Effort
) -> tuple[NDArray[np.float64], bool]:
    """z of B against the whole file's, and whether the rest, which has no noise, is equal."""
    q = render.observe(room, points=effort.points, spp=effort.spp, seed=seed)
    B, error = by_mitsuba(whole, q, room.diagonal, effort.reference, seed)
    return scores(q, B[:, : q.channels], error[:, : q.channels])


def scores(q: Observations, B: NDArray, error: NDArray) -> tuple[NDArray[np.float64], bool]:
    """z where there is noise, and whether B is equal elsewhere, but for shadows' edges."""
    off, spread = q.radiance - B, np.hypot(q.sigma, error)
    rounding = EXACT * np.maximum(np.abs(B), B.mean())
    noisy = spread > rounding
    equal = (np.abs(off) <= rounding)[~noisy]
    return off[noisy] / spread[noisy], bool(equal.mean() >= EQUAL) if equal.size else True


def same_lights(ours: PointLights, true: PointLights) -> bool:
    """Whether a room's lights are those of its file, in any order."""
    if len(ours) != len(true):
        return False
    if not len(true):
        return True
    a, b = (np.lexsort(np.round(lights.positions.T, 3)) for lights in (ours, true))
    size = np.abs(true.positions).max()
    return np.allclose(ours.positions[a], true.positions[b], atol=1e-6 * size) and np.allclose(
        *np.broadcast_arrays(ours.intensities[a], true.intensities[b]), rtol=1e-5
    )


def right(found: Localization, true: PointLights, diagonal: float) -> bool:
    """Whether lights are as many as there are, and where they are, within four standard errors."""
    match = compare(found.lights, true, diagonal)
    if not match.count_right or len(match.pairs) != len(true):
        return False
    for pair in match.pairs:
        off = np.abs(found.lights.positions[pair.found] - true.positions[pair.true])
        if (off > ERRORS * found.position_error[pair.found] + NEAR * diagonal).any():
            return False
    return True
