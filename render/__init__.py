"""render: load a Mitsuba scene, take its lights out, observe it."""

import lightloc.backend  # before anything else here: it chooses the LLVM library
from render.observe import attach, observe
from render.room import Room, SceneGeometry, load, relight, standard_scenes

__all__ = [
    "Room",
    "SceneGeometry",
    "attach",
    "lightloc",
    "load",
    "observe",
    "relight",
    "standard_scenes",
]
