"""A stranger's scene: the function that writes it, the lights hidden in it, what is promised."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lightloc import PointLights
from strangers.words import emitter, rgb
from strangers.world import World

Light = tuple[tuple[float, float, float], tuple[float, ...]]
Write = Callable[[World, Path], list[str]]

ONE: tuple[Light, ...] = (((1.2, 2.1, 1.9), (2.0,)),)
TWO: tuple[Light, ...] = (*ONE, ((3.1, 0.8, 1.1), (3.0,)))
FIRST = ("<default", "<path")  # elements that stand before those that use them


def lamp(w: World, light: Light, name: str) -> str:
    """A hidden light in the words of Mitsuba 3."""
    place, intensity = light
    at = f'<point name="position" value="{w.point(*place)}"/>'
    return emitter("point", at, rgb("intensity", w.power(*intensity)), id=name)


@dataclass(frozen=True)
class Stranger:
    """One scene.

    Parameters
    ----------
    name, kind
        The function's name, and the file that it stands in.
    write
        Writes what the scene needs into a folder, and returns the elements of its file.
    lights
        Hidden in it: positions in metres, intensities in W/sr.
    lamp
        Writes one of them.
    find
        As of `render.load`.
    values
        Of its parameters.
    version
        Of the file.
    world
        From a variant to the world that the scene stands in.
    refused
        Words of the sentence by which it is refused; none where it loads.
    no_paths
        Words of the sentence by which it is not rendered with interreflected light.
    line
        Whether that sentence says a line.
    """

    name: str
    kind: str
    write: Write = field(repr=False)
    lights: tuple[Light, ...] = ONE
    lamp: Callable[[World, Light, str], str] = lamp
    find: str | Sequence[str] = "point"
    values: Mapping[str, Any] = field(default_factory=dict)
    version: str = "3.0.0"
    world: Callable[[World], World] = lambda w: w
    refused: tuple[str, ...] = ()
    no_paths: tuple[str, ...] = ()
    line: bool = True

    def into(self, folder: Path, variant: World) -> Path:
        """Write the scene; its file."""
        w = self.world(variant)
        lamps = [self.lamp(w, one, f"lamp_{i}") for i, one in enumerate(self.lights, start=1)]
        parts = self.write(w, folder) + lamps
        head = [part for part in parts if part.startswith(FIRST)]
        body = [part for part in parts if part not in head]
        if w.shuffled:
            random.Random(w.seed).shuffle(body)
        path = folder / "scene.xml"
        inside = "\n".join([*head, *body])
        path.write_text(f'<scene version="{self.version}">\n{inside}\n</scene>\n')
        return path

    def truth(self, variant: World) -> PointLights:
        """The hidden lights as the file has them."""
        w = self.world(variant)
        if not self.lights:
            return PointLights(np.zeros((0, 3)), np.zeros((0, 1)))
        places, intensities = zip(*self.lights, strict=True)
        channels = max(map(len, intensities))
        power = [np.broadcast_to(one, channels) for one in intensities]
        return PointLights(w.points(places), np.array(power) * w.scale**2)


SCENES: dict[str, Stranger] = {}


def stranger(**promised: Any) -> Callable[[Write], Write]:
    """Make a scene of the function that writes it."""

    def known(write: Write) -> Write:
        name, kind = write.__name__, write.__module__.rpartition(".")[2]
        assert name not in SCENES, name
        SCENES[name] = Stranger(name, kind, write, **promised)
        return write

    return known
