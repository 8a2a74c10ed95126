"""render: load a Mitsuba scene, take its lights out, observe it. The only folder that sees it."""

import lightloc.backend  # noqa: F401  (first: it chooses the LLVM library)
from render.camera import photograph
from render.descent import optimize
from render.exr import read_exr, write_exr
from render.files import files_of
from render.interreflection import interreflected
from render.observe import attach, observe, remeasure
from render.pixels import observe_view
from render.room import Room, SceneGeometry, load, relight, standard_scenes, triangles
from render.view import View

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
