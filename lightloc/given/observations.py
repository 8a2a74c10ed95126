"""Observations: what is known of the scene's surfaces, and how bright they look."""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import brdf
from lightloc.checks import array, check_radiance, numbers, unit_vectors
from lightloc.files import whole

FORMAT = "lightloc-observations-1"


@dataclass(frozen=True, eq=False)
class Observations:
    """The set Q of the paper's section 3.1 with its measured radiance B(q).

    Keyword Args:
        positions: (n, 3) points x on surfaces, metres.
        normals: (n, 3) shading normals on the side that is seen; normalized on entry.
        directions: (n, 3) from the surface to the viewer (the paper's omega).
        radiance: (n, c) B(q) in W sr^-1 m^-2, c = 1 or 3 (linear RGB); (n,) is taken as (n, 1).
            Below zero only where ``sigma`` is above: noise and light that was subtracted leave
            such values, and they are kept as they are.
        sigma: standard error of ``radiance``: a scalar, (n,) or (n, c); 0 where it is exact.
        material: a BRDF of `lightloc.brdf`, or anything with ``channels`` and ``bind``.
        facets: (n, 3) geometric normals where they differ from the shading normals, as on a mesh
            with smooth shading; light from below a facet does not reach it. ``normals`` where None.
        interreflected: whether ``radiance`` holds interreflected light too, as a camera's does;
            `localize` then removes it first (footnote 1).

    Raises:
        ValueError: no observation at all, lengths that differ, a value that is not finite, a
            negative sigma, a negative radiance that is exact, a vector of length zero.

    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.3], sigma=0.0, material=brdf.Lambert(albedo=0.5))
    >>> len(q), q.channels
    (1, 1)
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    directions: NDArray[np.float64]
    radiance: NDArray[np.float64]
    sigma: NDArray[np.float64]
    material: brdf.BRDF
    facets: NDArray[np.float64]
    interreflected: bool

    def __init__(
        self,
        *,
        positions: ArrayLike,
        normals: ArrayLike,
        directions: ArrayLike,
        radiance: ArrayLike,
        sigma: ArrayLike = 0.0,
        material: brdf.BRDF,
        facets: ArrayLike | None = None,
        interreflected: bool = False,
    ) -> None:
        x = array("Observations.positions", positions, (None, 3))
        n = len(x)
        if n == 0:
            raise ValueError("Observations are empty; expected at least one observed point")
        put = object.__setattr__
        put(self, "positions", x)
        put(self, "normals", unit_vectors("Observations.normals", normals, n))
        put(self, "directions", unit_vectors("Observations.directions", directions, n))
        put(self, "radiance", _per_channel("Observations.radiance", radiance, n, None, None))
        put(self, "sigma", _per_channel("Observations.sigma", sigma, n, self.channels, 0.0))
        check_radiance("Observations.radiance", self.radiance, self.sigma)
        if not brdf.is_brdf(material):
            raise ValueError(f"Observations.material is a {type(material).__name__}; not a BRDF")
        if material.channels > self.channels:
            raise ValueError("Observations.radiance has 1 channel but the material has 3")
        if isinstance(material, (brdf.Mixed, *MODELS)):
            material.check_length(n)
        put(self, "material", material)
        facets = self.normals if facets is None else facets
        put(self, "facets", unit_vectors("Observations.facets", facets, n))
        put(self, "interreflected", bool(interreflected))

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def channels(self) -> int:
        return self.radiance.shape[1]

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3): lower and upper corner of the observed points, metres."""
        return np.array([self.positions.min(axis=0), self.positions.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal, metres."""
        return float(np.linalg.norm(np.diff(self.bounds, axis=0)))

    def with_radiance(
        self, radiance: ArrayLike, sigma: ArrayLike, interreflected: bool | None = None
    ) -> Observations:
        """The same points with another B(q): a scalar, (n,) or (n, c), as ``sigma``."""
        n, c = self.radiance.shape
        B = _per_channel("Observations.radiance", radiance, n, c, None)
        e = _per_channel("Observations.sigma", sigma, n, c, 0.0)
        both = self.interreflected if interreflected is None else interreflected
        return replace(self, radiance=B, sigma=e, interreflected=both)

    def save(self, path: str | Path) -> None:
        """Write one ``.npz``, whole or not at all: same observations, same bytes.

        Keys: ``format``; ``positions``, ``normals``, ``directions``, ``radiance``, ``sigma`` and
        ``facets`` (may be left out) as above, float64; ``interreflected``, bool; ``material`` a
        type name, its parameters as ``material.NAME``; for ``Mixed``, ``material.index`` and the
        parts under ``material.0``, ``material.1`` ...
        """
        keys: dict[str, Any] = {"format": np.array(FORMAT)}
        for name in ("positions", "normals", "directions", "radiance", "sigma", "facets"):
            keys[name] = getattr(self, name)
        keys["interreflected"] = np.array(self.interreflected)
        keys.update(_material_keys("material", self.material))
        with whole(path) as part, open(part, "wb") as file:
            np.savez_compressed(file, **keys)

    @staticmethod
    def load(path: str | Path) -> Observations:
        """Read what `save` wrote.

        A material that only its scene can give (a BSDF that `lightloc` does not model) comes
        back as `SceneMaterial`; `render.attach` puts the scene's own in its place.
        Raises ValueError naming the file and the field.
        """
        try:
            # our own handle: np.load leaves one open where the archive is broken
            with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as file:
                keys = {name: file[name] for name in file.files}
        except FileNotFoundError:
            raise ValueError(f"{path}: no such file") from None
        except UNREADABLE:
            raise ValueError(f"{path}: not an observations file (.npz)") from None
        if str(keys.get("format")) != FORMAT:
            found = keys.get("format")
            said = "it names no format" if found is None else f"its format is '{found}'"
            raise ValueError(f"{path}: no observations file: {said}; expected {FORMAT}")
        try:
            return Observations(
                positions=keys["positions"],
                normals=keys["normals"],
                directions=keys["directions"],
                radiance=keys["radiance"],
                sigma=keys["sigma"],
                material=_material_from("material", keys),
                facets=keys.get("facets"),
                interreflected=bool(keys["interreflected"]),
            )
        except KeyError as missing:
            raise ValueError(f"{path}: field {missing} is missing") from None
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None


UNREADABLE = (  # what np.load, zipfile and zlib say of a file that is cut short or changed
    OSError,
    ValueError,
    TypeError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


@dataclass(frozen=True)
class SceneMaterial:
    """Stands in a file for a BSDF that only its scene can evaluate; see `render.attach`."""

    channels: int = 1

    def bind(self, n: int) -> brdf.Scatter:
        raise ValueError("these observations use a BSDF of their scene; name the scene as well")


def _per_channel(
    name: str, value: ArrayLike, n: int, c: int | None, least: float | None
) -> NDArray[np.float64]:
    result = numbers(name, value)
    if result.ndim == 0 and c is not None:
        result = np.broadcast_to(result, (n, c))
    elif result.ndim == 1:
        result = result[:, None]
    if c is not None and result.ndim == 2 and result.shape[1] == 1:
        result = np.broadcast_to(result, (len(result), c))
    result = array(name, result, (n, c), least=least)
    if result.shape[1] not in (1, 3):
        raise ValueError(f"{name} has {result.shape[1]} channels; expected 1 or 3")
    return result


def _material_keys(prefix: str, material: brdf.BRDF) -> dict[str, Any]:
    if isinstance(material, brdf.Mixed):
        keys = {prefix: np.array("Mixed"), f"{prefix}.index": material.index}
        for b, part in enumerate(material.brdfs):
            keys.update(_material_keys(f"{prefix}.{b}", part))
        return keys
    if isinstance(material, MODELS):
        named = {f"{prefix}.{name}": value for name, value in material.parameters().items()}
        return {prefix: np.array(type(material).__name__), **named}
    return {
        prefix: np.array("SceneMaterial"),
        f"{prefix}.channels": np.array(material.channels),
    }


def _material_from(prefix: str, keys: dict[str, Any]) -> brdf.BRDF:
    kind = str(keys[prefix])
    if kind == "Mixed":
        count = int(keys[f"{prefix}.index"].max()) + 1
        while f"{prefix}.{count}" in keys:
            count += 1
        parts = tuple(_material_from(f"{prefix}.{b}", keys) for b in range(count))
        return brdf.Mixed(parts, keys[f"{prefix}.index"])
    if kind == "SceneMaterial":
        return SceneMaterial(int(keys[f"{prefix}.channels"]))
    for model in MODELS:
        if kind == model.__name__:
            named = {field.name: f"{prefix}.{field.name}" for field in fields(model)}
            needed = {field.name for field in fields(model) if field.default is MISSING}
            return model(**{k: keys[v] for k, v in named.items() if k in needed or v in keys})
    raise ValueError(f"{prefix} is '{kind}'; expected one of Lambert, Conductor, Plastic, Mixed")


MODELS = (brdf.Lambert, brdf.Conductor, brdf.Plastic)
