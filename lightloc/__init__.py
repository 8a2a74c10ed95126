"""lightloc: find the point lights that light a room. The public names, in pipeline order."""

from lightloc import backend  # first: it chooses the LLVM library
from lightloc.brdf import BRDF, Conductor, Lambert, Mixed, Plastic
from lightloc.geometry import Geometry
from lightloc.lights import PointLights
from lightloc.observations import Observations
from lightloc.shading import check_gradient, radiance, shading, shading_gradient

__version__ = "0.1.0"

__all__ = [
    "BRDF",
    "Conductor",
    "Geometry",
    "Lambert",
    "Mixed",
    "Observations",
    "Plastic",
    "PointLights",
    "check_gradient",
    "radiance",
    "shading",
    "shading_gradient",
]
