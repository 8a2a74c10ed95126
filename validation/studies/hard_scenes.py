"""The scenes of the hard set: a name in, a trial out.

Of how lights are found they know `localize` alone, so that they outlive any search.
"""

from __future__ import annotations

import render
from validation.rooms import lit
from validation.studies import scenes
from validation.studies.trial import Trial, trial

KINDS = ("occluders", "furnished", "plastic_a3")  # rooms in three dimensions, one after another
POINTS = 2000  # observations of one: with twice as many, the search takes minutes


def hard(name: str) -> Trial:
    """A room of any row: ``lights-15-003``, ``noisy-4-003``, ``solid-10-noise-1-003``."""
    words, number = scenes.parts(name)
    if words[0] == "solid":
        _, lights, _, percent = words
        return _solid(name, number, int(lights), int(percent) / 100)
    flat = {"lights": scenes.many, "noisy": scenes.noisy, "discs": scenes.occluders}
    return flat[words[0]](name)


def _solid(name: str, number: int, lights: int, noise: float) -> Trial:
    """Direct light in three dimensions; percentages are of the diagonal, as in the suite."""
    room = lit(KINDS[number % len(KINDS)], number, lights)
    clean, seen = (
        render.observe(room, points=POINTS, seed=number, transport="direct", noise=k)
        for k in (0.0, noise)
    )
    known = scenes.with_error(clean, scenes.noise_of(clean, noise))
    return trial(name, seen, room.lights, room.geometry, known=known, diagonal=room.diagonal)
