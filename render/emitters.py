"""A scene's emitters: the point lights that are to be found, and all others, which are known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mitsuba as mi

from render.scene_file import SceneFile

POINT = "point"


def check_find(file: SceneFile, find: str | Sequence[str]) -> None:
    """Refuse what names no point emitter: "point" stands for all, or else each is one's id."""
    if find == POINT:
        return
    ids = [part.props.id() for node, _, part in _emitters(file) if _is_point(node, part)]
    if isinstance(find, str) or not all(isinstance(name, str) for name in find):
        raise ValueError(f"{file.path}: find is {find!r}; expected 'point' or a list of ids")
    for name in find:
        if name not in ids:
            named = ", ".join(own for own in ids if own) or "none that has an id"
            raise ValueError(f"{file.path}: has no point emitter '{name}' (it has: {named})")


def extinguish(file: SceneFile, find: str | Sequence[str], *, known: bool) -> int:
    """Take emitters out of a scene that is not built yet, and return how many.

    These are the known ones, or else the ones to be found: all of the scene's own point emitters
    where ``find`` is "point", or those with some ids.
    """
    out = [
        (node, key)
        for node, key, part in _emitters(file)
        if known != (_is_point(node, part) and (find == POINT or part.props.id() in find))
    ]
    for node, key in out:
        del node.props[key]
        kinds = [part.type for _, part in file.parts(node)]
        if node.type == mi.ObjectType.Shape and mi.ObjectType.BSDF not in kinds:
            # without a BSDF a lamp reflects nothing, any other shape does
            node.props["bsdf"] = mi.load_dict({"type": "diffuse", "reflectance": 0.0})
    return len(out)


def _emitters(file: SceneFile) -> list[tuple[Any, str, Any]]:
    """The node that has an emitter, the property by which, and the emitter's own node."""
    return [
        (node, key, part)
        for node in file.nodes()
        for key, part in file.parts(node)
        if part.type == mi.ObjectType.Emitter
    ]


def _is_point(node: Any, emitter: Any) -> bool:
    """Whether an emitter is one of the scene's own point lights."""
    return bool(node.type == mi.ObjectType.Scene and emitter.props.plugin_name() == POINT)
