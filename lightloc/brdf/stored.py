"""Materials of files: as arrays by name, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf.mixed import Mixed
from lightloc.brdf.parameters import Parameters
from lightloc.brdf.parts import Parts
from lightloc.brdf.protocol import BRDF, Scatter
from lightloc.brdf.sum import Sum


@dataclass(frozen=True)
class SceneMaterial:
    """Stands in a file for a BSDF that only its scene can evaluate; see `render.attach`."""

    channels: int = 1

    def bind(self, n: int) -> Scatter:
        raise ValueError("these observations use a BSDF of their scene; name the scene as well")


def stored(prefix: str, material: BRDF) -> dict[str, NDArray[Any]]:
    """A material as arrays: its type's name under ``prefix``, parameters under ``prefix.NAME``.

    The name has the shape (), a parameter the shape that its material keeps: (1 or n, 1 or 3).

    Examples
    --------
    >>> from lightloc.brdf import Lambert
    >>> sorted(stored("material", Lambert(albedo=0.5)))
    ['material', 'material.albedo']
    """
    if isinstance(material, Parts):
        keys = {prefix: np.array(type(material).__name__)}
        if isinstance(material, Mixed):
            keys[f"{prefix}.index"] = material.index
        for b, part in enumerate(material.brdfs):
            keys |= stored(f"{prefix}.{b}", part)
        return keys
    if isinstance(material, Parameters):
        named = {f"{prefix}.{name}": value for name, value in material.parameters().items()}
        return {prefix: np.array(type(material).__name__), **named}
    return {
        prefix: np.array("SceneMaterial"),
        f"{prefix}.channels": np.array(material.channels),
    }


def restored(prefix: str, keys: Mapping[str, NDArray[Any]]) -> BRDF:
    """The material that `stored` made arrays of, each of the shape that it gave.

    Raises KeyError or ValueError where they are no material.

    Examples
    --------
    >>> from lightloc.brdf import Lambert
    >>> float(restored("material", stored("material", Lambert(albedo=0.5))).albedo[0, 0])
    0.5
    """
    kind = str(keys[prefix])
    if kind in ("Mixed", "Sum"):
        count = int(keys[f"{prefix}.index"].max()) + 1 if kind == "Mixed" else 1
        while f"{prefix}.{count}" in keys:
            count += 1
        parts = tuple(restored(f"{prefix}.{b}", keys) for b in range(count))
        return Mixed(parts, keys[f"{prefix}.index"]) if kind == "Mixed" else Sum(parts)
    if kind == "SceneMaterial":
        return SceneMaterial(int(keys[f"{prefix}.channels"]))
    for model in models():
        if kind == model.__name__:
            own = [field for field in fields(model) if field.init]  # type: ignore[arg-type]
            named = {field.name: f"{prefix}.{field.name}" for field in own}
            needed = {field.name for field in own if field.default is MISSING}
            given = {k: keys[v] for k, v in named.items() if k in needed or v in keys}
            return model(**given)  # type: ignore[return-value]
    names = ", ".join(model.__name__ for model in models())
    raise ValueError(f"{prefix} is '{kind}'; expected one of {names}, Mixed, Sum")


def models(of: type[Parameters] = Parameters) -> list[type[Parameters]]:
    """All materials whose fields are numbers."""
    return [each for model in of.__subclasses__() for each in (model, *models(model))]
