"""Meshes and pictures on disk, made here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strangers.world import World

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def cuboid(low: ArrayLike, high: ArrayLike) -> tuple[NDArray, NDArray]:
    """(24, 3) vertices and (12, 3) triangles, their fronts outward."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    vertices = low + (high - low) * CORNERS[np.ravel(SIDES)]
    corners = np.arange(24).reshape(6, 4)
    return vertices, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


def ply(
    w: World, path: Path, vertices: NDArray, faces: NDArray, colours: NDArray | None = None
) -> str:
    """Write a mesh, and colours at its vertices; its file's name."""
    names = ["x", "y", "z"] + (["r", "g", "b"] if colours is not None else [])
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = w.points(vertices)
    if colours is not None:
        rows = np.concatenate([rows, colours], axis=1)
    lines = [" ".join(repr(float(v)) for v in row) for row in rows]
    lines += [" ".join(map(str, (3, *face))) for face in w.faces(faces)]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join([*head, *lines]) + "\n")
    return path.name


def globe(centre: ArrayLike, radius: float, n: int = 12) -> tuple[NDArray, NDArray, NDArray]:
    """A coarse ball: vertices, quadrangles, some of them without area, and normals."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n))
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    normals = np.stack([x, y, np.cos(theta)], axis=2).reshape(-1, 3)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(2 * n - 1), np.arange(n - 1), indexing="ij"))
    quads = np.stack([n * i + j, n * i + j + 1, n * (i + 1) + j + 1, n * (i + 1) + j], axis=1)
    return np.asarray(centre) + radius * normals, quads, normals


def obj(
    w: World, path: Path, vertices: NDArray, faces: NDArray, normals: NDArray | None = None
) -> str:
    """Write a mesh, of triangles or quadrangles; its file's name."""
    lines = ["v " + " ".join(repr(float(v)) for v in row) for row in w.points(vertices)]
    corner = "{0}" if normals is None else "{0}//{0}"
    if normals is not None:
        lines += ["vn " + " ".join(repr(float(v)) for v in row * [w.sign, 1, 1]) for row in normals]
    lines += ["f " + " ".join(corner.format(i + 1) for i in face) for face in w.faces(faces)]
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    return path.name


def picture(path: Path, pixels: NDArray) -> str:
    """Write (h, w, 3) pixels, linear in EXR and as they are in PNG; the file's name."""
    import mitsuba as mi

    from render.variant import two_threads

    bitmap = mi.Bitmap(np.asarray(pixels, np.float32))
    if path.suffix == ".png":
        bitmap = bitmap.convert(component_format=mi.Struct.Type.UInt8, srgb_gamma=False)
    with two_threads():
        bitmap.write(str(path))
    return path.name


def tiles(rng: np.random.Generator, size: int = 8, low: float = 0.2, high: float = 0.7) -> NDArray:
    """Coloured tiles."""
    return rng.uniform(low, high, (size, size, 3))
