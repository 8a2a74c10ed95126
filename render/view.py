"""A camera's view as a value: what each pixel shows, and how bright."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import BRDF, Conductor, Lambert, Mixed, Plastic
from lightloc.checks import array, check_radiance

DIFFUSE = 0.0  # roughness of a surface that is Lambert: it has no lobe to be rough
OTHER = -1.0  # roughness where the BSDF is none of lightloc's; only the scene knows it
NOTHING = -1  # shape index where the ray leaves the scene
UNIT = 1.001  # the most that a unit vector's component may be


@dataclass(frozen=True)
class View:
    """Layers of (height, width) pixels; each but ``film`` is for the ray through its centre.

    All by keyword; kept as read-only float32 arrays, but for ``shape`` and ``pure``.

    Keyword Args:
        radiance: (h, w, 3) B towards the camera, W sr^-1 m^-2, linear RGB; below 0 only
            where ``variance`` is above, as a denoiser's may be.
        variance: (h, w, 3) of the mean ``radiance``, its unit squared; 0 where that is exact.
        position: (h, w, 3) metres.
        normal: (h, w, 3) unit shading normal on the side that is seen.
        facet: (h, w, 3) unit geometric normal on that side; ``normal`` but for smooth meshes.
        albedo: (h, w, 3) of the diffuse part; 0 for metal.
        roughness: (h, w) GGX alpha; `DIFFUSE` (0) for Lambert, `OTHER` (-1) for an unknown BSDF.
        shape: (h, w) int32, the shape's place in the scene; `NOTHING` (-1) where the ray misses,
            and there the other layers are 0.
        pure: (h, w) bool, whether the pixel's whole footprint is one smooth piece of one surface
            with one BRDF. A mixed pixel is no observation.
        film: (h, w, 3) radiance averaged over the pixel (box filter), where indirect with less
            noise: the picture to look at, not to measure.
        camera: (3,) the pinhole, metres.
        interreflected: whether the radiance holds interreflected light too.

    Raises:
        ValueError: a shape does not fit, a value is not finite or out of range.
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
        """(h, w): the pixels that become observations, in this order, row by row."""
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
