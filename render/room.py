"""Load a Mitsuba scene, and take its lights out of it as the truth."""

from __future__ import annotations

import importlib.resources
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from lightloc import PointLights, units
from lightloc.checks import unit_word
from lightloc.files import regular
from render.accepted import build
from render.emitters import POINT, check_find, extinguish
from render.geometry import SceneGeometry, lit
from render.material import is_grey
from render.mesh_scene import METRES, is_mesh, read_mesh
from render.scene_file import SceneFile, text_of
from render.surfaces import area_of, left_out
from render.transport import bounds_of, diagonal_of
from render.variant import use_mitsuba

NOT_FINITE = ("nan", "inf", "infinity")


@dataclass(frozen=True)
class Room:
    """A loaded scene: what a search may know (geometry) and what it must find (lights).

    Made by `load` and `relight`.

    Parameters
    ----------
    name : str
        The file's name without its ending.
    path : Path
        The file.
    parameters : mapping of str to value
        Values that the scene's own ``<default>`` names were given.
    scene : mitsuba.Scene
        The surfaces under the lights that are to be found alone.
    lights : PointLights
        The lights that are to be found, in the room's unit of length.
    geometry : SceneGeometry
        Its surfaces, and its known light.
    known : mitsuba.Scene or None
        The same surfaces under the emitters that are not to be found; None where there are none.
    unit : str
        The unit of length, a word.
    notes : tuple of str
        Sentences about what of the file was taken otherwise than it says.
    max_depth : int or None
        Length of the longest paths in a picture by the scene's own integrator, 2 being direct
        light; None where they go on until they carry nothing. `observe_picture` reads it: `observe`
        and `photograph` have no end.

    Examples
    --------
    >>> from render import load
    >>> room = load("box_one")
    >>> room.name, len(room.lights), room.bounds[1].tolist()
    ('box_one', 1, [4.0, 3.0, 2.5])
    """

    name: str
    path: Path
    parameters: Mapping[str, Any]
    scene: Any = field(repr=False)
    lights: PointLights
    geometry: SceneGeometry
    known: Any = field(default=None, repr=False)
    unit: str = "m"
    notes: tuple[str, ...] = ()
    max_depth: int | None = None

    @property
    def unobserved(self) -> dict[str, str]:
        """Surfaces that `observe` leaves out, each with the reason, as "is glass"."""
        return {name: why for _, name, why in left_out(self.scene, self.known)}

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the surfaces' box, in the scene's unit of length."""
        return diagonal_of(self.scene)

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) lower and upper corner of the surfaces' box, in the scene's unit of length."""
        return bounds_of(self.scene)


def standard_scenes() -> list[str]:
    """List the scenes that come with the package.

    Returns
    -------
    list of str
        Their names in alphabetical order, as `load` takes them.

    Examples
    --------
    >>> from render import standard_scenes
    >>> "box_one" in standard_scenes()
    True
    """
    files = importlib.resources.files("scenes").iterdir()
    return sorted(file.name[:-4] for file in files if file.name.endswith(".xml"))


def find_file(path: str | Path) -> Path:
    """The file of a scene: a path, or the name of a standard scene with or without ``.xml``.

    Raises ValueError naming the file where there is none.
    """
    path = Path(path)
    name = path.name.removesuffix(".xml")
    # no error of a name that no file could have; a bare name is a standard scene's
    is_there = os.path.exists(path) and not os.path.isdir(path)
    if is_there and str(path) not in standard_scenes():
        return regular(path)
    if name in standard_scenes() and path.parent.name in ("", "scenes"):
        return Path(str(importlib.resources.files("scenes") / f"{name}.xml"))
    raise ValueError(
        f"{path}: no such scene file (standard scenes: {', '.join(standard_scenes())})"
    )


