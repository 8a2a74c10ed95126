"""A scene's surfaces, as lightloc asks for them: rays, and the light between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import Observations, PointLights
from lightloc.checks import array, number
from render.alone import alone
from render.material import children, is_grey
from render.transport import (
    SHADOW_EPSILON,
    Transport,
    bounds_of,
    indirect,
    irradiance,
    known_light,
    probe,
)

LIGHT = "lightloc_light_{}"  # ids of the lights in a scene that is lit anew; no file has them

STREAM = 0x1D17EC7
"""Goes into every seed: the same paths as in `observe` would carry its errors, and hide them."""


@dataclass(frozen=True)
class SceneGeometry:
    """A scene's surfaces as a `lightloc.Geometry`, which can render light between them too.

    Parameters
    ----------
    scene : mitsuba.Scene
        The scene as Mitsuba has it.
    known : mitsuba.Scene, optional
        The same surfaces under emitters that are not to be found.

    Examples
    --------
    In a box of height 2.5, one point sees another inside it, and none above it:

    >>> from lightloc.backend import types
    >>> from render import load
    >>> f = types()
    >>> inside = load("box_one").geometry
    >>> inside.visible(f.Array3f(1, 1, 1), f.Array3f(1, 1, [2, 3])).numpy().tolist()
    [True, False]
    """

    scene: Any = field(repr=False)
    known: Any = field(default=None, repr=False)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) corners of the surfaces' bounding box, in the unit of length."""
        return bounds_of(self.scene)

    @alone
    def visible(self, x: Any, p: Any, active: Any = True) -> Any:
        """As of `lightloc.Geometry`; the last 0.09 % before p do not count, as in Mitsuba."""
        d = mi.Vector3f(p - x)
        distance = dr.norm(d)
        ray = mi.Ray3f(mi.Point3f(x), d / distance, distance * (1 - SHADOW_EPSILON), 0, [])
        return ~self.scene.ray_test(ray, mi.Mask(active)) & active

    @alone
    def intersect(self, x: Any, d: Any, active: Any = True) -> tuple[Any, Any]:
        """As of `lightloc.Geometry`; y is x where the ray meets nothing."""
        ray = mi.Ray3f(mi.Point3f(x), mi.Vector3f(d))
        hit = self.scene.ray_intersect_preliminary(ray, coherent=False, active=mi.Mask(active))
        return hit.is_valid() & active, ray(dr.select(hit.is_valid(), hit.t, 0))

    @alone
    def known_light(
        self, observations: Observations, samples: int = 256, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As of `lightloc.OtherwiseLit`: rendered by Mitsuba; zero where there is none.

        Raises ValueError where there are fewer than two samples, or the observations have one
        channel where the light has colours.
        """
        q = observations
        number("samples of known light", samples, 2, whole=True)
        if self.known is None:
            none = np.zeros((len(q), q.channels))
            return none, none
        own = int(np.random.SeedSequence([STREAM, seed]).generate_state(1)[0])
        x = q.positions
        if q.quantity == "irradiance":
            B, error = irradiance(
                self.known,
                x,
                q.normals,
                samples,
                own,
                straight=True,
                bounced=q.interreflected,
                max_depth=q.max_depth,
            )
        else:
            transport: Transport = "full" if q.interreflected else "direct"
            B, error = known_light(
                self.known, x, q.directions, samples, own, transport, max_depth=q.max_depth
            )
        if q.channels < 3 and not is_grey(B):
            raise ValueError(
                "the scene's known light has colours; expected observations with 3 channels"
            )
        return B[:, : q.channels], error[:, : q.channels]

    @alone
    def interreflection(
        self, positions: ArrayLike, observations: Observations, samples: int = 256, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As of `lightloc.Interreflecting`: paths that Mitsuba traces, so that any BSDF serves.

        The errors are independent of those of the observations. Raises ValueError where there are
        fewer than two samples, or a position is not finite.
        """
        q = observations
        number("samples of interreflected light", samples, 2, whole=True)
        places = array("positions", positions, (None, 3))
        meters = q.quantity == "irradiance"
        si = None if meters else probe(self.scene, q.positions, q.directions)
        H, error = np.zeros((2, len(q), len(places), q.channels))
        for i, p in enumerate(places):
            alone = self._one_light.at(p)
            own = int(np.random.SeedSequence([STREAM, seed, i]).generate_state(1)[0])
            if meters:
                mean, spread = irradiance(
                    alone,
                    q.positions,
                    q.normals,
                    samples,
                    own,
                    straight=False,
                    bounced=True,
                    max_depth=q.max_depth,
                )
            else:
                mean, spread = indirect(alone, si, samples, own, max_depth=q.max_depth)
            H[:, i], error[:, i] = mean[:, : q.channels], spread[:, : q.channels]
        return H, error

    @cached_property
    def _one_light(self) -> OneLight:
        """The same surfaces lit by one light, which is moved: rays need their tree only once."""
        return OneLight.over(self.scene)


@dataclass(frozen=True)
class OneLight:
    """A scene lit by one point light of intensity 1 that can be put anywhere.

    Parameters
    ----------
    scene : mitsuba.Scene
        The scene.
    parameters : mitsuba.SceneParameters
        What can be changed in it.
    key : str
        The light's position among them.
    """

    scene: Any
    parameters: Any
    key: str

    @staticmethod
    def over(scene: Any) -> OneLight:
        """The same surfaces, their own emitters left out."""
        alone = lit(scene, PointLights([[0.0, 0.0, 0.0]], [1.0]))
        key = f"{LIGHT.format(1)}.position"
        parameters = mi.traverse(alone)
        parameters.keep([key])
        return OneLight(alone, parameters, key)

    def at(self, p: NDArray[np.float64]) -> Any:
        """The scene with the light at (3,) p, until it is moved again."""
        self.parameters[self.key] = mi.Point3f(*p.tolist())
        self.parameters.update()
        return self.scene


def lit(scene: Any, lights: PointLights) -> Any:
    """The same scene lit by other point lights; its sensors and surfaces are shared."""
    shared = [part for part in children(scene).values() if isinstance(part, mi.Shape | mi.Sensor)]
    names = [part.id() for part in shared]
    parts: dict[str, Any] = {"type": "scene"}
    parts |= {f"part_{i}": part for i, part in enumerate(shared)}
    for i, (p, I) in enumerate(zip(lights.positions, lights.intensities, strict=True), start=1):
        parts[LIGHT.format(i)] = {
            "type": "point",
            "position": p.tolist(),
            "intensity": {"type": "rgb", "value": np.broadcast_to(I, 3).tolist()},
        }
    try:
        return mi.load_dict(parts, optimize=False)
    finally:  # a key becomes its object's id, in both scenes; a file's ids may be no keys
        for part, name in zip(shared, names, strict=True):
            part.set_id(name)
