"""render: load a Mitsuba scene, take its lights out, observe it. The only folder that sees it."""

import lightloc.backend  # noqa: F401  (first: it chooses the LLVM library)
from render.alone import alone
from render.camera import photograph
from render.descent import Adam, optimize
from render.exr import is_view, read_exr, write_exr
from render.files import files_of
from render.interreflection import interreflected
from render.observe import attach, observe, remeasure
from render.picture import Picture, read_picture
from render.pictured import observe_picture
from render.pixels import observe_view
from render.room import Room, SceneGeometry, load, relight, standard_scenes
from render.tessellation import triangles
from render.view import View

attach = alone(attach)
files_of = alone(files_of)
interreflected = alone(interreflected)
load = alone(load)
observe = alone(observe)
observe_picture = alone(observe_picture)
observe_view = alone(observe_view)
optimize = alone(optimize)
photograph = alone(photograph)
relight = alone(relight)
remeasure = alone(remeasure)
triangles = alone(triangles)

__all__ = [
    "Adam",
    "Picture",
    "Room",
    "SceneGeometry",
    "View",
    "attach",
    "files_of",
    "interreflected",
    "is_view",
    "load",
    "observe",
    "observe_picture",
    "observe_view",
    "optimize",
    "photograph",
    "read_exr",
    "read_picture",
    "relight",
    "remeasure",
    "standard_scenes",
    "triangles",
    "write_exr",
]
