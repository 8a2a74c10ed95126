"""A room's surfaces as triangles, to be drawn."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from render.room import Room

NODES = 33  # along u and v of a curved shape


def triangles(room: Room) -> tuple[np.ndarray, np.ndarray]:
    """Cut all surfaces into triangles, for pictures.

    Meshes and rectangles stay as they are; other shapes are curved, and approximated. Instances
    that are not expanded, and hairs, are left out: Mitsuba has no parameters over them.

    Parameters
    ----------
    room : Room
        The room.

    Returns
    -------
    vertices : (v, 3) array
        Positions, in the scene's unit of length.
    faces : (f, 3) array of int
        Indices of the vertices of each triangle.

    Examples
    --------
    A box has six sides, each of two triangles:

    >>> from render import load, triangles
    >>> vertices, faces = triangles(load("box_one"))
    >>> vertices.shape, faces.shape
    ((24, 3), (12, 3))
    """
    vertices, faces, first = [np.zeros((0, 3))], [np.zeros((0, 3), int)], 0
    for shape in room.scene.shapes():
        mesh = shape if shape.is_mesh() else None
        if mesh is None or "vertex_positions" not in mi.traverse(shape):
            try:
                v, t = _tessellated(shape)
            except RuntimeError:  # not implemented
                continue
        else:
            values = mi.traverse(mesh)
            v = np.array(values["vertex_positions"]).reshape(-1, 3)
            t = np.array(values["faces"]).reshape(-1, 3)
        vertices.append(v)
        faces.append(t + first)
        first += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def _tessellated(shape: Any) -> tuple[np.ndarray, np.ndarray]:
    """(v, 3) vertices and (f, 3) triangles over the (u, v) square of a shape that keeps none."""
    n = 2 if "Rectangle" in shape.class_name() else NODES
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    uv = mi.Point2f(np.stack([u.ravel(), v.ravel()]).clip(1e-4, 1 - 1e-4))
    vertices = np.array(shape.eval_parameterization(uv).p).T
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + n], axis=1)
    upper = np.stack([corner + 1, corner + n + 1, corner + n], axis=1)
    return vertices, np.concatenate([lower, upper])
