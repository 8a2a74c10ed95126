"""A 2D room as a Mitsuba scene: the prism over its outline, observed in its middle plane z = 0.

There is no floor and no ceiling: points, lights and shadow rays all lie in that plane, where
direct light does not depend on them. A circle is Mitsuba's cylinder, a straight edge a rectangle;
an arc that is no whole circle is a mesh with smooth normals.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lightloc import Observations, Outline, PointLights
from lightloc.plane import Loop
from render.observe import observations
from render.room import Room, SceneGeometry, relight
from render.transport import direct, probe
from render.variant import use_mitsuba

REFLECTANCE = 0.5  # of all surfaces, where the caller does not care
HEIGHT = 1.0  # of the prism, as a share of the outline's longer side
PIECES = 4096  # facets of an arc: a half circle's leave it by 7e-8 of the radius, float32's eps / 2


def prism(
    outline: Outline, lights: PointLights, reflectance: float = REFLECTANCE, name: str = "prism"
) -> Room:
    """The room over a 2D outline, with diffuse surfaces and point lights in the plane z = 0.

    Examples
    --------
    >>> square = Outline.polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
    >>> room = prism(square, PointLights([[0.3, 0.4, 0]], [2.0]))
    >>> observe_plane(room, square, 8).radiance.shape
    (8, 1)
    """
    use_mitsuba()
    low, high = outline.bounds
    half = HEIGHT * float((high - low).max()) / 2
    surface = mi.load_dict(
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": [reflectance] * 3}}
    )
    parts: dict[str, Any] = {"type": "scene"}
    for i, loop in enumerate(outline.loops):
        free_on_the_left = (loop.area > 0) == (i == 0)
        if loop.is_circle:
            parts[f"loop_{i}"] = _cylinder(loop, half, inwards=i == 0) | {"bsdf": surface}
            continue
        for e in range(len(loop.vertices)):
            if loop.bulges[e]:
                shape = _bowed(loop, e, half, free_on_the_left, surface)
            else:
                shape = _straight(loop, e, half, free_on_the_left) | {"bsdf": surface}
            parts[f"loop_{i}_edge_{e}"] = shape
    scene = mi.load_dict(parts, optimize=False)
    dark = Room(name, Path(name), {}, scene, lights, SceneGeometry(scene))
    return relight(dark, lights)


def observe_plane(room: Room, outline: Outline, n: int) -> Observations:
    """Mitsuba's direct radiance at the points of ``outline.sample(n)``, each seen along its normal.

    It is that of the room's reflectance: times pi over it, it is that of f = 1.
    """
    x, normals = outline.sample(n)
    si = probe(room.scene, x, normals)
    return observations(si, direct(room.scene, si), np.zeros((n, 3)), room)


def _cylinder(loop: Loop, half: float, inwards: bool) -> dict[str, Any]:
    x, y = loop.centres[0]
    return {
        "type": "cylinder",
        "p0": [x, y, -half],
        "p1": [x, y, half],
        "radius": float(loop.radii[0]),
        "flip_normals": inwards,
    }


def _straight(loop: Loop, edge: int, half: float, free_on_the_left: bool) -> dict[str, Any]:
    """Mitsuba's rectangle is [-1, 1]^2 with its normal along z."""
    along = loop.chords[edge] * (-1 if free_on_the_left else 1)
    columns = np.zeros((4, 4))
    columns[:2, 0] = along / 2
    columns[2, 1] = half
    columns[:2, 2] = along[::-1] * [1, -1] / np.linalg.norm(along)
    columns[:2, 3] = loop.vertices[edge] + loop.chords[edge] / 2
    columns[3, 3] = 1
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(columns)}


def _bowed(loop: Loop, edge: int, half: float, free_on_the_left: bool, surface: Any) -> Any:
    """A mesh over one arc, its facets between two rows of vertices."""
    x, along = loop.on_edge(np.linspace(0, 1, PIECES + 1), np.full(PIECES + 1, edge))
    n = along[:, ::-1] * ([-1, 1] if free_on_the_left else [1, -1])
    low, high = (np.column_stack([x, np.full(len(x), z)]) for z in (-half, half))
    a = np.arange(PIECES)
    b, c, d = a + 1, a + PIECES + 2, a + PIECES + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    if free_on_the_left:  # seen counterclockwise from the right of the edge
        faces = faces[:, ::-1]
    properties = mi.Properties()
    properties["bsdf"] = surface
    mesh = mi.Mesh(
        f"edge_{edge}", 2 * len(x), len(faces), has_vertex_normals=True, props=properties
    )
    values = mi.traverse(mesh)
    values["vertex_positions"] = _flat(np.concatenate([low, high]))
    values["vertex_normals"] = _flat(np.tile(np.pad(n, [(0, 0), (0, 1)]), (2, 1)))
    values["faces"] = mi.UInt32(faces.ravel().astype(np.uint32))
    values.update()
    return mesh


def _flat(rows: NDArray) -> Any:
    return mi.Float(rows.ravel().astype(np.float32))
