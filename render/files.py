"""What a scene is made of on disk: its own file and all that it names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from render.mesh_scene import is_mesh, mesh_files
from render.room import find_file
from render.scene_file import SceneFile
from render.variant import use_mitsuba


def files_of(path: str | Path, **parameters: Any) -> list[Path]:
    """List a scene's own file and the meshes, textures, spectra and scenes that it names.

    Parameters
    ----------
    path : str or Path
        An XML file, a mesh, or the name of a standard scene.
    **parameters
        Values for the names that the scene uses as ``$alpha``, as ``alpha=0.2``.

    Returns
    -------
    list of Path
        The scene's file first, then the others that exist, sorted.

    Raises
    ------
    ValueError
        If there is no such scene, Mitsuba can't read it, or a parameter is unknown.

    Examples
    --------
    >>> from render import files_of
    >>> [file.name for file in files_of("furnished")]
    ['furnished.xml', 'rounded_block.ply', 'torus.ply', 'vase.ply']
    """
    use_mitsuba()
    path = find_file(path)
    return mesh_files(path) if is_mesh(path) else SceneFile.read(path, parameters).files()
