"""Reflection at a surface: materials, their microfacets, and bounds on both.

For other rooms, in pipeline order:

- `BRDF`: what a material must offer.
- `Lambert`: diffuse reflection.
- `Conductor`: a rough metal, GGX.
- `Plastic`: a rough dielectric coat over a diffuse base.
- `Mixed`: a different material at each observation.
- `Sum`: materials that reflect together.
- `FromNumPy`: a BRDF as a function over NumPy arrays.
- `Parts`: materials that are made of others.
- `Irradiance`: stands for a light meter at each observation.
- `rows_of`: the material of some of the observations.
- `is_traced`: whether kernels can hold a material.
- `SceneMaterial`: stands in a file for a BSDF that only its scene can evaluate.
- `stored`: a material as arrays by name, for a file.
- `restored`: and back.
- `Parameters`: materials whose fields are numbers.
- `evaluate`: f (n . l)+ at chosen directions, as an array.
- `is_brdf`: whether a value is such a material.
- `Scatter`: f (n . l)+ as a function of the observation's index and directions.
- `Slope`: S without visibility, and its derivative, as a function of the same.
- `Sloped`: a material that has the derivative in closed form.
- `Bounded`: a material that says what f (n . l)+ is at most.
- `Ceiling`: that bound, two numbers per observation.
- `channels_last`: a kernel's result as a NumPy array with the channels last.
"""

from lightloc.brdf.ceiling import Ceiling
from lightloc.brdf.in_numpy import FromNumPy
from lightloc.brdf.mixed import Mixed
from lightloc.brdf.models import Conductor, Lambert, Plastic
from lightloc.brdf.parameters import Parameters, channels_last
from lightloc.brdf.parts import Parts
from lightloc.brdf.protocol import BRDF, Bounded, Scatter, Slope, Sloped, evaluate, is_brdf
from lightloc.brdf.readings import Irradiance
from lightloc.brdf.rows import is_traced, rows_of
from lightloc.brdf.stored import SceneMaterial, restored, stored
from lightloc.brdf.sum import Sum

__all__ = [
    "BRDF",
    "Lambert",
    "Conductor",
    "Plastic",
    "Mixed",
    "Sum",
    "FromNumPy",
    "Parts",
    "Irradiance",
    "rows_of",
    "is_traced",
    "SceneMaterial",
    "stored",
    "restored",
    "Parameters",
    "evaluate",
    "is_brdf",
    "Scatter",
    "Slope",
    "Sloped",
    "Bounded",
    "Ceiling",
    "channels_last",
]
