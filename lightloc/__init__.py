"""lightloc: find the point lights that light a room. The public names, in pipeline order."""

import lightloc.backend  # noqa: F401  (first: it chooses the LLVM library)
from lightloc.brdf import BRDF, Conductor, Lambert, Mixed, Plastic
from lightloc.certainty import Bound, cramer_rao
from lightloc.fields import Grid, intensity, intensity_distance
from lightloc.geometry import Geometry
from lightloc.indirect import remove_indirect
from lightloc.lights import PointLights
from lightloc.localize import localize
from lightloc.observations import Observations
from lightloc.options import Options
from lightloc.outline import Outline
from lightloc.paper import Paper
from lightloc.result import Localization, Reason
from lightloc.shading import check_gradient, radiance, shading, shading_gradient
from lightloc.surface import Geodesic, Perimeter, SolidAngle, Surface
from lightloc.verdicts import Kind, Verdict
from lightloc.voting import Votes, vote

__version__ = "0.1.0"

__all__ = [  # in pipeline order
    "PointLights",
    "Lambert",
    "Conductor",
    "Plastic",
    "Mixed",
    "BRDF",
    "Observations",
    "Geometry",
    "remove_indirect",
    "shading",
    "shading_gradient",
    "check_gradient",
    "radiance",
    "Grid",
    "intensity",
    "intensity_distance",
    "Outline",
    "Surface",
    "Perimeter",
    "Geodesic",
    "SolidAngle",
    "vote",
    "Votes",
    "localize",
    "Options",
    "Paper",
    "Localization",
    "Reason",
    "Verdict",
    "Kind",
    "cramer_rao",
    "Bound",
]
