"""A camera's view as a value: what each pixel shows, and how bright."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import BRDF, Conductor, Lambert, Mixed, Plastic
from lightloc.checks import array, check_radiance, unit_word

DIFFUSE = 0.0  # roughness of a surface that is Lambert: it has no lobe to be rough
OTHER = -1.0  # roughness where the BSDF is none of lightloc's; only the scene knows it
NOTHING = -1  # shape index where the ray leaves the scene
UNIT = 1.001  # the most that a unit vector's component may be


@dataclass(frozen=True)
class View:
    """What a camera sees: layers of (height, width) pixels.

    Each layer but ``film`` is for the ray through the pixel's centre. Layers are given by keyword,
    and kept as read-only float32 arrays, but for ``shape`` and ``pure``.

    Parameters
    ----------
    radiance : (h, w, 3) array_like
        B towards the camera, W sr^-1 m^-2, linear RGB; below 0 only where ``variance`` is above, as
        a denoiser's may be.
    variance : (h, w, 3) array_like
        Variance of the mean ``radiance``, its unit squared; 0 where that is exact.
    position : (h, w, 3) array_like
        The point that is seen, in the unit of length.
    normal : (h, w, 3) array_like
        Unit shading normal on the side that is seen.
    facet : (h, w, 3) array_like
        Unit geometric normal on that side; ``normal`` but for smooth meshes.
    albedo : (h, w, 3) array_like
        Albedo of the diffuse part; 0 for metal.
    roughness : (h, w) array_like
        GGX alpha; 0 for Lambert, -1 for a BSDF that lightloc does not model.
    shape : (h, w) array_like of int
        The shape's place in the scene; -1 where the ray misses, and there the other layers are 0.
    pure : (h, w) array_like of bool
        Whether the pixel's whole footprint is one smooth piece of one surface with one BRDF. A
        mixed pixel is no observation.
    film : (h, w, 3) array_like
        Radiance averaged over the pixel (box filter), W sr^-1 m^-2, its indirect part with less
        noise: the picture to look at, not to measure.
    camera : (3,) array_like
        The pinhole, in the unit of length.
    interreflected : bool
        Whether the radiance holds interreflected light too.
    unit : str
        The unit of length, a word; "unit" where nobody has said which it is.

    Raises
    ------
    ValueError
        If a shape does not fit, a value is not finite or out of range, or ``unit`` is no word.

    Examples
    --------
    >>> from render import load, photograph
    >>> view = photograph(load("box_one"), width=8, transport="direct")
    >>> view.size, view.radiance.shape
    ((8, 6), (6, 8, 3))
    >>> towards_camera = view.camera - view.position
    >>> bool(((view.normal * towards_camera).sum(axis=2) > 0).all())  # the side that is seen
    True
    """

    radiance: NDArray[np.float32]
    variance: NDArray[np.float32]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    facet: NDArray[np.float32]
    albedo: NDArray[np.float32]
    roughness: NDArray[np.float32]
    shape: NDArray[np.int32]
    pure: NDArray[np.bool_]
    film: NDArray[np.float32]
    camera: NDArray[np.float32]
    interreflected: bool
    unit: str

    def __init__(
        self,
        *,
        radiance: ArrayLike,
        variance: ArrayLike,
        position: ArrayLike,
        normal: ArrayLike,
        facet: ArrayLike,
        albedo: ArrayLike,
        roughness: ArrayLike,
        shape: ArrayLike,
        pure: ArrayLike,
        film: ArrayLike,
        camera: ArrayLike,
        interreflected: bool,
        unit: str = "m",
    ) -> None:
        first = array("View.radiance", radiance, (None, None, 3))
        h, w = first.shape[:2]
        colour, scalar = (h, w, 3), (h, w)
        index = array("View.shape", shape, scalar, least=NOTHING)
        whole = array("View.pure", pure, scalar, least=0.0, most=1.0)
        for name, values in (("shape", index), ("pure", whole)):
            if (values % 1).any():
                raise ValueError(f"View.{name} holds fractions; expected whole numbers")
        self._put("radiance", first)
        self._put("variance", array("View.variance", variance, colour, least=0.0))
        check_radiance("View.radiance", self.radiance, self.variance)
        self._put("position", array("View.position", position, colour))
        self._put("normal", array("View.normal", normal, colour, least=-UNIT, most=UNIT))
        self._put("facet", array("View.facet", facet, colour, least=-UNIT, most=UNIT))
        self._put("albedo", array("View.albedo", albedo, colour, least=0.0))
        self._put("roughness", array("View.roughness", roughness, scalar, least=OTHER))
        self._put("shape", index, np.int32)
        self._put("pure", whole, np.bool_)
        self._put("film", array("View.film", film, colour, least=0.0))
        self._put("camera", array("View.camera", camera, (3,)))
        object.__setattr__(self, "interreflected", bool(interreflected))
        object.__setattr__(self, "unit", unit_word("View.unit", unit))

    def _put(self, name: str, value: NDArray, kind: type = np.float32) -> None:
        value = value.astype(kind)
        value.setflags(write=False)
        object.__setattr__(self, name, value)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        height, width = self.radiance.shape[:2]
        return width, height

    @property
    def used(self) -> NDArray[np.bool_]:
        """(h, w) bool: the pixels that become observations, row by row."""
        return self.pure & (self.shape != NOTHING)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, View) and all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)
        )


def appearance(material: BRDF, n: int) -> tuple[NDArray, NDArray]:
    """The albedo (n, 3) and roughness (n,) layers of a BRDF at n points."""
    albedo, roughness = np.zeros((n, 3)), np.full(n, OTHER)
    parts = material.brdfs if isinstance(material, Mixed) else (material,)
    index = material.index if isinstance(material, Mixed) else np.zeros(n, int)
    for b, part in enumerate(parts):
        here = index == b
        if isinstance(part, Lambert):
            albedo[here] = np.broadcast_to(part.albedo, (n, 3))[here]
            roughness[here] = DIFFUSE
        elif isinstance(part, Plastic):
            albedo[here] = np.broadcast_to(part.diffuse, (n, 3))[here]
        if isinstance(part, Plastic | Conductor):
            roughness[here] = np.broadcast_to(part.alpha[:, 0], n)[here]
    return albedo, roughness