def load(
    path: str | Path,
    *,
    find: str | Sequence[str] = POINT,
    unit: str | None = None,
    **parameters: Any,
) -> Room:
    """Load a Mitsuba scene, and hide its ``point`` emitters as the lights to be found.

    Parameters
    ----------
    path : str or Path
        An XML file, a mesh (``.ply``, ``.obj``, ``.glb`` or ``.gltf``), or the name of a standard
        scene. A mesh's surfaces are two-sided; the lights of glTF are lights, in candela.
    find : "point" or sequence of str
        The lights to be found: all of the scene's own point emitters, or those with these ids. All
        other emitters are known light, which is rendered and subtracted.
    unit : str, optional
        The unit of length, a word as "cm", for prints and files: no result depends on it. Where
        None, metres for a standard scene and for glTF, and "unit" for other files, which do not
        say it.
    **parameters : str, float, int or bool
        Values for the names that the scene uses as ``$alpha``, as ``alpha=0.2``. Of a mesh it is
        ``albedo`` alone: a number, or red, green and blue, in place of the file's own colours; it
        is needed where there are none.

    Returns
    -------
    Room
        The scene, its lights, none perhaps, and its surfaces as a geometry. Integrators are left
        out, and films, samplers and sensors that this Mitsuba does not have; ``null`` surfaces are
        none, instances are copies of what they repeat.

    Raises
    ------
    ValueError
        If there is no such file or it can't be read, a parameter is unknown, missing or not finite,
        no point emitter has an id of ``find``, an intensity is negative or not finite, there is no
        surface or a broken mesh, a plugin or a property is one that this Mitsuba does not have, or
        something is not modelled: a medium, a surface that lets light straight through, a spectrum
        without colours in RGB, an emitter that no path finds. The message is one sentence that
        begins with the file, and says the line where there is one. Of a mesh, if there is no face,
        a vertex is not finite or not there, a picture is missing, or the file has no colours and no
        albedo is given.

    Examples
    --------
    >>> from render import load
    >>> load("box_one").lights.channels
    1
    """
    use_mitsuba()
    path = find_file(path)
    unit = _unit_of(path) if unit is None else unit_word(f"{path}: unit", unit)
    for name, value in parameters.items():
        if text_of(value).strip().lower().lstrip("+-") in NOT_FINITE:
            raise ValueError(f"{path}: parameter '{name}' is {value}; expected a finite number")
    try:
        scene, known, said = _built(path, parameters, find)
    except UnicodeDecodeError:
        raise ValueError(f"{path}: a name in it is not written in UTF-8") from None
    if all(area_of(shape) == 0 for shape in scene.shapes()):
        raise ValueError(f"{path}: the scene has no surface")
    try:
        # all of glTF is photometric
        lights = _lights(scene, unit, "cd" if path.suffix.lower() in METRES else "")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    geometry = SceneGeometry(scene, known)
    return Room(path.stem, path, dict(parameters), scene, lights, geometry, known, unit, **said)


def _built(
    path: Path, parameters: Mapping[str, Any], find: str | Sequence[str]
) -> tuple[Any, Any, dict[str, Any]]:
    """The scene under the lights to be found, and under all others, None where there are none.

    The third is what else a `Room` is told of its file: ``notes`` and ``max_depth``.
    """
    read = read_mesh if is_mesh(path) else SceneFile.read
    file, known = read(path, parameters), None
    check_find(file, find)
    if extinguish(file, find, known=True):
        other = read(path, parameters)
        extinguish(other, find, known=False)
        known = build(other)
    said = {"notes": file.notes, "max_depth": file.max_depth}
    return build(file), known, said


def _unit_of(path: Path) -> str:
    """The unit of length of a file, as far as that is known."""
    ours = path.stem in standard_scenes() and path == find_file(path.stem)
    return "m" if ours or path.suffix.lower() in METRES else units.UNKNOWN


def check_same_unit(room: Room, unit: str, what: str) -> None:
    """Refuse what is known to be in another unit of length than a room."""
    if units.is_other(unit, room.unit):
        raise ValueError(
            f"{what}: in {unit}, and {room.path} is in {room.unit}; expected one unit of length"
        )


def relight(room: Room, lights: PointLights) -> Room:
    """Light a room by other point lights.

    Parameters
    ----------
    room : Room
        The room; it is left as it is.
    lights : PointLights
        The new lights, in the room's unit of length. An intensity that is unknown (NaN) is taken as
        0: in the room where it was looked for, nothing shows it.

    Returns
    -------
    Room
        The same room with those lights in place of its own, sharing sensors and surfaces; its known
        light stays.

    Raises
    ------
    ValueError
        If the lights say another unit of length than the room.

    Examples
    --------
    >>> from lightloc import PointLights
    >>> from render import load, relight
    >>> relight(load("box_one"), PointLights([[1, 1, 2]], [5.0])).lights.intensities.tolist()
    [[5.0]]
    """
    check_same_unit(room, lights.unit, "these lights")
    own = lights.intensity_unit or room.lights.intensity_unit
    lights = PointLights(lights.positions, np.nan_to_num(lights.intensities), room.unit, own)
    scene = lit(room.scene, lights)
    return replace(room, scene=scene, lights=lights, geometry=SceneGeometry(scene, room.known))


def _lights(scene: Any, unit: str, intensity_unit: str) -> PointLights:
    if not scene.emitters():
        return PointLights(np.zeros((0, 3)), np.zeros((0, 1)), unit, intensity_unit)
    positions, intensities = [], []
    for emitter in scene.emitters():
        values = mi.traverse(emitter)
        colour = next(key for key in values.keys() if key.startswith("intensity"))  # noqa: SIM118
        positions.append(np.array(values["position"], float).ravel())
        intensities.append(np.broadcast_to(np.array(values[colour], float).ravel(), 3))
    if np.isnan(intensities).any():
        raise ValueError("an intensity is no number; expected one of at least 0")
    lights = PointLights(np.array(positions), np.array(intensities), unit, intensity_unit)
    colours = lights.intensities
    return replace(lights, intensities=colours[:, :1]) if is_grey(colours) else lights
