"""What a search is given: observations, what occludes, and options.

For other rooms, in pipeline order:

- `PointLights`: positions and radiant intensities; what is given as truth, and what is found.
- `Observations`: the set Q of section 3.1 with its radiance B(q) and standard errors.
- `Limits`: what a sensor's range and its steps hide of them.
- `limits_of`: that, as it is said or as the values tell it.
- `with_facing`: where neighbours are those on surfaces that face the same way.
- `clipped_in`: which values of a picture are clipped.
- `read_readings`: a light meter's or luminance meter's readings from a CSV file.
- `Geometry`: what occludes, as a value with two functions over Dr.Jit arrays.
- `Interreflecting`: one that can render the light between its surfaces too.
- `OtherwiseLit`: one that can render the light of known emitters.
- `remove_known`: the observations without that light.
- `RAY_OFFSET`: how far off a surface its shadow rays start, as a share of `reach`.
- `reach`: the lengths that the rounding of positions goes by.
- `Options`: what a user may want to set.
"""

from lightloc.given.geometry import RAY_OFFSET, Geometry, Interreflecting, OtherwiseLit, reach
from lightloc.given.known import remove_known
from lightloc.given.lights import PointLights
from lightloc.given.limits import Limits, clipped_in, limits_of, with_facing
from lightloc.given.observations import Observations
from lightloc.given.options import Options
from lightloc.given.readings import read_readings

__all__ = [
    "PointLights",
    "Observations",
    "Limits",
    "limits_of",
    "with_facing",
    "clipped_in",
    "read_readings",
    "Geometry",
    "Interreflecting",
    "OtherwiseLit",
    "remove_known",
    "RAY_OFFSET",
    "reach",
    "Options",
]
