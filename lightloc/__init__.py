"""lightloc: find the point lights that light a room. The public names, in pipeline order."""

import lightloc.backend  # noqa: F401  (first: it chooses the LLVM library)
from lightloc.answer import (
    Assumption,
    Count,
    Departed,
    Kind,
    Localization,
    Noise,
    NoiseLaw,
    Outliers,
    Reason,
    Step,
    Verdict,
    Way,
    Where,
)
from lightloc.brdf import BRDF, Conductor, FromNumPy, Irradiance, Lambert, Mixed, Plastic, Sum
from lightloc.fields import Grid, intensity, intensity_distance
from lightloc.fit import Bound, cramer_rao
from lightloc.given import (
    Geometry,
    Interreflecting,
    Limits,
    Observations,
    Options,
    OtherwiseLit,
    PointLights,
    read_readings,
    remove_known,
)
from lightloc.interreflection import remove_indirect
from lightloc.localize import localize
from lightloc.optics import check_gradient, radiance, shading, shading_gradient
from lightloc.paper import Geodesic, Paper, Perimeter, SolidAngle, Surface, Votes, vote
from lightloc.plane import Outline

__version__ = "0.1.0"

__all__ = [  # in pipeline order
    "PointLights",
    "Lambert",
    "Conductor",
    "Plastic",
    "Mixed",
    "Sum",
    "FromNumPy",
    "Irradiance",
    "BRDF",
    "Observations",
    "read_readings",
    "Geometry",
    "Interreflecting",
    "OtherwiseLit",
    "remove_known",
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
    "Step",
    "Verdict",
    "Kind",
    "Departed",
    "Noise",
    "NoiseLaw",
    "Limits",
    "Outliers",
    "Where",
    "Count",
    "Assumption",
    "Way",
    "cramer_rao",
    "Bound",
]
