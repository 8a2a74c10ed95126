"""What a scene is made of on disk: its own file and all that it names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mitsuba as mi

from render.room import find, text_of
from render.variant import use_mitsuba

INCLUDED = re.compile(r"<include\s[^>]*filename=\"([^\"$]+)\"")


def files_of(path: str | Path, **parameters: Any) -> list[Path]:
    """List a scene's own file and the meshes, textures, spectra and scenes that it names.

    Parameters
    ----------
    path : str or Path
        An XML file, or the name of a standard scene.
    **parameters
        Values for the scene's own ``<default>`` names, as ``alpha=0.2``.

    Returns
    -------
    list of Path
        The scene's file first, then the others that exist, sorted.

    Raises
    ------
    ValueError
        If there is no such scene.
    RuntimeError
        Mitsuba's own, of a scene that it can't read.

    Examples
    --------
    >>> from render import files_of
    >>> [file.name for file in files_of("furnished")]
    ['furnished.xml', 'rounded_block.ply', 'torus.ply', 'vase.ply']
    """
    use_mitsuba()
    path = find(path)
    values = {name: text_of(value) for name, value in parameters.items()}
    scene = mi.parser.parse_file(mi.parser.ParserConfig(mi.variant()), str(path), **values)
    named = {
        str(node.props[key])
        for node in scene.nodes
        for key in node.props.keys()  # noqa: SIM118  (no mapping: it has keys alone)
        if node.props.type(key) == mi.Properties.Type.String
    }
    named |= set(INCLUDED.findall(path.read_text(errors="replace")))
    return [path, *sorted(file for name in named if (file := path.parent / name).is_file())]
