"""What a search is given: observations, what occludes, and options.

For other rooms, in pipeline order:

- `PointLights`: positions and radiant intensities; what is given as truth, and what is found.
- `Observations`: the set Q of section 3.1 with its radiance B(q) and standard errors.
- `SceneMaterial`: stands in a file for a BSDF that only its scene can evaluate.
- `Geometry`: what occludes, a value with two functions over Dr.Jit arrays.
- `RAY_OFFSET`: how far off a surface its shadow rays start.
- `Options`: what a user may want to set.
"""

from lightloc.given.geometry import RAY_OFFSET, Geometry
from lightloc.given.lights import PointLights
from lightloc.given.observations import Observations, SceneMaterial
from lightloc.given.options import Options

__all__ = [
    "PointLights",
    "Observations",
    "SceneMaterial",
    "Geometry",
    "RAY_OFFSET",
    "Options",
]
