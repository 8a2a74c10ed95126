"""render: load a Mitsuba scene, take its lights out, observe it. The only folder that sees it."""

import lightloc.backend  # noqa: F401  (first: it chooses the LLVM library)
from render.alone import alone
from render.camera import photograph
from render.descent import optimize
from render.exr import read_exr, write_exr
from render.files import files_of
from render.interreflection import interreflected
from render.observe import attach, observe, remeasure
from render.pixels import observe_view
from render.room import Room, SceneGeometry, load, relight, standard_scenes, triangles
from render.view import View

attach = alone(attach)
files_of = alone(files_of)
interreflected = alone(interreflected)
load = alone(load)
observe = alone(observe)
observe_view = alone(observe_view)
optimize = alone(optimize)
photograph = alone(photograph)
relight = alone(relight)
remeasure = alone(remeasure)
triangles = alone(triangles)

__all__ = [
    "Room",
    "SceneGeometry",
    "View",
    "attach",
    "files_of",
    "interreflected",
    "load",
    "observe",
    "observe_view",
    "optimize",
    "photograph",
    "read_exr",
    "relight",
    "remeasure",
    "standard_scenes",
    "triangles",
    "write_exr",
]
