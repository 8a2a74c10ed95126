"""Instances and merged shapes of a scene file, as the shapes that they stand for."""

from __future__ import annotations

import os
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.scene_file import SceneFile, references

COPIES = 1000  # of shapes, at most; and of bytes of their files
COPIED = 1 << 28
BENT = 1e-4  # share by which a scale may differ along axes, or axes from a right angle
ANY_AFFINE = ("ply", "obj", "serialized", "cube")
UPRIGHT = "rectangle"  # it may be longer than wide


def expand(file: SceneFile) -> None:
    """Put shapes in the place of what Mitsuba merges or repeats: it samples no such thing.

    Instances stay where they are too many, or a copy would be another surface: one that is mirrored
    or, unless it is a mesh, sheared.
    """
    for node in file.nodes():
        while merged := next((m for m in _of(file, node, "merge") if _is_plain(m[1])), None):
            _put(node, merged[0], [number for _, number in references(merged[1])])
    instances = [(key, one, _group(file, one)) for key, one in _of(file, file.root, "instance")]
    copied = [part for *_, group in instances for part in group]
    if len(copied) > COPIES or sum(_bytes(file, part) for part in copied) > COPIED:
        return
    more: list[Any] = []  # a list of Mitsuba's that grows forgets the nodes that Python holds
    for key, one, group in instances:
        own = _matrix(one)
        if not group or not all(_can_be(own @ _matrix(part), own, part) for part in group):
            continue
        numbers = []
        for part in group:
            copy = _copy(file, part, more)
            copy.props["to_world"] = mi.ScalarAffineTransform4d(own @ _matrix(part))
            name, within = one.props.id(), part.props.id()
            copy.props.set_id(f"{name}.{within}" if name and len(group) > 1 else name)
            numbers.append(_kept(file, copy, more))
        _put(file.root, key, numbers)
    file.state.nodes.extend(more)
    if not _of(file, file.root, "instance"):
        for key, _ in _of(file, file.root, "shapegroup"):
            del file.root.props[key]


def _of(file: SceneFile, node: Any, plugin: str) -> list[tuple[str, Any]]:
    """The parts of a node that are of a type."""
    return [(key, part) for key, part in file.parts(node) if part.props.plugin_name() == plugin]


def _is_plain(merged: Any) -> bool:
    """Whether a merged shape has parts alone; what else it has Mitsuba does not know."""
    return len(references(merged)) == len(list(merged.props.keys()))


def _group(file: SceneFile, instance: Any) -> list[Any]:
    """The shapes that an instance repeats; [] of one that is broken, which Mitsuba refuses."""
    groups = [part for _, part in file.parts(instance)]
    if len(groups) != 1 or groups[0].props.plugin_name() != "shapegroup":
        return []
    return [part for _, part in file.parts(groups[0]) if part.type == mi.ObjectType.Shape]


def _bytes(file: SceneFile, part: Any) -> int:
    """The size of the file that a shape is read from, each time."""
    name = mi.Properties(part.props).get("filename", "")  # a copy: what is read counts as known
    found = file.find(str(name))
    return found.stat().st_size if name and os.path.isfile(found) else 0


def _matrix(node: Any) -> NDArray[np.float64]:
    own = node.props.get("to_world", None)
    return np.eye(4) if own is None else np.array(own.matrix, float)


def _can_be(matrix: NDArray, own: NDArray, part: Any) -> bool:
    """Whether a shape may have that transform, of which an instance adds its own."""
    if not np.isfinite(matrix).all() or np.linalg.det(own[:3, :3]) <= 0:
        return False
    if part.props.plugin_name() in ANY_AFFINE:
        return True
    a = matrix[:3, :3]
    inner = a.T @ a
    sizes = np.diag(inner)
    upright = np.abs(inner - np.diag(sizes)).max() < BENT * sizes.min()
    alike = part.props.plugin_name() == UPRIGHT or np.ptp(sizes) < BENT * sizes.min()
    return bool(upright and alike)


def _put(parent: Any, key: str, numbers: list[int]) -> None:
    """Have a node refer to others in the place of one."""
    del parent.props[key]
    for i, number in enumerate(numbers):
        parent.props[f"{key}_{i}"] = mi.Properties.ResolvedReference(number)


def _copy(file: SceneFile, node: Any, more: list[Any]) -> Any:
    """A node that refers to what the other does, but for its emitter, which must be its own."""
    copy = mi.parser.SceneNode(node)
    for key, number in references(node):
        if file.state.nodes[number].type == mi.ObjectType.Emitter:
            lamp = mi.parser.SceneNode(file.state.nodes[number])
            copy.props[key] = mi.Properties.ResolvedReference(_kept(file, lamp, more))
    return copy


def _kept(file: SceneFile, node: Any, more: list[Any]) -> int:
    """Keep a new node, and return the number that it will have."""
    more.append(node)
    return len(file.state.nodes) + len(more) - 1
