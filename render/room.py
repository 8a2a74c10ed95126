"""Load a Mitsuba scene, and take its lights out of it as the truth."""

from __future__ import annotations

import importlib.resources
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from lightloc import PointLights
from render.geometry import SceneGeometry, lit
from render.meshes import check_meshes
from render.transport import bounds_of, diagonal_of
from render.variant import use_mitsuba

GREY = 1e-6  # channels that differ by less than this share are one channel
TESSELLATION = 33  # nodes along u and v of a curved shape, for pictures
NOT_FINITE = ("nan", "inf", "infinity")


@dataclass(frozen=True)
class Room:
    """A loaded scene: what a search may know (geometry) and what it must find (lights)."""

    name: str
    path: Path
    parameters: Mapping[str, Any]
    scene: Any = field(repr=False)
    lights: PointLights
    geometry: SceneGeometry

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the scene's bounding box, metres."""
        return diagonal_of(self.scene)

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) corners of the surfaces' bounding box, metres."""
        return bounds_of(self.scene)


def standard_scenes() -> list[str]:
    """Names of the scenes that come with the package."""
    files = importlib.resources.files("scenes").iterdir()
    return sorted(file.name[:-4] for file in files if file.name.endswith(".xml"))


def find(path: str | Path) -> Path:
    """The file of a scene: a path, or the name of a standard scene with or without ``.xml``.

    Raises ValueError naming the file where there is none.
    """
    path = Path(path)
    if path.is_file():
        return path
    name = path.name.removesuffix(".xml")
    if name in standard_scenes() and path.parent.name in ("", "scenes"):
        return Path(str(importlib.resources.files("scenes") / f"{name}.xml"))
    raise ValueError(
        f"{path}: no such scene file (standard scenes: {', '.join(standard_scenes())})"
    )


def load(path: str | Path, **parameters: Any) -> Room:
    """Load a Mitsuba scene whose lights are ``point`` emitters.

    Parameters
    ----------
    path : Path
        An XML file, or the name of a standard scene.
    parameters : Mapping[str, Any]
        Values for the scene's own ``<default>`` names, as ``alpha=0.2``.

    Raises
    ------
    ValueError
        One sentence naming the file and what is wrong with it: it can't be read,
        a parameter is unknown, it has no point emitter or another kind of emitter, an
        intensity is negative or not finite, it has no surface, or a mesh is broken.

    >>> load("box_one").lights.channels
    1
    """
    use_mitsuba()
    path = find(path)
    _check_parameters(path, parameters)
    values = {name: text_of(value) for name, value in parameters.items()}
    try:
        check_meshes(path, values)
        scene = mi.load_file(str(path), optimize=False, **values)
    except (RuntimeError, ValueError) as error:
        raise ValueError(f"{path}: {_first_sentence(error)}") from None
    if not isinstance(scene, mi.Scene):
        raise ValueError(f"{path}: holds a {type(scene).__name__}; expected a scene")
    if not scene.shapes():
        raise ValueError(f"{path}: the scene has no surface")
    try:
        lights = _lights(scene)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return Room(path.stem, path, dict(parameters), scene, lights, SceneGeometry(scene))


def relight(room: Room, lights: PointLights) -> Room:
    """The same room lit by other point lights; its sensors and surfaces are shared."""
    scene = lit(room.scene, lights)
    return Room(room.name, room.path, room.parameters, scene, lights, SceneGeometry(scene))


def triangles(room: Room) -> tuple[np.ndarray, np.ndarray]:
    """All surfaces as triangles: vertices (v, 3) in metres, faces (f, 3)."""
    vertices, faces, first = [], [], 0
    for shape in room.scene.shapes():
        mesh = shape if shape.is_mesh() else None
        if mesh is None or "vertex_positions" not in mi.traverse(shape):
            v, t = _tessellated(shape)
        else:
            values = mi.traverse(mesh)
            v = np.array(values["vertex_positions"]).reshape(-1, 3)
            t = np.array(values["faces"]).reshape(-1, 3)
        vertices.append(v)
        faces.append(t + first)
        first += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def _tessellated(shape: Any) -> tuple[np.ndarray, np.ndarray]:
    """Triangles over the (u, v) square of a shape that keeps no vertices."""
    n = 2 if "Rectangle" in shape.class_name() else TESSELLATION
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    uv = mi.Point2f(np.stack([u.ravel(), v.ravel()]).clip(1e-4, 1 - 1e-4))
    vertices = np.array(shape.eval_parameterization(uv).p).T
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + n], axis=1)
    upper = np.stack([corner + 1, corner + n + 1, corner + n], axis=1)
    return vertices, np.concatenate([lower, upper])


def _lights(scene: Any) -> PointLights:
    emitters = scene.emitters()
    for emitter in emitters:
        if emitter.class_name() != "PointLight":
            name = f"emitter '{emitter.id()}'" if emitter.id() else "an emitter"
            raise ValueError(f"{name} is of type {emitter.class_name()}; expected point emitters")
    if not emitters:
        raise ValueError("the scene has no point emitter; expected at least one light to hide")
    positions, intensities = [], []
    for emitter in emitters:
        values = mi.traverse(emitter)
        colour = next(key for key in values.keys() if key.startswith("intensity"))  # noqa: SIM118
        positions.append(np.array(values["position"], float).ravel())
        intensities.append(np.broadcast_to(np.array(values[colour], float).ravel(), 3))
    lights = PointLights(np.array(positions), np.array(intensities))
    colours = lights.intensities
    grey = np.ptp(colours, axis=1).max() <= GREY * colours.max()
    return PointLights(lights.positions, colours[:, :1]) if grey else lights


def _check_parameters(path: Path, parameters: Mapping[str, Any]) -> None:
    known = set(re.findall(r"<default\s+name=\"([^\"]+)\"", path.read_text(errors="replace")))
    for name, value in parameters.items():
        if name not in known:
            raise ValueError(
                f"{path}: has no parameter '{name}' (it has: {', '.join(sorted(known)) or 'none'})"
            )
        if text_of(value).strip().lower().lstrip("+-") in NOT_FINITE:
            raise ValueError(f"{path}: parameter '{name}' is {value}; expected a finite number")


def text_of(value: Any) -> str:
    """A parameter as Mitsuba reads it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _first_sentence(error: Exception) -> str:
    """The line of Mitsuba's message that says what is wrong, without its C++ source place."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    lines = [re.sub(r"^.*?\[[\w.]+\.cpp:\d+\]\s*", "", line) for line in lines]
    return lines[-1] if lines else "can't be loaded"
