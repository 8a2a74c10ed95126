"""Which surfaces can be observed: whose B(q) is light that the model of Eq. 2 sends there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import numpy as np


def left_out(scene: Any, known: Any) -> Iterator[tuple[int, str, str]]:
    """The shapes that are not observed, each with its place in the scene, its name and the reason.

    ``known`` is the scene with the emitters that are not to be found, or None.
    """
    emitting = [shape.is_emitter() for shape in known.shapes()] if known else []
    for place, shape in enumerate(scene.shapes()):
        kind = shape.class_name()
        if place < len(emitting) and emitting[place]:
            why = "emits light"
        elif not area_of(shape):
            why = f"is of type {kind}, whose area Mitsuba does not know"
        elif transmits(shape.bsdf().flags()):
            why = "is glass"
        elif not scatters(shape.bsdf().flags()):
            why = "is a mirror"
        else:
            continue
        yield place, name_of(shape, place), why


def name_of(shape: Any, place: int) -> str:
    """The shape by its id, or by its place and type where it has none."""
    own = shape.id()
    return f"shape '{own}'" if own else f"shape {place + 1} ({shape.class_name()})"


def area_of(shape: Any) -> float | None:
    """In the unit of length squared; None of an instance or a curve."""
    try:
        return float(np.array(shape.surface_area()).ravel()[0])
    except RuntimeError:  # not implemented
        return None


def scatters(flags: Any) -> Any:
    """Whether light from a point can be reflected to a viewer anywhere: a mirror does not do so."""
    kinds = mi.BSDFFlags
    return mi.has_flag(flags, kinds.DiffuseReflection) | mi.has_flag(flags, kinds.GlossyReflection)


def transmits(flags: Any) -> Any:
    """Whether light comes through the surface, too."""
    return (
        mi.has_flag(flags, mi.BSDFFlags.DiffuseTransmission)
        | mi.has_flag(flags, mi.BSDFFlags.GlossyTransmission)
        | mi.has_flag(flags, mi.BSDFFlags.DeltaTransmission)
    )


def two_sided(flags: Any) -> Any:
    """Whether the back reflects, too."""
    return mi.has_flag(flags, mi.BSDFFlags.BackSide)
