"""A scene's surfaces, as lightloc asks for them: rays, and the light between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import Observations, PointLights
from lightloc.checks import array
from render.transport import indirect, probe

SHADOW_EPSILON = 8.9e-4  # share of a shadow ray left out at its far end, as in Mitsuba

STREAM = 0x1D17EC7
"""Goes into every seed: the same paths as in `observe` would carry its errors, and hide them."""


@dataclass(frozen=True)
class SceneGeometry:
    """A scene's surfaces as the two questions of `lightloc.Geometry`."""

    scene: Any = field(repr=False)

    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """Whether the open segment from x to p is free; (Array3f, Array3f) -> Bool."""
        d = mi.Vector3f(p - x)
        distance = dr.norm(d)
        ray = mi.Ray3f(mi.Point3f(x), d / distance, distance * (1 - SHADOW_EPSILON), 0, [])
        return ~self.scene.ray_test(ray, mi.Mask(active)) & active

    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """First hit of the ray x + t d: (Bool, Array3f)."""
        ray = mi.Ray3f(mi.Point3f(x), mi.Vector3f(d))
        hit = self.scene.ray_intersect_preliminary(ray, coherent=False, active=mi.Mask(active))
        return hit.is_valid() & active, ray(dr.select(hit.is_valid(), hit.t, 0))

    def interreflection(
        self, positions: ArrayLike, observations: Observations, samples: int = 256, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Interreflected radiance of a light of intensity 1 at each of (k, 3) positions.

        Parameters
        ----------
        positions : (k, 3) array
            In the unit of length.
        observations : Observations
            Where it is seen from, and what.
        samples : int
            Paths per observation and light.
        seed : int
            Of the paths. The i-th light has the same ones in every call, wherever it is, so that
            the result moves with the light and not with chance.

        Returns
        -------
        H, error : (n, k, c) arrays
            ``H @ intensities`` is the interreflected radiance of lights there, m^-2 sr^-1 per
            W/sr; its standard error, independent from light to light and of those of
            ``observations``.

        Raises
        ------
        ValueError
            There are fewer than two samples, or the observations are irradiance.
        """
        q = observations
        if samples < 2:
            raise ValueError(f"interreflected light takes at least 2 samples; got {samples}")
        if q.quantity == "irradiance":
            raise ValueError("interreflected irradiance can't be rendered, only radiance")
        places = array("positions", positions, (None, 3))
        si = probe(self.scene, q.positions, q.directions)
        H, error = np.zeros((2, len(q), len(places), q.channels))
        for i, p in enumerate(places):
            alone = lit(self.scene, PointLights(p[None], [1.0]))
            own = int(np.random.SeedSequence([STREAM, seed, i]).generate_state(1)[0])
            mean, spread = indirect(alone, si, samples, own)
            H[:, i], error[:, i] = mean[:, : q.channels], spread[:, : q.channels]
        return H, error


def lit(scene: Any, lights: PointLights) -> Any:
    """The same scene lit by other point lights; its sensors and surfaces are shared."""
    parts: dict[str, Any] = {"type": "scene"}
    for kind, objects in (("shape", scene.shapes()), ("sensor", scene.sensors())):
        # the key becomes the object's id, in both scenes: they share the object
        parts |= {thing.id() or f"{kind}_{i}": thing for i, thing in enumerate(objects)}
    for i, (p, I) in enumerate(zip(lights.positions, lights.intensities, strict=True), start=1):
        parts[f"light_{i}"] = {
            "type": "point",
            "position": p.tolist(),
            "intensity": {"type": "rgb", "value": np.broadcast_to(I, 3).tolist()},
        }
    return mi.load_dict(parts, optimize=False)
